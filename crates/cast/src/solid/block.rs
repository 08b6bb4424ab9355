//! Intersection of a ray with an oriented box.

use crate::ray::{FARTHEST, Ray};
use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};
use parry3d::math::Vector;
use parry3d::query::RayCast;
use parry3d::shape::Cuboid;

/// An oriented box.
#[derive(Debug, Clone)]
pub struct Block {
    pub(crate) sensor_from_block: Pose,
    pub(crate) cuboid: Cuboid,
}

impl Block {
    /// A box of the given extents, in meters, centered on its frame.
    pub fn new(sensor_from_block: Pose, size: Vector3<f64>) -> Self {
        Self {
            sensor_from_block,
            cuboid: Cuboid::new(to_glam(&(size * 0.5))),
        }
    }

    /// Returns distance and outward normal where a ray enters the box, or leaves it if it starts inside.
    pub(crate) fn cast(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        let origin = self.sensor_from_block.inverse_transform_point(&ray.origin);
        let direction = self.sensor_from_block.inverse_transform_vector(&ray.direction);
        let local = parry3d::query::Ray::new(to_glam(&origin.coords), to_glam(&direction));
        let hit = self
            .cuboid
            .cast_local_ray_and_get_normal(&local, FARTHEST, false)?;
        let normal = self.sensor_from_block * Vector3::new(hit.normal.x, hit.normal.y, hit.normal.z);
        (hit.time_of_impact > 0.0).then(|| (hit.time_of_impact, Unit::new_normalize(normal)))
    }

    pub(crate) fn corners(&self) -> Vec<Point3<f64>> {
        let h = self.cuboid.half_extents;
        (0..8)
            .map(|i| {
                let sign = |bit: u8| if i & bit == 0 { -1.0 } else { 1.0 };
                self.sensor_from_block * Point3::new(sign(1) * h.x, sign(2) * h.y, sign(4) * h.z)
            })
            .collect()
    }
}

/// Converts a vector to parry's type.
pub(crate) fn to_glam(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}
