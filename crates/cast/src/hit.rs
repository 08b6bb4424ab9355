//! Where a ray meets a surface.

use nalgebra::{Point3, Unit, Vector3};

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Index of the surface.
    pub surface: usize,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
    /// The point.
    pub point: Point3<f64>,
    /// Normal of the surface, on the side of its front.
    pub normal: Unit<Vector3<f64>>,
    /// Product of the ray's direction with the normal: the cosine of the incidence, less than zero where the front was met.
    pub closing: f64,
}

/// Where a ray meets a surface, without what follows from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the surface.
    pub surface: u32,
    /// Number of its triangle, if it is a mesh.
    pub(crate) triangle: u32,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
    /// Product of the ray's direction with the normal of the surface's front, as of a [`Hit`].
    pub closing: f64,
}

/// Number of a surface or a triangle that is none.
pub(crate) const NONE: u32 = u32::MAX;

impl Hit {
    /// Whether the front was met.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}

impl Contact {
    /// Whether the front was met.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}
