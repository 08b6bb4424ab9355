//! The plot of the residuals of the fit.

use super::super::figure::{self, Dot};
use super::super::page::{count, figure as block, number};
use super::azimuth::parted;
use super::elements::{Solved, azimuth_deg, color_of, facet_name, legend, solved};
use catoptric_model::{Calibration, Dataset};

/// Plots the residual of every element that states one.
pub(crate) fn residuals(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let of: Vec<(&Solved, f64)> = solved
        .iter()
        .filter_map(|s| Some((s, s.estimate.rms_residual_m? * 1e3)))
        .collect();
    let dots: Vec<Dot> = of
        .iter()
        .map(|(s, mm)| Dot {
            x: azimuth_deg(dataset, s.estimate.beam),
            y: *mm,
            half_band: 0.0,
            color: color_of(s.facet),
        })
        .collect();
    let title = "Residual of the fit (mm, rms over the boards)";
    let y = 0.0..figure::around_zero(dots.iter().map(|d| d.y)).end;
    let plot = parted(dataset, title, "(mm)", &y, &dots);
    let mut rows: Vec<Vec<String>> = of
        .iter()
        .map(|(s, mm)| {
            vec![
                s.estimate.beam.to_string(),
                number(azimuth_deg(dataset, s.estimate.beam), 2),
                facet_name(dataset, s.facet),
                number(*mm, 2),
                count(s.estimate.poses),
                count(s.estimate.readings),
                count(s.estimate.iterations),
            ]
        })
        .collect();
    if rows.is_empty() {
        rows.push(vec!["No solved element states a residual.".to_owned()]);
    }
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "Residual (mm)",
        "Boards",
        "Readings",
        "Steps",
    ];
    let caption = "How far the ranges of an element are from the boards once its direction is fitted. Residuals should \
                   be as large as drift and board errors; a mirror with larger ones has a badly tracked board, a single \
                   element with larger ones is split by an edge.";
    block(&plot, caption, &legend(dataset), &headings, &rows)
}
