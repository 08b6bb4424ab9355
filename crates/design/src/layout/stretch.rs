//! How curved mirrors stretch the cell of a beam: directions in the scan and exit directions, to first order about the
//! chief ray.
//!
//! ```text
//! v ∝ v₀ + J·(Δazimuth, Δelevation)        J by central differences of rays from the origin
//! ```

use super::footprint::reflected;
use catoptric_cast::Ray;
use catoptric_model::beam;
use catoptric_sim::build::Structure;
use nalgebra::{Matrix2, Matrix3x2, Point3, Vector2, Vector3};

/// Half the difference of angles over which derivatives are taken, in radians.
const STEP: f64 = 1e-5;

/// The exit directions of one beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// That of the chief ray.
    chief: Vector3<f64>,
    by: Matrix3x2<f64>,
    inverse: Matrix2<f64>,
}

impl Stretch {
    /// Of a beam that meets some facets; `None` if all of them are flat.
    pub(crate) fn of(structure: &Structure, facets: &[usize], azimuth: f64) -> Option<Self> {
        if facets.iter().all(|f| structure.facets[*f].bent.is_none()) {
            return None;
        }
        let exit = |along: f64, across: f64| {
            let start = Ray {
                origin: Point3::origin(),
                direction: beam::spherical(azimuth + along, across),
            };
            let end = (facets.iter()).fold(start, |ray, f| reflected(&ray, &structure.facets[*f]));
            end.direction.into_inner()
        };
        let chief = exit(0.0, 0.0);
        let slope = |along: f64, across: f64| {
            let by = (exit(along, across) - exit(-along, -across)) / (2.0 * STEP);
            by - chief * chief.dot(&by)
        };
        let by = Matrix3x2::from_columns(&[slope(STEP, 0.0), slope(0.0, STEP)]);
        Some(Self {
            chief,
            by,
            // Light that is collimated along an axis has no cell.
            inverse: (by.transpose() * by).try_inverse().unwrap_or_else(Matrix2::zeros),
        })
    }

    /// Exit direction of a ray beside the chief ray, by its azimuth and elevation in the scan relative to that.
    pub fn exit(&self, along: f64, across: f64) -> Vector3<f64> {
        (self.chief + self.by * Vector2::new(along, across)).normalize()
    }

    /// Azimuth and elevation in the scan, relative to the chief ray, of an exit direction; `None` behind it.
    pub(crate) fn in_scan(&self, direction: &Vector3<f64>) -> Option<[f64; 2]> {
        let ahead = self.chief.dot(direction);
        (ahead > 0.0).then(|| (self.inverse * (self.by.transpose() * (direction / ahead))).into())
    }

    /// Cosine of the angle between the chief ray and an exit direction.
    pub(crate) fn cos_to(&self, direction: &Vector3<f64>) -> f64 {
        self.chief.dot(direction)
    }

    /// Factor by which it enlarges solid angles.
    pub fn growth(&self) -> f64 {
        self.by.column(0).cross(&self.by.column(1)).norm()
    }
}
