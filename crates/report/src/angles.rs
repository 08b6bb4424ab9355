//! θ_a and φ of one mirror's elements in every trial, with and without corrections, as in the paper's Figure 10.

use super::figure::{Axes, Stroke, color, css, laws};
use super::page::{figure, number};
use catoptric_assess::study::{ElementAngles, Spread};
use plotters::style::{BLACK, RGBColor};
use std::collections::BTreeMap;

const SIZE: (u32, u32) = (640, 360);

/// Symbols of the two angles.
pub(super) const NAMES: [&str; 2] = ["θ_a", "φ"];

/// Palette indices for angles with corrections, and without.
const COLORS: [usize; 2] = [0, 1];

/// Returns two plots for each contestant of a cell that also ran uncorrected. `single` selects whether to draw every
/// trial.
pub(super) fn angles(spreads: &[&Spread], elements: &[&ElementAngles], single: bool) -> String {
    let mut methods: Vec<&str> = spreads.iter().map(|s| s.method.as_str()).collect();
    methods.dedup();
    let of =
        |method: &str| -> Vec<&Spread> { spreads.iter().copied().filter(|s| s.method == method).collect() };
    let mut html = String::new();
    for method in &methods {
        let other = format!("{method} uncorrected");
        if methods.contains(&other.as_str()) {
            let trials = |name: &str| -> Vec<&ElementAngles> {
                let of_name = elements.iter().copied().filter(|e| e.method == name);
                if single { of_name.collect() } else { Vec::new() }
            };
            let pair = [of(method), of(&other)];
            html += &both(method, &pair, &[trials(method), trials(&other)]);
        }
    }
    html
}

fn both(method: &str, spreads: &[Vec<&Spread>; 2], trials: &[Vec<&ElementAngles>; 2]) -> String {
    let plots = [0, 1].map(|i| plot(method, i, spreads, trials)).concat();
    let mut legend: Vec<(String, String)> = ["with corrections", "without"]
        .iter()
        .zip(COLORS)
        .map(|(name, c)| (css(color(c)), (*name).to_owned()))
        .collect();
    legend.push(("currentColor".to_owned(), "truth".to_owned()));
    let without: BTreeMap<usize, &Spread> = spreads[1].iter().map(|s| (s.beam, *s)).collect();
    let rows: Vec<Vec<String>> = spreads[0]
        .iter()
        .map(|s| {
            let mut row = vec![s.beam.to_string()];
            for i in [0, 1] {
                let other = without.get(&s.beam).map_or(f64::NAN, |o| o.mean[i]);
                row.extend([truth(s, i), s.mean[i], other].map(|a| number(a, 3)));
            }
            row
        })
        .collect();
    figure(
        &plots,
        &format!(
            "θ_a and φ of every element by “{}”, with and without bias corrections: each trial as a faint line, their mean as a thick line.",
            method
        ),
        &legend,
        &["beam", "θ_a (°)", "with", "without", "φ (°)", "with", "without"],
        &rows,
    )
}

/// Mean true angle over the trials.
fn truth(s: &Spread, i: usize) -> f64 {
    s.mean[i] - s.error_mean[i]
}

/// Plots one angle over the beams.
fn plot(method: &str, i: usize, spreads: &[Vec<&Spread>; 2], trials: &[Vec<&ElementAngles>; 2]) -> String {
    let mut strokes = Vec::new();
    for ((spreads, trials), c) in spreads.iter().zip(trials).zip(COLORS) {
        let means: BTreeMap<usize, f64> = spreads.iter().map(|s| (s.beam, s.mean[i])).collect();
        let mut lines: BTreeMap<u64, Vec<(f64, f64)>> = BTreeMap::new();
        for e in trials {
            let mean = means.get(&e.beam).copied().unwrap_or(e.estimate[i]);
            // Within 180° of the mean, so that lines do not jump at ±180°.
            let from_mean = e.estimate[i] - mean;
            let angle = mean + from_mean - 360.0 * (from_mean / 360.0).round();
            lines.entry(e.seed).or_default().push((e.beam as f64, angle));
        }
        strokes.extend(lines.into_values().map(|points| stroke(points, color(c), 1, 0.3)));
        let mean = means
            .into_iter()
            .map(|(beam, mean)| (beam as f64, mean))
            .collect();
        strokes.push(stroke(mean, color(c), 2, 1.0));
    }
    let true_angles = spreads[0].iter().map(|s| (s.beam as f64, truth(s, i))).collect();
    strokes.push(stroke(true_angles, BLACK, 1, 1.0));
    let all = || strokes.iter().flat_map(|s| &s.points);
    let range = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = all()
            .map(of)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
        let margin = (0.04 * (high - low)).max(0.1);
        low - margin..high + margin
    };
    let axes = Axes {
        x: range(|p| p.0),
        y: range(|p| p.1),
        x_label: "beam".to_owned(),
        y_label: format!("{} (°)", NAMES[i]),
    };
    let title = format!("{} by {method}, with and without corrections", NAMES[i]);
    laws(SIZE, &axes, &title, &[], &strokes)
}

fn stroke(mut points: Vec<(f64, f64)>, color: RGBColor, width: u32, opacity: f64) -> Stroke {
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    Stroke {
        points,
        color,
        width,
        opacity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_assess::study::spread;

    #[test]
    fn angles_are_drawn_only_where_both_runs_exist() {
        let element = |seed: u64, method: &str, beam: usize, azimuth: f64| ElementAngles {
            cell: 0,
            seed,
            method: method.to_owned(),
            beam,
            estimate: [azimuth, 50.0],
            truth: [179.5, 50.25],
        };
        let elements = [
            element(1, "beam", 7, 179.0),
            element(2, "beam", 7, -179.0),
            element(1, "beam uncorrected", 7, 178.0),
            element(2, "beam uncorrected", 7, 179.0),
            element(1, "joint", 7, 179.0),
        ];
        let refs: Vec<&ElementAngles> = elements.iter().collect();
        let spreads = spread(&elements);
        let of: Vec<&Spread> = spreads.iter().collect();
        let html = angles(&of, &refs, true);
        assert_eq!(html.matches("<svg").count(), 2);
        assert!(html.contains("by “beam”") && !html.contains("joint"), "{html}");
        // The mean of 179° and 181°, of 178° and 179°, and the truth.
        let row = "7</th><td>179.500</td><td>180.000</td><td>178.500</td><td>50.250</td><td>50.000</td>";
        assert!(html.contains(row), "{html}");
        let alone: Vec<&Spread> = spreads.iter().filter(|s| s.method == "joint").collect();
        assert_eq!(angles(&alone, &refs, true), "");
    }
}
