//! The angles of every element: their errors where there is a truth, else the estimates.

use super::super::figure::Dot;
use super::super::page::{figure as block, number};
use super::azimuth::over_azimuth;
use super::elements::{Solved, azimuth_deg, color_of, facet_name, facet_of, legend, solved};
use crate::score::Score;
use catoptric_model::{Calibration, Dataset};

/// Errors of θ and φ with their ±2σ bands.
pub(in crate::report) fn errors(dataset: &Dataset, calibration: &Calibration, score: &Score) -> String {
    let facet = |beam| calibration.beam(beam).and_then(|b| facet_of(dataset, b));
    let mut svgs = String::new();
    for (title, axis) in [("Across: cos φ·δθ (°)", 0), ("Up: δφ (°)", 1)] {
        let dots: Vec<Dot> = score
            .scored()
            .map(|e| Dot {
                x: azimuth_deg(e.beam),
                y: [e.across, e.up][axis].to_degrees(),
                half_band: e.sigma.map_or(0.0, |s| 2.0 * s[axis].to_degrees()),
                color: color_of(facet(e.beam)),
            })
            .collect();
        svgs += &over_azimuth(dataset, title, &dots);
    }
    let rows: Vec<Vec<String>> = score
        .scored()
        .map(|e| {
            let sigma = |axis: usize| e.sigma.map_or(f64::NAN, |s| s[axis].to_degrees());
            vec![
                e.beam.to_string(),
                number(azimuth_deg(e.beam), 2),
                e.facet.clone(),
                number(e.across.to_degrees(), 4),
                number(sigma(0), 4),
                number(e.up.to_degrees(), 4),
                number(sigma(1), 4),
            ]
        })
        .collect();
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "cos φ·δθ (°)",
        "its σ (°)",
        "δφ (°)",
        "its σ (°)",
    ];
    let caption = "Error of every solved, unsplit element against the truth, with the ±2σ band its covariance states. \
                   19 of 20 dots should lie on their band. Dots that run together along a mirror share an error: a board, a \
                   bias, the mounting; dots that jump do not. What is beyond the axis is drawn at its end.";
    block(&svgs, caption, &legend(dataset), &headings, &rows)
}

/// Estimates of θ and φ, where there is no truth.
pub(in crate::report) fn estimates(dataset: &Dataset, calibration: &Calibration) -> String {
    let solved = solved(dataset, calibration);
    let mut svgs = String::new();
    let angle = |s: &Solved, axis: usize| [s.deflection.azimuth, s.deflection.elevation][axis].to_degrees();
    for (title, axis) in [("θ, azimuth added by the mirror (°)", 0), ("φ, elevation (°)", 1)] {
        let dots: Vec<Dot> = solved
            .iter()
            .map(|s| Dot {
                x: azimuth_deg(s.estimate.beam),
                y: angle(s, axis),
                half_band: 0.0,
                color: color_of(s.facet),
            })
            .collect();
        svgs += &over_azimuth(dataset, title, &dots);
    }
    let rows: Vec<Vec<String>> = solved
        .iter()
        .map(|s| {
            let sigma = |axis: usize| {
                s.estimate
                    .covariance_rad2
                    .map_or(f64::NAN, |c| c[axis][axis].sqrt().to_degrees())
            };
            vec![
                s.estimate.beam.to_string(),
                number(azimuth_deg(s.estimate.beam), 2),
                facet_name(dataset, s.facet),
                number(angle(s, 0), 3),
                number(sigma(0), 4),
                number(angle(s, 1), 3),
                number(sigma(1), 4),
            ]
        })
        .collect();
    let headings = [
        "Beam",
        "Azimuth (°)",
        "Mirror",
        "θ (°)",
        "its σ (°)",
        "φ (°)",
        "its σ (°)",
    ];
    let caption = "What was estimated for every solved element. A plane mirror makes a smooth curve; a dot off the curve of \
                   its mirror is an element to look at.";
    block(&svgs, caption, &legend(dataset), &headings, &rows)
}
