//! How far a tracked plane can be off at a point of it: the fit of a plane through markers.

use crate::observations::BoardView;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

/// Variance of a tracked plane's height at a point of it, in square metres: σ²·aᵀ(Σ a_i a_iᵀ)⁻¹a, a = (1, x, y).
pub(super) fn plane_variance(
    markers: &[Point3<f64>],
    at: &Point3<f64>,
    board: &BoardView,
    marker_sd: f64,
) -> f64 {
    let (a, cofactor) = plane_fit(markers, at, &board.plane.normal);
    marker_sd * marker_sd * (a.transpose() * cofactor * a)[0]
}

/// What the error of a plane through markers at a point depends on: a and (Σ a_i a_iᵀ)⁻¹, both about the centroid.
///
/// Fewer than three markers, or markers on a line, leave the plane's tilt to chance; then only their mean offset is
/// counted, since no honest number can be given for the rest.
pub(crate) fn plane_fit(
    markers: &[Point3<f64>],
    at: &Point3<f64>,
    normal: &Unit<Vector3<f64>>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let count = markers.len().max(1) as f64;
    let centroid = markers.iter().map(|m| m.coords).sum::<Vector3<f64>>() / count;
    let across = Vector3::x() - normal.into_inner() * normal.x;
    let other = Vector3::y() - normal.into_inner() * normal.y;
    // Whichever axis is farther from the normal gives a first direction in the plane.
    let first = if across.norm() > other.norm() {
        across
    } else {
        other
    }
    .normalize();
    let second = normal.cross(&first);
    let coordinates = |p: Vector3<f64>| Vector3::new(1.0, first.dot(&p), second.dot(&p));
    let information: Matrix3<f64> = markers
        .iter()
        .map(|m| coordinates(m.coords - centroid))
        .map(|a| a * a.transpose())
        .sum();
    let spread = information[(1, 1)] + information[(2, 2)];
    let determined = information.view((1, 1), (2, 2)).determinant() > 1e-6 * spread * spread;
    let cofactor = information.try_inverse().filter(|_| determined);
    let offset_only = Matrix3::from_diagonal(&Vector3::new(1.0 / count, 0.0, 0.0));
    (coordinates(at.coords - centroid), cofactor.unwrap_or(offset_only))
}
