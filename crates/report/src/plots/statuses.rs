//! The status of every element, as colored bars over azimuth.

use super::super::figure::{self, Axes, Bar};
use super::super::page::figure as block;
use super::azimuth::azimuth_axis;
use super::elements::azimuth_deg;
use catoptric_assess::score::counts::absent;
use catoptric_assess::score::words::{abstentions, spelled};
use catoptric_model::{Calibration, Dataset, Status};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use plotters::style::RGBColor;

/// Size of the bars, in pixels.
const STRIP: (u32, u32) = (980, 150);

/// Plots the status of every element in the calibration, and its class in the truth.
pub(crate) fn statuses(dataset: &Dataset, calibration: &Calibration, truth: Option<&Truth>) -> String {
    let found = calibration.beams.iter().map(|b| (b.beam, status_color(b.status)));
    let mut bars = runs(dataset, 0, found);
    let mut legend: Vec<(String, String)> = Status::ALL
        .iter()
        .filter(|s| calibration.beams.iter().any(|b| b.status == **s))
        .map(|s| (figure::css(status_color(*s)), spelled(*s)))
        .collect();
    if let Some(truth) = truth {
        bars.extend(runs(
            dataset,
            1,
            truth.beams.iter().map(|b| (b.beam, class_color(b.status).0)),
        ));
        let mut seen = Vec::new();
        for b in &truth.beams {
            if !seen.contains(&b.status) {
                seen.push(b.status);
                let (color, name) = class_color(b.status);
                legend.push((figure::css(color), format!("{name}, in truth")));
            }
        }
    }
    let rows_drawn = 1 + usize::from(truth.is_some());
    let axes = Axes {
        x: azimuth_axis(dataset),
        y: 0.0..rows_drawn as f64,
        x_label: "Base azimuth of the element (°)".to_owned(),
        y_label: if truth.is_some() {
            "truth · calibration".to_owned()
        } else {
            "found".to_owned()
        },
    };
    let title = "Status of every element";
    let svg = figure::strip(STRIP, &axes, title, &bars, rows_drawn);
    let mut rows: Vec<Vec<String>> = [Status::Solved, Status::Direct]
        .iter()
        .map(|s| {
            let count = calibration.beams.iter().filter(|b| b.status == *s).count();
            vec![s.word().to_owned(), String::new(), count.to_string()]
        })
        .collect();
    for a in abstentions(calibration) {
        rows.push(vec![a.status, a.reason, a.count.to_string()]);
    }
    let absent = absent(dataset, calibration);
    if absent > 0 {
        rows.push(vec!["absent".to_owned(), String::new(), absent.to_string()]);
    }
    let caption = if truth.is_some() {
        "Upper row: the status in the calibration; lower row: the class in the truth. Green over green is as desired; \
         anything else over green was not solved, and the table gives the reason."
    } else {
        "The status of each element in the calibration; the table gives the reasons of those without a direction."
    };
    let plot = format!("<div class=\"plot\"><h4>{title}</h4>{svg}</div>\n");
    block(&plot, caption, &legend, &["Status", "Reason", "Elements"], &rows)
}

/// Returns the color of a status: green and blue for good results, warm tones for undecided ones.
fn status_color(status: Status) -> RGBColor {
    match status {
        Status::Solved => RGBColor(0x00, 0x9E, 0x73),
        Status::Direct => RGBColor(0x56, 0xB4, 0xE9),
        Status::TooFewPoses => RGBColor(0xE6, 0x9F, 0x00),
        Status::Unobservable => RGBColor(0xCC, 0x79, 0xA7),
        Status::NotConverged => RGBColor(0x8A, 0x5A, 0x9E),
        Status::Rejected => RGBColor(0xD5, 0x5E, 0x00),
    }
}

/// Returns color and name of a class.
fn class_color(class: BeamClass) -> (RGBColor, &'static str) {
    match class {
        BeamClass::Deflected => (RGBColor(0x00, 0x9E, 0x73), "deflected"),
        BeamClass::Direct => (RGBColor(0x56, 0xB4, 0xE9), "direct"),
        BeamClass::Split => (RGBColor(0xD5, 0x5E, 0x00), "split"),
        BeamClass::MultiBounce => (RGBColor(0xCC, 0x79, 0xA7), "several mirrors"),
        BeamClass::Blocked => (RGBColor(0x8C, 0x8C, 0x8C), "blocked"),
        BeamClass::Lost => (RGBColor(0x5E, 0x5E, 0x5E), "lost"),
    }
}

/// One bar for each run of neighboring elements of the same color.
fn runs(dataset: &Dataset, row: usize, elements: impl Iterator<Item = (usize, RGBColor)>) -> Vec<Bar> {
    let half = 0.5 * dataset.session.scanner.scan.step().to_degrees();
    let mut bars: Vec<Bar> = Vec::new();
    for (beam, color) in elements {
        let x = azimuth_deg(dataset, beam) - half..azimuth_deg(dataset, beam) + half;
        match bars.last_mut() {
            // Neighbors share an edge up to rounding.
            Some(last) if last.color == color && (last.x.end - x.start).abs() < half => last.x.end = x.end,
            Some(last) if last.color == color && (last.x.start - x.end).abs() < half => {
                last.x.start = x.start
            }
            _ => bars.push(Bar { x, row, color }),
        }
    }
    bars
}
