//! Plots of every element's angles: their errors where there is a truth, else the estimates.

use super::super::figure::Dot;
use super::super::page::{figure as block, number};
use super::azimuth::over_azimuth;
use super::elements::{azimuth_deg, color_of, facet_name, facet_of, legend, solved};
use catoptric_assess::score::Score;
use catoptric_model::{Calibration, Dataset};

/// Both angles of an element, or their errors, in degrees; σ is NaN where it is not stated.
struct Angles {
    beam: usize,
    /// The facet whose color it has.
    facet: Option<usize>,
    mirror: String,
    values: [f64; 2],
    sigma: [f64; 2],
}

/// Titles, names and caption of the plots of the two angles.
struct Style {
    titles: [&'static str; 2],
    names: [&'static str; 2],
    decimals: usize,
    with_bands: bool,
    caption: &'static str,
}

/// Plots the errors of θ and φ with their ±2σ bands.
pub(crate) fn errors(dataset: &Dataset, calibration: &Calibration, score: &Score) -> String {
    let elements = score.scored().map(|e| Angles {
        beam: e.beam,
        facet: calibration.beam(e.beam).and_then(|b| facet_of(dataset, b)),
        mirror: e.facet.clone(),
        values: [e.across, e.up].map(f64::to_degrees),
        sigma: e.sigma.unwrap_or([f64::NAN; 2]).map(f64::to_degrees),
    });
    let style = Style {
        titles: ["Across: cos φ·δθ (°)", "Up: δφ (°)"],
        names: ["cos φ·δθ (°)", "δφ (°)"],
        decimals: 4,
        with_bands: true,
        caption: "Error of every solved, unsplit element against the truth, with the ±2σ band of its stated covariance. \
                  About 19 of 20 dots should be on their band. Dots that move together along a mirror share an error: a \
                  board, a bias, the mounting; dots that scatter do not. Errors beyond the axis are drawn at its end.",
    };
    show(dataset, &elements.collect::<Vec<_>>(), &style)
}

/// Plots the estimates of θ and φ, where there is no truth.
pub(crate) fn estimates(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let elements = solved.iter().map(|s| {
        let covariance = s.estimate.covariance_rad2.unwrap_or([[f64::NAN; 2]; 2]);
        Angles {
            beam: s.estimate.beam,
            facet: s.facet,
            mirror: facet_name(dataset, s.facet),
            values: [s.deflection.azimuth, s.deflection.elevation].map(f64::to_degrees),
            sigma: [covariance[0][0], covariance[1][1]].map(|c| c.sqrt().to_degrees()),
        }
    });
    let style = Style {
        titles: ["θ, azimuth added by the mirror (°)", "φ, elevation (°)"],
        names: ["θ (°)", "φ (°)"],
        decimals: 3,
        with_bands: false,
        caption: "Estimates for every solved element. A plane mirror gives a smooth curve; a dot off the curve of its \
                  mirror is a suspect element.",
    };
    show(dataset, &elements.collect::<Vec<_>>(), &style)
}

fn show(dataset: &Dataset, elements: &[Angles], style: &Style) -> String {
    let mut svgs = String::new();
    for (axis, title) in style.titles.iter().enumerate() {
        let dot = |e: &Angles| Dot {
            x: azimuth_deg(dataset, e.beam),
            y: e.values[axis],
            half_band: if style.with_bands && !e.sigma[axis].is_nan() {
                2.0 * e.sigma[axis]
            } else {
                0.0
            },
            color: color_of(e.facet),
        };
        let dots: Vec<Dot> = elements.iter().map(dot).collect();
        svgs += &over_azimuth(dataset, title, &dots);
    }
    let row = |e: &Angles| {
        vec![
            e.beam.to_string(),
            number(azimuth_deg(dataset, e.beam), 2),
            e.mirror.clone(),
            number(e.values[0], style.decimals),
            number(e.sigma[0], 4),
            number(e.values[1], style.decimals),
            number(e.sigma[1], 4),
        ]
    };
    let rows: Vec<Vec<String>> = elements.iter().map(row).collect();
    let [first, second] = style.names;
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        first,
        "its σ (°)",
        second,
        "its σ (°)",
    ];
    block(&svgs, style.caption, &legend(dataset), &headings, &rows)
}
