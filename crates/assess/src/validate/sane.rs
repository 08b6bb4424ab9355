//! Plausibility checks of unit vectors, coordinates and covariances.

use super::MIRROR_DISTANCE_M;
use catoptric_model::covariance;

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
