//! The page on a study: its table, error and efficiency over every numeric axis, and the individual trials where
//! available.

use super::figure::{Axes, Mark, Stroke, color, css, laws};
use super::page::{escape, figure, number, page, table};
use super::trials::trials;
use catoptric_assess::study::{ElementAngles, MethodSummary, Study, Summary};
use plotters::style::BLACK;

const SIZE: (u32, u32) = (640, 360);

/// Returns the page, as HTML. `elements` holds the elements of all runs, or is empty.
pub fn study(name: &str, study: &Study, summary: &Summary, elements: &[ElementAngles]) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">A study over {} seeds</p>\n</header>\n",
        escape(name),
        summary.seeds
    );
    let names = axis_names(summary);
    for axis in names.iter().filter(|axis| points(summary, axis).len() > 1) {
        html += &over(summary, axis);
    }
    let mut headings = vec!["method", "verdict"];
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
    ]);
    let rows: Vec<Vec<String>> = summary.methods.iter().map(|m| row(m, &names)).collect();
    html += &table(&headings, &rows);
    html += &trials(study, elements);
    html += "<footer>Errors are per axis of the tangent plane. The limit is that of any unbiased estimate from these \
             boards; efficiency is the inverse of the mean of error² over limit² over runs. ANEES and coverage use one \
             element of each run, since the elements of a run share their errors; bounds are those of an honest \
             covariance at 99.9 %.</footer>\n";
    page(&format!("{name} – catoptric study"), &html)
}

fn row(m: &MethodSummary, names: &[String]) -> Vec<String> {
    let mut row = vec![m.method.clone(), m.verdict.clone()];
    row.extend(names.iter().map(|n| m.axes.get(n).cloned().unwrap_or_default()));
    let share = |share: f64, [low, high]: [f64; 2]| {
        format!("{} ({} to {})", number(share, 3), number(low, 3), number(high, 3))
    };
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
        share(m.coverage_68, m.coverage_68_interval),
        share(m.coverage_95, m.coverage_95_interval),
        share(m.coverage_99, m.coverage_99_interval),
        number(m.bias_p_value, 3),
        number(m.solved, 1),
    ]);
    row
}

fn axis_names(summary: &Summary) -> Vec<String> {
    summary
        .methods
        .first()
        .map_or_else(Vec::new, |m| m.axes.keys().cloned().collect())
}

/// Returns the numeric values of an axis.
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

/// What is drawn over an axis: one contestant, with the values of all other axes fixed.
struct Series {
    name: String,
    /// Values of the axis, and the figures at each.
    at: Vec<(f64, MethodSummary)>,
}

fn series(summary: &Summary, axis: &str) -> Vec<Series> {
    let mut all: Vec<Series> = Vec::new();
    for m in &summary.methods {
        let Some(x) = m.axes.get(axis).and_then(|v| v.parse().ok()) else {
            continue;
        };
        let others = m.axes.iter().filter(|(key, _)| *key != axis);
        let others: Vec<String> = others.map(|(key, value)| format!("{key} = {value}")).collect();
        let name = if others.is_empty() {
            m.method.clone()
        } else {
            format!("{}, {}", m.method, others.join(", "))
        };
        match all.iter_mut().find(|s| s.name == name) {
            Some(known) => known.at.push((x, m.clone())),
            None => all.push(Series {
                name,
                at: vec![(x, m.clone())],
            }),
        }
    }
    for one in &mut all {
        one.at.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    all
}

/// Plots error and efficiency over an axis, one line per contestant, and the limit in black.
fn over(summary: &Summary, axis: &str) -> String {
    let all = series(summary, axis);
    let drawn = |of: fn(&MethodSummary) -> f64, s: &Series| -> Vec<(f64, f64)> {
        let points = s.at.iter().map(|(x, m)| (*x, of(m)));
        points.filter(|(_, y)| y.is_finite()).collect()
    };
    let mut limits: Vec<Vec<(f64, f64)>> = Vec::new();
    for s in &all {
        let line = drawn(|m| m.crlb_per_axis_deg, s);
        // Contestants that solve the same elements have the same limit.
        if !line.is_empty() && !limits.contains(&line) {
            limits.push(line);
        }
    }
    let plot = |of: fn(&MethodSummary) -> f64, label: &str, title: &str, beneath: &[Vec<(f64, f64)>]| {
        let mut strokes: Vec<Stroke> = beneath
            .iter()
            .map(|line| stroke(line.clone(), BLACK, 1))
            .collect();
        let mut marks = Vec::new();
        for (i, s) in all.iter().enumerate() {
            let line = drawn(of, s);
            marks.extend(line.iter().map(|(x, y)| Mark {
                x: *x,
                y: *y,
                half_bar: 0.0,
                color: color(i),
                hollow: false,
            }));
            strokes.push(stroke(line, color(i), 2));
        }
        let highest = strokes
            .iter()
            .flat_map(|s| &s.points)
            .fold(0.0, |h: f64, p| h.max(p.1));
        let x = points(summary, axis);
        let (low, high) = (x[0], x[x.len() - 1]);
        let margin = 0.04 * (high - low);
        let axes = Axes {
            x: low - margin..high + margin,
            y: 0.0..1.08 * if highest > 0.0 { highest } else { 1.0 },
            x_label: axis.to_owned(),
            y_label: label.to_owned(),
        };
        laws(SIZE, &axes, &format!("{title} over {axis}"), &marks, &strokes)
    };
    let best: Vec<Vec<(f64, f64)>> = vec![points(summary, axis).iter().map(|x| (*x, 1.0)).collect()];
    let plots = plot(
        |m| m.per_axis_rms_deg,
        "per-axis error, rms (°)",
        "Per-axis error",
        &limits,
    ) + &plot(|m| m.efficiency, "efficiency", "Efficiency", &best);
    let mut legend: Vec<(String, String)> = all
        .iter()
        .enumerate()
        .map(|(i, s)| (css(color(i)), s.name.clone()))
        .collect();
    legend.push(("currentColor".to_owned(), "limit".to_owned()));
    let rows: Vec<Vec<String>> = all
        .iter()
        .flat_map(|s| s.at.iter().map(move |(x, m)| (s, x, m)))
        .map(|(s, x, m)| {
            vec![
                s.name.clone(),
                x.to_string(),
                number(m.per_axis_rms_deg, 4),
                number(m.crlb_per_axis_deg, 4),
                number(m.efficiency, 3),
                number(m.efficiency_se, 3),
            ]
        })
        .collect();
    figure(
        &plots,
        &format!("Root mean square error per axis, and efficiency, over {axis}; the limit in black."),
        &legend,
        &["method", axis, "rms (°)", "limit (°)", "efficiency", "±"],
        &rows,
    )
}

fn stroke(points: Vec<(f64, f64)>, color: plotters::style::RGBColor, width: u32) -> Stroke {
    Stroke {
        points,
        color,
        width,
        opacity: 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_assess::study::{Contestant, from_csv, summarize, to_csv};

    /// Two axes with two values each, and the oracle's errors as given.
    fn summary(errors: [f64; 4]) -> (Study, Summary) {
        let scene =
            toml::from_str(include_str!("../../../scenes/reference-facet.toml")).expect("it is valid");
        let mut study = Study::of_scene(scene, 1, vec![Contestant::Oracle]);
        let values = [["1", "5"], ["1", "6"], ["2", "5"], ["2", "6"]];
        let cell = |pair: [&str; 2]| {
            let mut cell = study.cells[0].clone();
            cell.values = ["a_mm", "b_mm"]
                .into_iter()
                .zip(pair)
                .map(|(k, v)| (k.to_owned(), v.to_owned()))
                .collect();
            cell
        };
        study.cells = values.map(cell).to_vec();
        let rows: String = errors
            .iter()
            .enumerate()
            .map(|(i, e)| format!("{i},1,oracle,1,0,0,0,{},,1e-8,,0,,,,,,\n", e * e))
            .collect();
        let runs = from_csv(&(to_csv(&[]) + &rows)).expect("they are runs");
        let summary = summarize(&study, &runs);
        (study, summary)
    }

    #[test]
    fn every_axis_is_drawn_for_each_value_of_the_others() {
        let (study_of, summary) = summary([1e-4, 2e-4, 3e-4, 4e-4]);
        let lines = series(&summary, "a_mm");
        let names: Vec<&str> = lines.iter().map(|s| s.name.as_str()).collect();
        assert_eq!(names, ["oracle, b_mm = 5", "oracle, b_mm = 6"]);
        let rms: Vec<f64> = lines[1].at.iter().map(|(_, m)| m.per_axis_rms_deg).collect();
        assert!(
            (rms[0] - 2e-4_f64.to_degrees()).abs() < 1e-12 && (rms[1] - 4e-4_f64.to_degrees()).abs() < 1e-12
        );
        assert!((lines[0].at[0].1.efficiency - 1.0).abs() < 1e-12);
        let html = study("name", &study_of, &summary, &[]);
        for title in [
            "Per-axis error over a_mm",
            "Efficiency over a_mm",
            "Per-axis error over b_mm",
        ] {
            assert!(html.contains(title), "{title}");
        }
        assert_eq!(html.matches("<svg").count(), 4);
    }
}
