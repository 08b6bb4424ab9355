//! The usual mistakes, tried on a calibration whose errors are large: the one that would make it right is named.
//!
//! A mistake is a way to read the file that differs from its format: another sign, unit, order, frame or reference. Each
//! is tried alone, then several together; the simplest one that leaves a fifth of the error or less counts.

mod covariance;
mod direction;
mod distance;
mod mounting;

use super::mistake::Mistake;
use super::{ElementError, Mounting, Score};
use catoptric_model::{Calibration, Dataset, Pose};
use catoptric_sim::Truth;

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
