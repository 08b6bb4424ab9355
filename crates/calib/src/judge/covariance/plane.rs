//! How far a tracked plane can be off at a point on it: the fit of a plane through markers.

use crate::readings::observations::BoardView;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

/// Distance of a marker from the centroid, relative to the longest, at which it defines a direction.
const LONG_ENOUGH: f64 = 0.3;

/// Variance of a tracked plane's height at a point of it, in square meters: σ²·aᵀ(Σ a_i a_iᵀ)⁻¹a, a = (1, x, y).
pub(super) fn plane_variance(
    markers: &[Point3<f64>],
    at: &Point3<f64>,
    board: &BoardView,
    marker_sd: f64,
) -> f64 {
    let fit = PlaneFit::new(markers, &board.plane.normal);
    let a = fit.coordinates(at);
    marker_sd * marker_sd * (a.transpose() * fit.cofactor * a)[0]
}

/// A plane fitted through markers, in coordinates about their centroid.
pub(crate) struct PlaneFit {
    centroid: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    /// (Σ a_i a_iᵀ)⁻¹.
    cofactor: Matrix3<f64>,
}

impl PlaneFit {
    /// The fit through some markers.
    ///
    /// With fewer than three markers, or markers on a line, the plane's tilt is undetermined. Then only their mean
    /// offset is counted, because no honest number can be given for the rest.
    pub(crate) fn new(markers: &[Point3<f64>], normal: &Unit<Vector3<f64>>) -> Self {
        let count = markers.len().max(1) as f64;
        let centroid = markers.iter().map(|m| m.coords).sum::<Vector3<f64>>() / count;
        // A direction fixed to the board: however the sensor is turned, an error of the board stays the same error.
        let on_plane = |v: Vector3<f64>| v - normal.into_inner() * normal.dot(&v);
        let spokes = || markers.iter().map(|m| on_plane(m.coords - centroid));
        let longest = spokes().map(|s| s.norm()).fold(0.0, f64::max);
        let first = spokes()
            .find(|s| longest > 0.0 && s.norm() > LONG_ENOUGH * longest)
            .unwrap_or_else(|| {
                let (across, other) = (on_plane(Vector3::x()), on_plane(Vector3::y()));
                if across.norm() > other.norm() {
                    across
                } else {
                    other
                }
            })
            .normalize();
        let offset_only = Matrix3::from_diagonal(&Vector3::new(1.0 / count, 0.0, 0.0));
        let mut fit = Self {
            centroid,
            axes: [first, normal.cross(&first)],
            cofactor: offset_only,
        };
        let information: Matrix3<f64> = markers
            .iter()
            .map(|m| fit.coordinates(m))
            .map(|a| a * a.transpose())
            .sum();
        let spread = information[(1, 1)] + information[(2, 2)];
        let determined = information.view((1, 1), (2, 2)).determinant() > 1e-6 * spread * spread;
        fit.cofactor = information
            .try_inverse()
            .filter(|_| determined)
            .unwrap_or(offset_only);
        fit
    }

    /// Centroid of the markers.
    pub(crate) fn centroid(&self) -> Vector3<f64> {
        self.centroid
    }

    /// Directions of x and y in the plane.
    pub(crate) fn axes(&self) -> [Vector3<f64>; 2] {
        self.axes
    }

    /// a = (1, x, y) of a point.
    pub(crate) fn coordinates(&self, at: &Point3<f64>) -> Vector3<f64> {
        let p = at.coords - self.centroid;
        Vector3::new(1.0, self.axes[0].dot(&p), self.axes[1].dot(&p))
    }

    /// Three combinations of a's coefficients whose errors have unit variance for markers of unit variance: the
    /// symmetric square root of the cofactor, which is continuous where eigenvectors are not.
    pub(crate) fn errors(&self) -> Matrix3<f64> {
        let root = self.cofactor.symmetric_eigen();
        let scale = root.eigenvalues.map(|v| v.max(0.0).sqrt());
        root.eigenvectors * Matrix3::from_diagonal(&scale) * root.eigenvectors.transpose()
    }
}
