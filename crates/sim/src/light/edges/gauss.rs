//! The Gaussian of a beam along one axis, and where the beam ends.

use std::f64::consts::SQRT_2;

/// Where a beam ends, in units of the 1/e² half-axes: four standard deviations, which leave out 0.03 % of a Gaussian.
pub const REACH: f64 = 2.0;

/// A place in the spot, along its long and its short axis in units of the 1/e² half-axes.
pub type Place = [f64; 2];

/// Density of a Gaussian with a standard deviation of one half.
pub(super) fn density(at: f64) -> f64 {
    libm::sqrt(std::f64::consts::FRAC_2_PI) * libm::exp(-2.0 * at * at)
}

/// Its integral.
pub(super) fn within(from: f64, to: f64) -> f64 {
    0.5 * (libm::erf(SQRT_2 * to) - libm::erf(SQRT_2 * from))
}
