//! Lever arms: how far a small rotation of a beam changes its ranges, in the tangent plane (cos φ·δθ, δφ).

use catoptric_model::beam;
use nalgebra::{Matrix2, SymmetricEigen, Vector2};

/// Squared lever arms and their directions in the tangent plane (cos φ·δθ, δφ), from HᵀH in (θ_a, φ).
pub(crate) fn levers(normal: &Matrix2<f64>, cos_elevation: f64) -> (Vector2<f64>, Matrix2<f64>) {
    let scale = Matrix2::from_diagonal(&Vector2::new(1.0 / cos_elevation, 1.0));
    let eigen = SymmetricEigen::new(scale * normal * scale);
    (eigen.eigenvalues, eigen.eigenvectors)
}

/// cos φ of an elevation, the same on every machine; kept off zero, where azimuth is meaningless.
pub(crate) fn libm_cos(elevation: f64) -> f64 {
    off_zero(beam::direction(elevation).x)
}

/// |cos φ|, kept off zero.
pub(crate) fn off_zero(cos_elevation: f64) -> f64 {
    cos_elevation.abs().max(1e-6)
}
