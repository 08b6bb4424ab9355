//! The page about a study: its table, and errors over the first axis that is a number.

use super::figure::{Axes, Mark, Stroke, color, css, laws};
use super::page::{escape, figure, number, page, table};
use crate::study::{MethodSummary, Summary};

const SIZE: (u32, u32) = (640, 360);

/// The page, as HTML.
pub fn study(name: &str, summary: &Summary) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">A study over {} seeds</p>\n</header>\n",
        escape(name),
        summary.seeds
    );
    let names = axis_names(summary);
    if let Some(axis) = names.iter().find(|axis| points(summary, axis).len() > 1) {
        html += &over(summary, axis);
    }
    let mut headings = vec!["method"];
    headings.extend(names.iter().map(String::as_str));
    headings.extend([
        "runs",
        "rms (°)",
        "median (°)",
        "room (°)",
        "limit (°)",
        "efficiency",
        "ANEES",
        "bounds",
        "68 %",
        "95 %",
        "99 %",
        "bias p",
        "solved",
        "verdict",
    ]);
    let rows: Vec<Vec<String>> = summary.methods.iter().map(|m| row(m, &names)).collect();
    html += &table(&headings, &rows);
    html += "<footer>Errors are per axis of the tangent plane. The limit is that of any estimate from these boards; \
             efficiency is the mean over runs of error² over limit², inverted. ANEES and coverage take one element of each \
             run, since those of one run share their errors; bounds are those of an honest covariance at 99.9 %.</footer>\n";
    page(&format!("{name} – catoptric study"), &html)
}

fn row(m: &MethodSummary, names: &[String]) -> Vec<String> {
    let mut row = vec![m.method.clone()];
    row.extend(names.iter().map(|n| m.axes.get(n).cloned().unwrap_or_default()));
    let share = |c: &crate::study::Coverage| number(c.share, 3);
    row.extend([
        m.runs.to_string(),
        number(m.per_axis_rms_deg, 4),
        number(m.per_axis_median_deg, 4),
        number(m.per_axis_rms_room_deg, 4),
        number(m.crlb_per_axis_deg, 4),
        format!("{} ± {}", number(m.efficiency, 3), number(m.efficiency_se, 3)),
        number(m.anees, 3),
        format!(
            "{} to {}",
            number(m.anees_bounds[0], 3),
            number(m.anees_bounds[1], 3)
        ),
        share(&m.coverage_68),
        share(&m.coverage_95),
        share(&m.coverage_99),
        number(m.bias_p_value, 3),
        number(m.solved, 1),
        m.verdict.clone(),
    ]);
    row
}

fn axis_names(summary: &Summary) -> Vec<String> {
    summary
        .methods
        .first()
        .map_or_else(Vec::new, |m| m.axes.keys().cloned().collect())
}

/// The values of an axis that are numbers.
fn points(summary: &Summary, axis: &str) -> Vec<f64> {
    let mut values: Vec<f64> = summary
        .methods
        .iter()
        .filter_map(|m| m.axes.get(axis)?.parse().ok())
        .collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// Errors over an axis, a line for each method and one for the limit.
fn over(summary: &Summary, axis: &str) -> String {
    let mut methods: Vec<&str> = summary.methods.iter().map(|m| m.method.as_str()).collect();
    methods.sort_unstable();
    methods.dedup();
    let x = points(summary, axis);
    let mut strokes = Vec::new();
    let mut marks = Vec::new();
    let mut legend = Vec::new();
    let mut highest: f64 = 0.0;
    let of = |m: &MethodSummary| m.axes.get(axis).and_then(|v| v.parse::<f64>().ok());
    for (i, method) in methods.iter().enumerate() {
        let line: Vec<(f64, f64)> = summary
            .methods
            .iter()
            .filter(|m| m.method == *method && m.per_axis_rms_deg.is_finite())
            .filter_map(|m| Some((of(m)?, m.per_axis_rms_deg)))
            .collect();
        highest = line.iter().fold(highest, |h, p| h.max(p.1));
        marks.extend(line.iter().map(|(x, y)| Mark {
            x: *x,
            y: *y,
            half_bar: 0.0,
            color: color(i),
            hollow: false,
        }));
        strokes.push(Stroke {
            points: line,
            color: color(i),
            width: 2,
            opacity: 1.0,
        });
        legend.push((css(color(i)), (*method).to_owned()));
    }
    let (low, high) = (x[0], x[x.len() - 1]);
    let margin = 0.04 * (high - low);
    let axes = Axes {
        x: low - margin..high + margin,
        y: 0.0..1.08 * highest.max(f64::MIN_POSITIVE),
        x_label: axis.to_owned(),
        y_label: "per-axis error, rms (°)".to_owned(),
    };
    let svg = laws(
        SIZE,
        &axes,
        &format!("Per-axis error over {axis}"),
        &marks,
        &strokes,
    );
    let rows: Vec<Vec<String>> = Vec::new();
    figure(
        &svg,
        &format!("Root mean square error per axis over {axis}."),
        &legend,
        &[],
        &rows,
    )
}
