//! What a ray meets, in two records: a small one for every ray that is cast, and the full one into which it is turned
//! once, for the rays that need it.

use nalgebra::{Point3, Unit, Vector3};

/// The nearest hit of a ray; [`World::surface_point`](crate::World::surface_point) adds where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Index of the surface.
    pub surface: u32,
    /// Index of the triangle if the surface is a mesh, otherwise [`NONE`].
    pub(crate) triangle: u32,
    /// Distance from the ray's origin, in meters.
    pub distance: f64,
    /// Dot product of the ray's direction and the normal of the surface's front, as in [`SurfacePoint`].
    pub closing: f64,
}

/// A point of a surface where a ray hits it.
#[derive(Debug, Clone, Copy)]
pub struct SurfacePoint {
    /// Index of the surface.
    pub surface: usize,
    /// Distance from the ray's origin, in meters.
    pub distance: f64,
    /// The point.
    pub point: Point3<f64>,
    /// Normal of the surface's front.
    pub normal: Unit<Vector3<f64>>,
    /// Dot product of the ray's direction and the normal: the cosine of the incidence, negative for a hit on the front.
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

impl SurfacePoint {
    /// Whether the front was hit.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}
