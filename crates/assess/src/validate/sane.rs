//! Plausibility checks of unit vectors, coordinates and covariances.

use catoptric_model::covariance;
use std::f64::consts::PI;

/// Maximum distance of a mirror from the scanner, in meters; larger values are probably millimeters.
pub const MIRROR_DISTANCE_M: f64 = 10.0;

/// Minimum and maximum plausible standard deviation of an angle, in radians: a millionth of the smallest ever measured,
/// and half a turn, which is no information at all.
pub const ANGLE_SD_RAD: [f64; 2] = [1e-10, PI];

/// Tolerance of the length of a normal or a quaternion: well above the effect of rounding to nine digits.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Whether a length is 1 up to rounding; false for NaN.
pub(super) fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() <= UNIT_TOLERANCE
}

/// Whether a coordinate is plausible for a structure around the scanner; false for NaN.
pub(super) fn is_near(meters: f64) -> bool {
    meters.abs() <= MIRROR_DISTANCE_M
}

/// Whether a matrix can be a covariance: finite, symmetric, positive semi-definite.
pub(super) fn check_covariance<const N: usize>(rows: &[[f64; N]; N]) -> Result<(), String> {
    covariance::check(N, |i, j| rows[i][j])
}
