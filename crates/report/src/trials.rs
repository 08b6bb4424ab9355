//! The individual trials of a study, as in the paper's Figure 10: θ and φ of every element in each trial, their mean
//! and their scatter.

use super::angles::{NAMES, angles};
use super::figure::{Axes, Stroke, around_zero, color, css, laws};
use super::page::{escape, figure, number, table};
use catoptric_assess::study::{ElementAngles, Spread, Study, spread};
use std::collections::BTreeMap;

const SIZE: (u32, u32) = (640, 360);

/// Number of trials beyond which only their mean and scatter are drawn.
const MAX_TRIALS: u64 = 30;

/// The paper's colors, blue for θ and magenta for φ, or the closest of the palette.
const COLORS: [usize; 2] = [0, 3];

/// Returns a section for every cell with a figure for every contestant; empty without elements.
pub(super) fn trials(study: &Study, elements: &[ElementAngles]) -> String {
    let spreads = spread(elements);
    let mut html = String::new();
    for (index, cell) in study.cells.iter().enumerate() {
        let of_cell: Vec<&Spread> = spreads.iter().filter(|s| s.cell == index).collect();
        if of_cell.is_empty() {
            continue;
        }
        let values: Vec<String> = cell.values.iter().map(|(k, v)| format!("{k} = {v}")).collect();
        let heading = if values.is_empty() {
            "Every trial".to_owned()
        } else {
            format!("Every trial: {}", values.join(", "))
        };
        html += &format!("<h2>{}</h2>\n", escape(&heading));
        let mut methods: Vec<&str> = of_cell.iter().map(|s| s.method.as_str()).collect();
        methods.dedup();
        html += &overall(&of_cell, &methods);
        let in_cell: Vec<&ElementAngles> = elements.iter().filter(|e| e.cell == index).collect();
        html += &angles(&of_cell, &in_cell, study.seeds <= MAX_TRIALS);
        // The same limits for all contestants, so that they can be compared by eye.
        let limits = around_zero(
            elements
                .iter()
                .filter(|e| e.cell == index)
                .flat_map(ElementAngles::error),
        );
        for method in methods {
            let of_method: Vec<&Spread> = of_cell.iter().copied().filter(|s| s.method == method).collect();
            let lines = if study.seeds <= MAX_TRIALS {
                single(elements.iter().filter(|e| e.cell == index && e.method == method))
            } else {
                Vec::new()
            };
            html += &of_contestant(method, &of_method, lines, limits.clone());
        }
    }
    html
}

/// One row per contestant: means over its elements.
fn overall(spreads: &[&Spread], methods: &[&str]) -> String {
    let row = |method: &&str| {
        let of_method: Vec<&&Spread> = spreads.iter().filter(|s| s.method == **method).collect();
        let n = of_method.len() as f64;
        let mean = |i: usize| of_method.iter().map(|s| s.error_mean[i]).sum::<f64>() / n;
        let scatter = |i: usize| {
            let known = of_method
                .iter()
                .map(|s| s.error_sd[i])
                .filter(|sd| sd.is_finite());
            let (sum, count) = known.fold((0.0, 0.0), |(sum, count), sd| (sum + sd * sd, count + 1.0));
            (sum / count).sqrt()
        };
        vec![
            (*method).to_owned(),
            of_method.len().to_string(),
            number(mean(0), 4),
            number(scatter(0), 4),
            number(mean(1), 4),
            number(scatter(1), 4),
        ]
    };
    let headings = [
        "method",
        "elements",
        "θ_a: mean error (°)",
        "θ_a: scatter (°)",
        "φ: mean error (°)",
        "φ: scatter (°)",
    ];
    table(&headings, &methods.iter().map(row).collect::<Vec<_>>())
}

/// A faint line for each angle of each trial.
fn single<'e>(elements: impl Iterator<Item = &'e ElementAngles>) -> Vec<Stroke> {
    let mut trials: BTreeMap<u64, Vec<&ElementAngles>> = BTreeMap::new();
    for e in elements {
        trials.entry(e.seed).or_default().push(e);
    }
    let line = |trial: &Vec<&ElementAngles>, i: usize| {
        let mut points: Vec<(f64, f64)> = trial.iter().map(|e| (e.beam as f64, e.error()[i])).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        stroke(points, i, 1, 0.3)
    };
    trials
        .values()
        .flat_map(|trial| [line(trial, 0), line(trial, 1)])
        .collect()
}

fn of_contestant(method: &str, spreads: &[&Spread], lines: Vec<Stroke>, y: std::ops::Range<f64>) -> String {
    let mut strokes = lines;
    for i in [0, 1] {
        let at = |sds: f64| -> Vec<(f64, f64)> {
            let points = spreads
                .iter()
                .map(|s| (s.beam as f64, s.error_mean[i] + sds * s.error_sd[i]));
            points.filter(|p| p.1.is_finite()).collect()
        };
        let mean = spreads.iter().map(|s| (s.beam as f64, s.error_mean[i])).collect();
        strokes.extend([
            stroke(at(-1.0), i, 1, 1.0),
            stroke(at(1.0), i, 1, 1.0),
            stroke(mean, i, 3, 1.0),
        ]);
    }
    let beams = || spreads.iter().map(|s| s.beam);
    let (first, last) = (
        beams().min().unwrap_or(0) as f64,
        beams().max().unwrap_or(0) as f64,
    );
    let axes = Axes {
        x: first - 1.0..last + 1.0,
        y,
        x_label: "beam".to_owned(),
        y_label: "error (°)".to_owned(),
    };
    let title = format!("Trials of {method}");
    let svg = laws(SIZE, &axes, &title, &[], &strokes);
    let legend: Vec<(String, String)> = [0, 1]
        .iter()
        .map(|i| (css(color(COLORS[*i])), NAMES[*i].to_owned()))
        .collect();
    let rows: Vec<Vec<String>> = spreads.iter().map(|s| row(s)).collect();
    figure(
        &svg,
        &format!(
            "“{method}”: errors of every element, each trial as a faint line, their mean as a thick line between lines \
             one standard deviation away.",
        ),
        &legend,
        &[
            "beam",
            "trials",
            "θ_a (°)",
            "sd (°)",
            "φ (°)",
            "sd (°)",
            "θ_a: mean error (°)",
            "φ: mean error (°)",
        ],
        &rows,
    )
}

fn row(s: &Spread) -> Vec<String> {
    vec![
        s.beam.to_string(),
        s.trials.to_string(),
        number(s.mean[0], 4),
        number(s.sd[0], 4),
        number(s.mean[1], 4),
        number(s.sd[1], 4),
        number(s.error_mean[0], 4),
        number(s.error_mean[1], 4),
    ]
}

fn stroke(points: Vec<(f64, f64)>, angle: usize, width: u32, opacity: f64) -> Stroke {
    Stroke {
        points,
        color: color(COLORS[angle]),
        width,
        opacity,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_assess::study::Contestant;

    #[test]
    fn trials_are_drawn_where_available() {
        let scene =
            toml::from_str(include_str!("../../../scenes/reference-facet.toml")).expect("it is valid");
        let study = Study::of_scene(scene, 2, vec![Contestant::Oracle]);
        assert_eq!(trials(&study, &[]), "");
        let element = |seed: u64, beam: usize, error: f64| ElementAngles {
            cell: 0,
            seed,
            method: "a & b".to_owned(),
            beam,
            estimate: [10.0 + error, 50.0 - error],
            truth: [10.0, 50.0],
        };
        let html = trials(
            &study,
            &[
                element(1, 7, 0.1),
                element(1, 8, 0.3),
                element(2, 7, 0.3),
                element(2, 8, 0.5),
            ],
        );
        assert!(
            html.contains("Trials of a &amp; b") && html.contains("<td>10.2000</td><td>0.1414</td>"),
            "{html}"
        );
        // Four faint lines, two means, and four lines one standard deviation away.
        assert_eq!(html.matches("<polyline").count() - html_frame(), 10);
        assert!(
            html.contains("<td>0.3000</td><td>0.1414</td><td>−0.3000</td>"),
            "{html}"
        );
    }

    /// Number of polylines in an empty plot, those of its frame.
    fn html_frame() -> usize {
        let axes = Axes {
            x: 6.0..9.0,
            y: around_zero([0.1, 0.3, 0.3, 0.5].into_iter()),
            x_label: "beam".to_owned(),
            y_label: "error (°)".to_owned(),
        };
        laws(SIZE, &axes, "", &[], &[]).matches("<polyline").count()
    }
}
