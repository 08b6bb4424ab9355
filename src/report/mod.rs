//! `report.html`: one self-contained page about an experiment, its calibrations and their scores.
//!
//! No scripts, nothing fetched, no clock: the same input gives the same bytes. Every plot carries its numbers in a
//! table.

mod figure;
mod page;
mod plots;
mod words;

use crate::apply::PointCloud;
use crate::score::{PointError, Score, Spread};
use catoptric_model::{BeamEstimate, Calibration, Dataset};
use catoptric_sim::Truth;
use page::{escape, number};

/// The report of an experiment and the calibrations made from it, as HTML.
///
/// The first calibration is the one whose fans are drawn. `cloud` is what [`apply`](fn@crate::apply) made of the
/// empty room.
pub fn report(
    dataset: &Dataset,
    truth: Option<&Truth>,
    results: &[(Calibration, Score)],
    cloud: Option<&PointCloud>,
) -> String {
    let name = &dataset.session.name;
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">Calibration report of a 2D LiDAR that sees in 3D through mirrors</p>\n</header>\n",
        escape(name)
    );
    html += &format!("<p>{}</p>\n", escape(&words::experiment(dataset, truth)));
    for (calibration, score) in results {
        html += &words::verdict(calibration, score);
    }
    if results.is_empty() {
        html += "<p>No calibration was given to this report.</p>\n";
    }
    if !results.is_empty() {
        html += &format!("<h2>Scores</h2>\n{}", scores(results));
    }
    if let Some((calibration, _)) = results.first() {
        html += &format!(
            "<h2>Where the beams go</h2>\n{}",
            plots::fans(dataset, calibration)
        );
    }
    for (calibration, score) in results {
        html += &format!(
            "<h2>Element by element: method “{}”</h2>\n",
            escape(&calibration.method)
        );
        html += &if truth.is_some() {
            plots::errors(dataset, calibration, score)
        } else {
            plots::estimates(dataset, calibration)
        };
        html += &plots::residuals(dataset, calibration);
        html += &plots::statuses(dataset, calibration, truth);
    }
    if let Some(cloud) = cloud {
        let calibration = results.first().map(|(c, _)| c);
        html += &format!(
            "<h2>The room as the mirrors show it</h2>\n{}",
            plots::cloud(dataset, calibration, cloud)
        );
    }
    html += "<footer>Angles are in degrees per axis: the root mean square of the two components of a direction's error, \
             cos φ·δθ across and δφ up, in the sensor frame unless “room” is said. φ is elevation, θ azimuth, d the \
             distance from the scanner to the mirror.</footer>\n";
    page::page(&format!("{name} – catoptric report"), &html)
}

/// The scores side by side, a method a column.
fn scores(results: &[(Calibration, Score)]) -> String {
    let mut headings = vec!["Figure"];
    headings.extend(results.iter().map(|(c, _)| c.method.as_str()));
    let mut rows = Vec::new();
    let mut row = |name: &str, value: &dyn Fn(&Score) -> String| {
        let mut cells = vec![name.to_owned()];
        cells.extend(results.iter().map(|(_, s)| value(s)));
        rows.push(cells);
    };
    let count = |c: Option<usize>| c.map_or_else(|| "–".to_owned(), |c| c.to_string());
    let spread = |s: &Spread| {
        format!(
            "{} / {} / {} / {}",
            number(s.rms, 4),
            number(s.median, 4),
            number(s.p95, 4),
            number(s.max, 4)
        )
    };
    let points = |p: &PointError| {
        format!(
            "{} / {} / {}",
            number(p.at_1m, 1),
            number(p.at_4m, 1),
            number(p.at_10m, 1)
        )
    };
    row("Elements deflected and unsplit, in truth", &|s| {
        count(s.beams.deflected)
    });
    row("– solved", &|s| s.beams.solved.to_string());
    row("– abstained, with a reason", &|s| s.beams.abstained.to_string());
    row("– missed", &|s| count(s.beams.missed));
    row("False: solved but not deflected", &|s| count(s.beams.wrong));
    row("Per-axis error (°)", &|s| number(s.per_axis_rms_deg, 4));
    row("– bound on it, per element (°)", &|s| {
        number(s.crlb_per_axis_deg, 4)
    });
    row("– efficiency, 1 is best", &|s| number(s.efficiency, 2));
    row("– without the common rotation (°)", &|s| {
        number(s.differential_per_axis_rms_deg, 4)
    });
    row("Rotation common to all elements (°)", &|s| {
        number(s.common_mode_deg, 4)
    });
    row("Direction error: rms / median / 95 % / largest (°)", &|s| {
        spread(&s.direction_deg)
    });
    row("– the same in the room (°)", &|s| {
        spread(&s.direction_room_deg)
    });
    row("Per-axis error in the room (°)", &|s| {
        number(s.per_axis_rms_room_deg, 4)
    });
    row("Distance d to the mirror: rms / largest (mm)", &|s| {
        format!(
            "{} / {}",
            number(s.distance_mm.rms, 2),
            number(s.distance_mm.max, 2)
        )
    });
    row("Point 1 / 4 / 10 m behind the mirror (mm)", &|s| {
        points(&s.point_mm)
    });
    row("– the same in the room (mm)", &|s| points(&s.point_room_mm));
    row("Normalised squared error, 1 is honest", &|s| {
        number(s.nees_mean, 2)
    });
    row("Inside the stated 95 % ellipse (%)", &|s| {
        number(s.coverage_95 * 100.0, 1)
    });
    row("Points off the boards: mean / rms (mm)", &|s| {
        format!("{} / {}", number(s.boards_mm.mean, 2), number(s.boards_mm.rms, 2))
    });
    row("Points off the walls of the empty room: mean / rms (mm)", &|s| {
        format!("{} / {}", number(s.walls_mm.mean, 2), number(s.walls_mm.rms, 2))
    });
    row("Split elements: solved of all", &|s| match s.split.elements {
        0 => "–".to_owned(),
        all => format!("{} of {all}", s.split.solved),
    });
    row("– their per-axis error (°)", &|s| {
        number(s.split.per_axis_rms_deg, 4)
    });
    // A row without a single figure, as all accuracies are without a truth, says nothing.
    let is_empty = |cell: &String| cell.chars().all(|c| matches!(c, '–' | '/' | ' '));
    rows.retain(|row| !row.iter().skip(1).all(is_empty));
    page::table(&headings, &rows)
}

/// Number of an element's facet in the session: as the calibration says, else as drawn.
fn facet_of(dataset: &Dataset, estimate: &BeamEstimate) -> Option<usize> {
    let facets = &dataset.session.facets;
    match &estimate.facet {
        Some(name) => facets.iter().position(|f| &f.name == name),
        None => facets
            .iter()
            .position(|f| (f.beams[0]..=f.beams[1]).contains(&estimate.beam)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::apply::{CloudFrame, apply};
    use crate::sample::{noisy, sample, turned};
    use crate::score::score;

    fn html(with_truth: bool) -> String {
        let s = sample();
        let truth = with_truth.then_some(&s.truth);
        let first = turned(noisy(&s.truth, 1e-3, 1), 2e-3);
        let second = noisy(&s.truth, 3e-3, 2);
        let cloud = apply(&s.dataset, &first, None, CloudFrame::Room).expect("there is a room");
        let results = [first, second].map(|c| {
            let score = score(&s.dataset, &c, truth);
            (c, score)
        });
        report(&s.dataset, truth, &results, Some(&cloud))
    }

    /// Checks that tags close in the order they open; void elements of HTML and self-closed ones of SVG do not open.
    fn check_nesting(html: &str) {
        let mut open = Vec::new();
        let body = html.replace("<!DOCTYPE html>", "");
        for tag in body.split('<').skip(1) {
            let (tag, _) = tag.split_once('>').expect("every tag ends");
            let name = tag
                .trim_start_matches('/')
                .split([' ', '\n'])
                .next()
                .unwrap_or("");
            if tag.starts_with('/') {
                assert_eq!(open.pop(), Some(name), "in <{tag}>");
            } else if !tag.ends_with('/') && !["meta", "br"].contains(&name) {
                open.push(name);
            }
        }
        assert!(open.is_empty(), "{open:?}");
    }

    #[test]
    fn every_plot_has_a_table_and_nothing_is_fetched() {
        for with_truth in [true, false] {
            let html = html(with_truth);
            assert!(!html.contains("http") && !html.contains("<script") && !html.contains("url("));
            let figures: Vec<&str> = html.split("<figure>").skip(1).collect();
            // Fans; errors or estimates, residuals and statuses of two methods; the cloud.
            assert_eq!(figures.len(), 8);
            for figure in figures {
                let (figure, _) = figure.split_once("</figure>").expect("it ends");
                assert!(
                    figure.contains("<svg") && figure.contains("<tbody>\n<tr>"),
                    "{figure}"
                );
            }
            check_nesting(&html);
            assert!(!html.contains("could not be drawn") && !html.contains("NaN"));
        }
    }

    #[test]
    fn the_verdict_is_in_words() {
        let with = html(true);
        assert!(with.contains("PASS") && with.contains("What all elements have in common dominates"));
        let blind = html(false);
        assert!(blind.contains("BLIND") && blind.contains("there is no truth"));
        assert!(!blind.contains("cos φ·δθ (°)"));
    }

    #[test]
    fn the_same_input_gives_the_same_bytes() {
        assert_eq!(html(true), html(true));
    }

    #[test]
    fn a_report_of_nothing_is_a_page_too() {
        let s = sample();
        check_nesting(&report(&s.dataset, None, &[], None));
    }
}
