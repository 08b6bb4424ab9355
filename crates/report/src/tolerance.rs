//! The page on manufacturing errors, with its plot.

use super::figure::{Area, Axes, Label, Shapes, Stroke, color, fine, round_numbers, standalone};
use super::page::{count, escape, figure, number, page, table};
use catoptric_design::tolerance::{Distribution, Tolerance};
use plotters::style::BLACK;

const SIZE: (u32, u32) = (720, 340);

/// Returns the page, as HTML.
pub fn tolerance(found: &Tolerance) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">What manufacturing errors do to this mirror layout</p>\n</header>\n",
        escape(&found.name)
    );
    html += &format!("<p>{}</p>\n", escape(&errors(found)));
    html += "<h2>Before and after calibration</h2>\n";
    html += &table(
        &["Direction, off by (°)", "rms", "median", "95 %", "maximum"],
        &stages(found),
    );
    html += "<h2>How far directions are off before calibration</h2>\n";
    html += &figure(
        &plot(found),
        "Every deflected element of every structure, by the angle between its direction as built and as drawn. The \
         lines mark the root mean square and the 95th percentile.",
        &[],
        &["From (°)", "to (°)", "elements", "share (%)"],
        &bars(found),
    );
    html += "<h2>Facet by facet</h2>\n";
    html += &table(
        &[
            "Facet",
            "elements",
            "rms (°)",
            "median (°)",
            "95 % (°)",
            "maximum (°)",
            "at 4 m, rms (mm)",
            "95 % (mm)",
            "maximum (mm)",
        ],
        &facets(found),
    );
    html += "<h2>Contribution of each kind of error</h2>\n";
    let sources: Vec<Vec<String>> = found
        .sources
        .iter()
        .map(|s| {
            vec![
                s.name.clone(),
                some(s.direction_rms_deg, 4),
                some(s.point_at_4m_rms_mm, 2),
            ]
        })
        .collect();
    html += &table(
        &["Only this error", "direction, rms (°)", "point at 4 m, rms (mm)"],
        &sources,
    );
    html += "<h2>Lost elements</h2>\n";
    html += &table(
        &["Elements", "as drawn", "as built, mean", "as built, worst"],
        &lost(found),
    );
    html += &format!(
        "<footer>Structures are built from the drawing under consecutive seeds from {}; {} loses the most elements. \
         Errors are in the sensor frame, over the elements that the same facet alone deflects in the drawing and as \
         built. Elements without a direction are split, blocked, trapped or too faint.</footer>\n",
        found.seed, found.worst_seed
    );
    page(&format!("{} – catoptric tolerance", found.name), &html)
}

/// Returns the plot as a standalone SVG file.
pub fn tolerance_plot(found: &Tolerance) -> String {
    standalone(&plot(found))
}

fn some(value: Option<f64>, decimals: usize) -> String {
    number(value.unwrap_or(f64::NAN), decimals)
}

fn errors(found: &Tolerance) -> String {
    let e = &found.errors;
    format!(
        "{} structures. Facets are turned by {}° and shifted by {} mm along every axis, and mirrors are thicker or \
         thinner by {} mm, all 1σ; their slope error is {} mrad rms. The scanner is within {}° of yaw, {}° of tilt and \
         {} mm of its nominal pose.",
        found.draws,
        e.tilt_sd_deg,
        e.shift_sd_mm,
        e.thickness_sd_mm,
        e.slope_rms_mrad,
        e.mount_yaw_tolerance_deg,
        e.mount_tilt_tolerance_deg,
        e.mount_shift_tolerance_mm
    )
}

fn stages(found: &Tolerance) -> Vec<Vec<String>> {
    let of = |d: &Distribution, decimals| [d.rms, d.median, d.p95, d.max].map(|v| some(v, decimals));
    let mut rows = vec![vec!["Before calibration".to_owned()]];
    rows[0].extend(of(&found.direction_deg, 3));
    let dash = || number(f64::NAN, 0);
    if let Some(bound) = &found.bound {
        rows.push(vec![
            format!("After, at best, over {} structures", bound.structures),
            some(bound.direction_rms_deg, 4),
            dash(),
            dash(),
            dash(),
        ]);
    }
    if let Some(calibrated) = &found.calibrated {
        rows.push(vec![
            format!("After, simulated, over {} structures", calibrated.structures),
            some(calibrated.direction_rms_deg, 4),
            dash(),
            dash(),
            dash(),
        ]);
    }
    rows
}

fn bars(found: &Tolerance) -> Vec<Vec<String>> {
    let width = found.histogram.width_deg;
    let total: usize = found.histogram.counts.iter().sum();
    let counts = found.histogram.counts.iter().enumerate();
    counts
        .map(|(bar, &elements)| {
            vec![
                number(bar as f64 * width, 4),
                number((bar + 1) as f64 * width, 4),
                elements.to_string(),
                number(100.0 * elements as f64 / total.max(1) as f64, 2),
            ]
        })
        .collect()
}

fn facets(found: &Tolerance) -> Vec<Vec<String>> {
    let row = |f: &catoptric_design::tolerance::FacetTolerance| {
        let mut row = vec![f.name.clone(), f.elements.to_string()];
        let (d, p) = (&f.direction_deg, &f.point_at_4m_mm);
        row.extend([d.rms, d.median, d.p95, d.max].map(|v| some(v, 3)));
        row.extend([p.rms, p.p95, p.max].map(|v| some(v, 1)));
        row
    };
    found.facets.iter().map(row).collect()
}

fn lost(found: &Tolerance) -> Vec<Vec<String>> {
    let row = |name: &str, drawn: usize, mean: f64, worst: usize| {
        vec![
            name.to_owned(),
            count(Some(drawn)),
            number(mean, 1),
            count(Some(worst)),
        ]
    };
    vec![
        row(
            "Split at an edge",
            found.drawn.split,
            found.split_mean,
            found.split_worst,
        ),
        row(
            "Without a direction",
            found.drawn.lost,
            found.lost_mean,
            found.lost_worst,
        ),
        row(
            "No longer on their facet",
            0,
            found.changed_mean,
            found.changed_worst,
        ),
    ]
}

fn plot(found: &Tolerance) -> String {
    let width = found.histogram.width_deg;
    let counts = &found.histogram.counts;
    let total = counts.iter().sum::<usize>().max(1) as f64;
    let share = |c: usize| 100.0 * c as f64 / total;
    let highest = counts.iter().map(|c| share(*c)).fold(1e-6, f64::max);
    // Room above the bars for two labels, one below the other.
    let top = 1.25 * highest;
    let x = 0.0..width * counts.len().max(1) as f64;
    let areas = counts.iter().enumerate().filter(|(_, c)| **c > 0);
    let areas = areas.map(|(bar, &c)| {
        let (left, right) = (bar as f64 * width, (bar + 1) as f64 * width);
        Area {
            points: vec![(left, 0.0), (left, share(c)), (right, share(c)), (right, 0.0)],
            color: color(4),
        }
    });
    let mut shapes = Shapes {
        areas: areas.collect(),
        ticks: [round_numbers(x.clone(), 8.0), round_numbers(0.0..top, 5.0)],
        ..Shapes::default()
    };
    let lines = [
        ("rms", found.direction_deg.rms, 1.04),
        ("95 %", found.direction_deg.p95, 1.14),
    ];
    for (name, at, height) in lines {
        let Some(at) = at else {
            continue;
        };
        shapes.strokes.push(Stroke {
            points: vec![(at, 0.0), (at, height * highest)],
            color: BLACK,
            width: 2,
            opacity: 0.8,
        });
        shapes.labels.push(Label {
            at: (at, (height + 0.05) * highest),
            text: format!("{name} {}°", number(at, 2)),
            color: BLACK,
        });
    }
    let axes = Axes {
        x,
        y: 0.0..top,
        x_label: "error of direction (°)".to_owned(),
        y_label: "share of elements (%)".to_owned(),
    };
    fine(
        SIZE,
        &axes,
        "How far directions are off before calibration",
        &shapes,
    )
}
