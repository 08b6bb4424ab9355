//! The page next to `characterization.json`: a plot and a table for each of Tables 1 to 4, and the fitted numbers.

use super::figure::{Axes, Mark, Stroke, color, css, laws};
use super::page::{escape, figure, page};
use catoptric_assess::tables::{Subject, Table, tables};
use catoptric_model::characterization::Characterization;
use catoptric_model::{RangeBias, TestKind, paper};
use plotters::style::{BLACK, RGBColor};
use std::ops::Range;

const SIZE: (u32, u32) = (640, 360);

/// Returns the page on a characterized sensor, as HTML; `injected` is the simulated bias, where it is known.
pub fn characterization(found: &Characterization, injected: Option<&RangeBias>) -> String {
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">Range errors of the bare sensor</p>\n</header>\n",
        escape(&found.name)
    );
    for table in tables(found, injected) {
        let picture = match table.subject {
            Subject::Spot => spots(found),
            Subject::Distance => distances(found),
            Subject::Angle => angles(found),
            Subject::Color => noise(found),
            Subject::Numbers => Picture::default(),
        };
        html += &section(&table, &picture);
    }
    if !found.not_observed.is_empty() {
        html += "<h2>Not determined by the boards</h2>\n<ul>\n";
        for open in &found.not_observed {
            let of = open.color.as_ref().map_or(String::new(), |c| format!(" of {c}"));
            html += &format!(
                "<li>{}</li>\n",
                escape(&format!("{}{of}: {}", open.symbol, open.reason))
            );
        }
        html += "</ul>\n";
    }
    html += "<footer>Errors are measured minus true, in millimeters; bars are ±1σ of single readings in the plot of \
             Table 2 and ±2σ of the fit in that of Table 3. Rings are the paper's values (Cooper, Raquet, Patton 2018).\
             </footer>\n";
    page(&format!("{} – catoptric characterization", found.name), &html)
}

/// A plot with its legend.
#[derive(Default)]
struct Picture {
    svg: String,
    legend: Vec<(String, String)>,
}

fn section(table: &Table, picture: &Picture) -> String {
    let content = figure(
        &picture.svg,
        &table.remark,
        &picture.legend,
        &table.headings,
        &table.rows,
    );
    format!("<h2>{}</h2>\n{content}", escape(table.title))
}

fn mark(x: f64, y: f64, half_bar: f64, color: RGBColor) -> Mark {
    Mark {
        x,
        y,
        half_bar,
        color,
        hollow: false,
    }
}

fn ring(x: f64, y: f64, color: RGBColor) -> Mark {
    Mark {
        x,
        y,
        half_bar: 0.0,
        color,
        hollow: true,
    }
}

fn legend(entries: &[(RGBColor, &str)]) -> Vec<(String, String)> {
    let entry = |(color, name): &(RGBColor, &str)| (css(*color), (*name).to_owned());
    entries.iter().map(entry).collect()
}

/// Returns limits that hold all marks and strokes, with a margin.
fn limits(values: impl Iterator<Item = f64>, from_zero: bool) -> Range<f64> {
    let (mut low, mut high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
        (l.min(v), h.max(v))
    });
    if from_zero {
        low = low.min(0.0);
    }
    if low >= high {
        (low, high) = (low.min(high) - 1.0, high.max(low) + 1.0);
    }
    let air = 0.07 * (high - low);
    if from_zero && low == 0.0 {
        0.0..high + air
    } else {
        low - air..high + air
    }
}

/// Number of segments in which a law is drawn.
const STEPS: u32 = 120;

fn curve(over: &Range<f64>, color: RGBColor, law: impl Fn(f64) -> f64) -> Stroke {
    let at = |k: u32| over.start + (over.end - over.start) * f64::from(k) / f64::from(STEPS);
    Stroke {
        points: (0..=STEPS).map(|k| (at(k), law(at(k)))).collect(),
        color,
        width: 2,
        opacity: 0.8,
    }
}

fn draw(title: &str, labels: [&str; 2], marks: &[Mark], strokes: &[Stroke], from_zero: [bool; 2]) -> String {
    let drawn = || strokes.iter().flat_map(|s| s.points.iter().copied());
    let xs = marks.iter().map(|m| m.x).chain(drawn().map(|p| p.0));
    let ends = marks.iter().flat_map(|m| [m.y - m.half_bar, m.y + m.half_bar]);
    let ys = ends.chain(drawn().map(|p| p.1));
    let axes = Axes {
        x: limits(xs, from_zero[0]),
        y: limits(ys, from_zero[1]),
        x_label: labels[0].to_owned(),
        y_label: labels[1].to_owned(),
    };
    laws(SIZE, &axes, title, marks, strokes)
}

fn spots(found: &Characterization) -> Picture {
    let (wide, high) = (color(0), color(1));
    let mut marks = Vec::new();
    for s in &found.spots {
        marks.push(mark(s.distance_m, s.spot.width_mm, 0.0, wide));
        marks.push(mark(s.distance_m, s.spot.height_mm, 0.0, high));
    }
    for (distance, height, width) in paper::TABLE_1 {
        marks.push(ring(distance, width, wide));
        marks.push(ring(distance, height, high));
    }
    let far = marks.iter().map(|m| m.x).fold(0.0, f64::max);
    let strokes = found.spot_law.map_or(Vec::new(), |law| {
        vec![
            curve(&(0.0..far), wide, |r| {
                law.width_offset_mm + law.width_slope_mrad * r
            }),
            curve(&(0.0..far), high, |r| {
                law.height_offset_mm + law.height_slope_mrad * r
            }),
        ]
    });
    Picture {
        svg: draw(
            "Spot extent over distance",
            ["distance (m)", "extent (mm)"],
            &marks,
            &strokes,
            [true, true],
        ),
        legend: legend(&[(wide, "width"), (high, "height")]),
    }
}

fn distances(found: &Characterization) -> Picture {
    let (ours, line, printed) = (color(0), color(1), color(2));
    let tested = found
        .stretches
        .iter()
        .filter(|s| s.test == Some(TestKind::Distance));
    let mut marks: Vec<Mark> = tested
        .map(|s| mark(s.distance_m, s.mean_error_mm, s.sd_mm, ours))
        .collect();
    for (distance, means, _) in paper::TABLE_2 {
        marks.extend(means.map(|m| ring(distance, m, printed)));
    }
    let far = marks.iter().map(|m| m.x).fold(0.0, f64::max);
    let mut strokes = vec![curve(&(0.0..far), ours, |r| found.bias.distance.error(r) * 1e3)];
    if let Some(law) = found.distance_line {
        strokes.push(curve(&(0.0..far), line, |r| {
            law.offset_mm + law.slope_mm_per_m * r
        }));
    }
    Picture {
        svg: draw(
            "Mean error over distance",
            ["distance (m)", "error (mm)"],
            &marks,
            &strokes,
            [true, false],
        ),
        legend: legend(&[
            (ours, "means of trials with their spread, and E_r as fitted"),
            (line, "a line through them"),
            (printed, "the paper's trials"),
        ]),
    }
}

fn angles(found: &Characterization) -> Picture {
    let (ours, fitted, printed) = (color(0), color(1), color(2));
    let tested = || found.stretches.iter().filter(|s| s.test == Some(TestKind::Angle));
    // All errors but that of incidence are subtracted, so that boards at different distances fall on one curve.
    let mut marks: Vec<Mark> = tested()
        .map(|s| {
            let terms = found.bias.terms(s.distance_m, 1.0, &s.color);
            let other = (terms.distance + terms.color) * 1e3;
            mark(s.incidence_deg, s.mean_error_mm - other, 0.0, ours)
        })
        .collect();
    for row in &found.angle_misfit {
        let total = row.law_mm + row.misfit_mm;
        marks.push(mark(row.incidence_deg, total, 2.0 * row.sd_mm, BLACK));
    }
    for (incidence, means) in paper::TABLE_3 {
        marks.extend(means.map(|m| ring(incidence, m, printed)));
    }
    let widest = tested().map(|s| s.incidence_deg.abs()).fold(0.0, f64::max);
    let law = |degrees: f64| found.bias.angle.error(libm::cos(degrees.to_radians())) * 1e3;
    Picture {
        svg: draw(
            "Error over incidence",
            ["incidence (°)", "E_a (mm)"],
            &marks,
            &[curve(&(-widest..widest), fitted, law)],
            [false, false],
        ),
        legend: legend(&[
            (ours, "means minus E_r and E_c"),
            (fitted, "E_a as fitted"),
            (BLACK, "the table of incidences, ±2σ"),
            (printed, "the paper's means, uncorrected"),
        ]),
    }
}

fn noise(found: &Characterization) -> Picture {
    let mut colors: Vec<&str> = found.noise.iter().map(|n| n.color.as_str()).collect();
    colors.sort_unstable();
    colors.dedup();
    let mut marks = Vec::new();
    let mut strokes = Vec::new();
    let mut names = Vec::new();
    for (index, name) in colors.iter().enumerate() {
        let own = color(index);
        let rows: Vec<_> = found.noise.iter().filter(|n| n.color == *name).collect();
        marks.extend(rows.iter().map(|n| mark(n.distance_m, n.sd_mm, 0.0, own)));
        strokes.push(Stroke {
            points: rows.iter().map(|n| (n.distance_m, n.sd_mm)).collect(),
            color: own,
            width: 1,
            opacity: 0.6,
        });
        let printed = paper::TABLE_4.iter().find(|(color, _)| color == name);
        if let Some((_, sds)) = printed {
            let places = paper::TABLE_4_RANGE_M.iter().zip(sds);
            marks.extend(places.map(|(r, sd)| ring(*r, *sd, own)));
        }
        names.push((own, *name));
    }
    Picture {
        svg: draw(
            "Standard deviation of a reading over distance, by color",
            ["distance (m)", "standard deviation (mm)"],
            &marks,
            &strokes,
            [true, true],
        ),
        legend: legend(&names),
    }
}
