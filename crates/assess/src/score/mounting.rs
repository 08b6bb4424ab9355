//! The error of the mounting, as far as it can be observed.
//!
//! Motion capture tracks the rig by its markers, whose errors move the tracked rig and turn it; a calibration can only
//! give the sensor's pose in the rig as tracked. What is compared is therefore the pose of the sensor in the room: tracked
//! rig and estimated mounting against the true rig and mounting. What the boards leave open has a large stated variance.

use catoptric_model::Pose;
use catoptric_model::calibration::MountEstimate;
use catoptric_model::session::MountTolerance;
use nalgebra::{Matrix6, Vector6};
use serde::Serialize;

/// Smallest tolerance of a drawing, in meters and radians, as the estimator's prior has it: 1 mm and 0.1°.
const DRAWN: [f64; 2] = [1e-3, 0.1 * std::f64::consts::PI / 180.0];

/// Rounding of files, in meters and radians.
const ROUNDING: f64 = 1e-6;

/// Largest standard deviation of a mounting that is of use, in tolerances of the drawing, which any calibration can state.
pub(super) const MOST_OVER_DRAWING: f64 = 3.0;

/// The error of the mounting.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Mounting {
    /// Mean normalized squared error over its six degrees of freedom.
    pub nees: f64,
    /// Error of the sensor's position, in millimeters.
    pub position_mm: f64,
    /// Error of its attitude, in degrees.
    pub attitude_deg: f64,
    /// Whether the calibration states a covariance; otherwise the drawing's tolerance takes its place.
    #[serde(skip)]
    pub states_covariance: bool,
}

impl Mounting {
    /// The error of an estimate, given the true and the estimated pose of the sensor in the room.
    pub(super) fn of(
        estimate: &MountEstimate,
        tolerance: &MountTolerance,
        actual: &Pose,
        believed: &Pose,
    ) -> Self {
        let off = actual.inverse() * believed;
        let turned = off.rotation.scaled_axis();
        let error = Vector6::new(
            off.translation.x,
            off.translation.y,
            off.translation.z,
            turned.x,
            turned.y,
            turned.z,
        );
        let covariance = estimate
            .covariance
            .map_or_else(|| of_tolerance(tolerance), |c| Matrix6::from_fn(|i, j| c[i][j]))
            + Matrix6::identity() * (ROUNDING * ROUNDING);
        Self {
            nees: covariance
                .cholesky()
                .map_or(f64::INFINITY, |factor| error.dot(&factor.solve(&error)) / 6.0),
            position_mm: off.translation.vector.norm() * 1e3,
            attitude_deg: turned.norm().to_degrees(),
            states_covariance: estimate.covariance.is_some(),
        }
    }
}

/// The stated standard deviation that is largest over the drawing's tolerance, as their quotient; `None` without a covariance.
pub(super) fn over_drawing(estimate: &MountEstimate, tolerance: &MountTolerance) -> Option<f64> {
    let (stated, drawn) = (estimate.covariance?, of_tolerance(tolerance));
    let over = (0..6).map(|i| (stated[i][i] / drawn[(i, i)]).sqrt());
    Some(over.fold(0.0, f64::max))
}

/// The tolerance of the drawing as a covariance.
pub(super) fn of_tolerance(tolerance: &MountTolerance) -> Matrix6<f64> {
    let [shift, turn] = DRAWN;
    let shifts = tolerance.translation_sd_mm.map(|sd| (sd * 1e-3).max(shift));
    let turns = tolerance.rotation_sd_deg.map(|sd| sd.to_radians().max(turn));
    let sd = Vector6::from_iterator(shifts.into_iter().chain(turns));
    Matrix6::from_diagonal(&sd.component_mul(&sd))
}
