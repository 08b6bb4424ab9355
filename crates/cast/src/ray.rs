//! A ray.

use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// A ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: Point3<f64>,
    /// Where it goes.
    pub direction: Unit<Vector3<f64>>,
}

/// Farthest distance at which anything is looked for, in metres: beyond any scanner's range.
pub(crate) const FARTHEST: f64 = 1e4;

/// A ray moved into another frame.
pub fn placed(ray: &Ray, other_from_ray: &Pose) -> Ray {
    Ray {
        origin: other_from_ray * ray.origin,
        direction: other_from_ray * ray.direction,
    }
}
