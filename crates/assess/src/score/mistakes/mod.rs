//! The usual mistakes, tried on a calibration whose errors are large: the one that would make it right is named.
//!
//! A mistake is a way to read the file that differs from its format: another sign, unit, order, frame or reference. Each
//! is tried alone, then several together; the simplest one that leaves a fifth of the error or less counts.

mod covariance;
mod direction;
mod distance;
mod mounting;

use super::{ElementError, Mounting, Score};
use catoptric_model::{Calibration, Dataset, Pose};
use catoptric_sim::Truth;
use serde::Serialize;
use std::fmt;

/// Error that a mistake has to leave at most, relative to the one found.
const LEFT: f64 = 0.2;

/// A mistake that would explain the errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mistake {
    /// What would make it right, as text after "with".
    pub correction: String,
    /// The figure that it concerns.
    pub figure: &'static str,
    /// Its value as found.
    pub found: f64,
    /// Its value with the correction.
    pub would_be: f64,
}

/// A sentence: "with φ negated, the per-axis error would be 0.014° instead of 68.2°".
impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "with {}, {} would be {} instead of {}",
            self.correction,
            named(self.figure),
            figures(self.would_be, self.figure),
            figures(self.found, self.figure)
        )
    }
}

/// The figure as a reader calls it.
fn named(figure: &str) -> &'static str {
    match figure {
        "per_axis_rms_deg" => "the per-axis error",
        "distance_mm.rms" => "the error of d",
        "mounting.attitude_deg" => "the error of the mounting's attitude",
        "mounting.position_mm" => "the error of the mounting's position",
        "nees_mean" => "the mean normalized squared error",
        _ => "the figure",
    }
}

/// A value with the unit of its figure and three significant digits.
fn figures(value: f64, figure: &str) -> String {
    let unit = if figure.contains("_deg") {
        "°"
    } else if figure.contains("_mm") {
        " mm"
    } else {
        ""
    };
    let size = value.abs();
    let decimals = if size >= 100.0 {
        0
    } else if size >= 10.0 {
        1
    } else if size >= 1.0 {
        2
    } else {
        3
    };
    format!("{value:.decimals$}{unit}")
}

/// Returns the mistakes that explain the errors of a score.
pub(super) fn recognize(
    score: &Score,
    dataset: &Dataset,
    calibration: &Calibration,
    truth: &Truth,
    rig: Option<&Pose>,
) -> Vec<Mistake> {
    let scored: Vec<&ElementError> = score.scored().collect();
    let mut found = Vec::new();
    let directions = direction::recognize(score, &scored, dataset, calibration, truth);
    let wrong = directions.is_some();
    found.extend(directions);
    found.extend(distance::recognize(score, &scored, dataset));
    if let (Some(mounting), Some(rig), Some(estimate)) = (&score.mounting, rig, &calibration.rig_from_sensor)
    {
        let actual = Pose::from(&truth.room_from_rig) * Pose::from(&truth.rig_from_sensor);
        let error =
            |pose: &Pose| Mounting::of(estimate, &dataset.session.mount_tolerance, &actual, &(rig * pose));
        found.extend(mounting::recognize(mounting, estimate, error));
    }
    // A covariance means nothing about directions that are read wrongly.
    if !wrong {
        found.extend(covariance::recognize(score, &scored, calibration));
    }
    found
}
