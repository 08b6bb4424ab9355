//! Plots of dots over the base azimuth of the elements.

use super::super::figure::{self, Axes, Dot};
use super::elements::azimuth_deg;
use catoptric_model::Dataset;
use std::ops::Range;

/// Size of a plot over azimuth, and of each half of a split one, in pixels.
const WIDE: (u32, u32) = (980, 270);

const HALF: (u32, u32) = (490, 270);

/// Width of an interval of azimuth without elements beyond which a plot is split in two, in degrees.
const WIDE_GAP_DEG: f64 = 40.0;

/// Returns the azimuth range of all beams, with a margin.
pub(super) fn azimuth_axis(dataset: &Dataset) -> Range<f64> {
    let ends = [0, dataset.session.scanner.scan.beams() - 1].map(|beam| azimuth_deg(dataset, beam));
    ends[0].min(ends[1]) - 1.0..ends[0].max(ends[1]) + 1.0
}

/// Plots errors around zero over azimuth.
pub(super) fn over_azimuth(dataset: &Dataset, title: &str, dots: &[Dot]) -> String {
    let y = figure::around_zero(dots.iter().flat_map(|d| [d.y, d.half_band]));
    parted(dataset, title, "(°)", &y, dots)
}

/// Plots dots over azimuth; in two plots side by side if a wide sector in the middle has none.
pub(super) fn parted(dataset: &Dataset, title: &str, unit: &str, y: &Range<f64>, dots: &[Dot]) -> String {
    let whole = azimuth_axis(dataset);
    // A clockwise scan has its elements the other way round.
    let mut dots = dots.to_vec();
    dots.sort_by(|a, b| a.x.total_cmp(&b.x));
    let step_deg = dataset.session.scanner.scan.step().to_degrees();
    let gap = dots
        .iter()
        .zip(dots.iter().skip(1))
        .map(|(a, b)| a.x..b.x)
        .filter(|gap| gap.end - gap.start > WIDE_GAP_DEG)
        .max_by(|a, b| (a.end - a.start).total_cmp(&(b.end - b.start)));
    let parts = match gap {
        Some(gap) => vec![whole.start..gap.start + 2.0, gap.end - 2.0..whole.end],
        None => vec![whole],
    };
    let size = if parts.len() == 1 { WIDE } else { HALF };
    let mut svgs = String::new();
    for x in parts {
        let inside: Vec<Dot> = dots.iter().filter(|d| x.contains(&d.x)).cloned().collect();
        let axes = Axes {
            x,
            y: y.clone(),
            x_label: "Base azimuth of the element (°)".to_owned(),
            y_label: unit.to_owned(),
        };
        svgs += &format!(
            "<div>{}</div>",
            figure::per_beam(size, &axes, title, step_deg, &inside)
        );
    }
    format!("<div class=\"plot\"><h4>{title}</h4><div class=\"views\">{svgs}</div></div>\n")
}
