//! Self-contained HTML pages: `report.html` on an experiment, its calibrations and their scores; the page next to
//! `characterization.json`; pages on plans, studies, layouts, searches and tolerances.
//!
//! No scripts, nothing fetched, no clock: the same input gives the same bytes. Every plot comes with a table of its
//! numbers.

mod angles;
mod characterization;
mod contrast;
mod figure;
#[cfg(feature = "design")]
mod layout;
mod opening;
#[cfg(feature = "design")]
mod optimum;
mod page;
#[cfg(feature = "design")]
mod plan;
mod plots;
mod prose;
mod scores;
mod study;
#[cfg(feature = "design")]
mod tolerance;
mod trials;
mod verdict;

pub use characterization::characterization;
#[cfg(feature = "design")]
pub use layout::{Drawn, layout, layout_pictures};
#[cfg(feature = "design")]
pub use optimum::{front_picture, goal_value, optimum};
#[cfg(feature = "design")]
pub use plan::plan;
pub use plots::MAX_POINTS;
pub use study::study;
#[cfg(feature = "design")]
pub use tolerance::{tolerance, tolerance_plot};

use catoptric_assess::apply::CloudSketch;
use catoptric_assess::score::Score;
use catoptric_model::{Calibration, Dataset};
use catoptric_sim::Truth;
use page::escape;
use scores::scores;

/// Returns the report on an experiment and the calibrations made from it, as HTML.
///
/// The fans are drawn for the first calibration. `cloud` is the point cloud that [`apply`](fn@catoptric_assess::apply)
/// made of the empty room.
pub fn report(
    dataset: &Dataset,
    truth: Option<&Truth>,
    results: &[(Calibration, Score)],
    cloud: Option<&CloudSketch>,
) -> String {
    let name = &dataset.session.name;
    let mut html = format!(
        "<header>\n<h1>{}</h1>\n<p class=\"subtitle\">Calibration report for a 2D LiDAR that sees in 3D through mirrors</p>\n</header>\n",
        escape(name)
    );
    html += &format!("<p>{}</p>\n", escape(&prose::experiment(dataset, truth)));
    if let Some((first, _)) = results.first() {
        html += &opening::methods(results);
        html += &plots::fan(dataset, first);
        html += &format!(
            "<h2>The verdicts</h2>\n{}<h2>Scores</h2>\n{}",
            verdict::verdicts(&dataset.session.scanner.scan, results),
            scores(results)
        );
    } else {
        html += "<p>This report includes no calibration.</p>\n";
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
            "<h2>The room as seen through the mirrors</h2>\n{}",
            plots::cloud(dataset, calibration, cloud)
        );
    }
    html += &opening::next(dataset, truth.is_some(), results);
    html += "<footer>Angles are in degrees per axis: the root mean square of the two components of a direction's error, \
             cos φ·δθ across and δφ up, in the sensor frame unless marked “room”. φ is elevation, θ azimuth, d the \
             distance from the scanner to the mirror.</footer>\n";
    page::page(&format!("{name} – catoptric report"), &html)
}

#[cfg(test)]
mod tests;
