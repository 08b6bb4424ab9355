//! A ray, and its transformation into another frame.

use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// A ray: a half-line from an origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Starting point.
    pub origin: Point3<f64>,
    /// Direction, of unit length.
    pub direction: Unit<Vector3<f64>>,
}

/// Search limit for hits, in meters: farther apart than any two places of a scene, whose coordinates are within 10 km, or 20
/// km for a mesh that is itself placed that far away.
pub(crate) const FARTHEST: f64 = 1e5;

/// Transforms a ray into another frame.
pub fn placed(ray: &Ray, other_from_ray: &Pose) -> Ray {
    Ray {
        origin: other_from_ray * ray.origin,
        direction: other_from_ray * ray.direction,
    }
}
