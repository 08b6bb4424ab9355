//! Hits of rays on surfaces, and their compact record.

use nalgebra::{Point3, Unit, Vector3};

/// Where a ray hits a surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Index of the surface.
    pub surface: usize,
    /// Distance from the ray's origin, in meters.
    pub distance: f64,
    /// The hit point.
    pub point: Point3<f64>,
    /// Normal of the surface's front.
    pub normal: Unit<Vector3<f64>>,
    /// Dot product of the ray's direction and the normal: the cosine of the incidence, negative for a hit on the front.
    pub closing: f64,
}

/// Compact record of a hit; [`World::hit`](crate::World::hit) completes it with the point and the normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the surface.
    pub surface: u32,
    /// Index of the triangle, if the surface is a mesh.
    pub(crate) triangle: u32,
    /// Distance from the ray's origin, in meters.
    pub distance: f64,
    /// Dot product of the ray's direction and the normal of the surface's front, as in [`Hit`].
    pub closing: f64,
}

/// Index that stands for no surface or no triangle.
pub(crate) const NONE: u32 = u32::MAX;

impl Hit {
    /// Whether the front was hit.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}

impl Contact {
    /// Whether the front was hit.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}
