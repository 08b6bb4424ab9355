//! Watertight ray–triangle intersection in f64.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2(1), 2013:
//! space is sheared so that the ray becomes the z axis, and three edge functions in the x–y plane decide. A vertex is
//! sheared identically for every triangle that uses it, and an edge function only changes its sign when the edge is
//! traversed in the opposite direction, so a ray at a shared edge never misses both triangles. The paper computes in
//! f32 and falls back to f64 where an edge function is zero; here, a sign that rounding could have changed is taken
//! from the exact products (fused multiply-add). The distance is that to the triangle's plane.

use crate::lanes::{minus, unfused};
use crate::ray::FARTHEST;
use crate::ray::Ray;
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f64x8, mask64x8};
use nalgebra::{Point3, Unit, Vector3};

/// Hit of a ray on a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TriangleHit {
    /// Index of the triangle.
    pub triangle: u32,
    /// Distance from the ray's origin, in meters.
    pub distance: f64,
}

/// Exact (f64) hit tests against the triangles of a mesh.
pub(crate) struct Judge<'a> {
    pub(crate) vertices: &'a [Point3<f64>],
    pub(crate) triangles: &'a [[u32; 3]],
}

/// The plane of a triangle.
#[derive(Clone, Copy, Default)]
pub(crate) struct Plane {
    corner: Point3<f64>,
    /// (B − A)×(C − A).
    normal: Vector3<f64>,
    /// Minimum |N·d| at which the distance to the plane is accurate.
    least: f64,
}

/// Minimum |N·d|, as a fraction of the triangle's largest extent squared, at which the distance is that to the plane. Below
/// it (slivers, and rays nearly in the plane) the distance is the weighted mean of the corners' distances.
pub(crate) const STEEP: f64 = 1e-7;

impl Judge<'_> {
    /// Returns the distance at which a ray hits a triangle.
    pub(crate) fn meet(&self, ray: &Ray, triangle: u32) -> Option<f64> {
        meet(ray, &self.corners(triangle))
    }

    /// Returns the distance to a triangle that the ray is known to hit: bit-identical to [`Judge::meet`].
    pub(crate) fn distance(&self, ray: &Ray, triangle: u32) -> f64 {
        let corners = self.corners(triangle);
        let plane = Plane::new(&corners);
        match plane.distance(ray) {
            Some(distance) => distance,
            None => meet(ray, &corners).unwrap_or(FARTHEST),
        }
    }

    /// Returns the normal of a triangle, for a ray that hits it.
    pub(crate) fn normal(&self, triangle: u32, ray: &Ray) -> Unit<Vector3<f64>> {
        // A triangle of zero area has no normal; one that faces the ray is used.
        Unit::try_new(self.plane(triangle).normal, f64::MIN_POSITIVE).unwrap_or(-ray.direction)
    }

    /// Returns the dot product of a ray's direction and the normal of a triangle that it hits: the signed cosine of the
    /// incidence.
    pub(crate) fn closing(&self, triangle: u32, ray: &Ray) -> f64 {
        let plane = self.plane(triangle);
        let inverse = plane.inverse();
        if inverse.is_finite() {
            plane.normal.dot(&ray.direction) * inverse
        } else {
            // A triangle of zero area: its normal faces the ray.
            -1.0
        }
    }

    #[inline(always)]
    pub(crate) fn plane(&self, triangle: u32) -> Plane {
        Plane::new(&self.corners(triangle))
    }

    #[inline(always)]
    pub(crate) fn corners(&self, triangle: u32) -> [Point3<f64>; 3] {
        let [a, b, c] = self.triangles[triangle as usize];
        [
            self.vertices[a as usize],
            self.vertices[b as usize],
            self.vertices[c as usize],
        ]
    }
}

impl Plane {
    #[inline(always)]
    fn new([a, b, c]: &[Point3<f64>; 3]) -> Self {
        let (p, q) = (b - a, c - a);
        let long = p.abs().sum().max(q.abs().sum());
        Self {
            corner: *a,
            normal: p.cross(&q),
            least: STEEP * long * long,
        }
    }

    /// Returns the distance of a ray to the plane; `None` where it is not accurate ([`STEEP`]).
    fn distance(&self, ray: &Ray) -> Option<f64> {
        let closing = self.normal.dot(&ray.direction);
        (closing.abs() > self.least).then(|| self.height(&ray.origin) / closing)
    }

    /// Returns 1/|N|.
    pub(crate) fn inverse(&self) -> f64 {
        1.0 / self.normal.norm()
    }

    /// N·(A − O).
    pub(crate) fn height(&self, origin: &Point3<f64>) -> f64 {
        self.normal.dot(&(self.corner - origin))
    }

    /// Returns [`Plane::distance`] of eight rays, N·d of each, and the mask of rays for which both are accurate.
    #[inline(always)]
    pub(crate) fn distances<S: Simd>(
        &self,
        simd: S,
        height: f64x8<S>,
        direction: &[f64x8<S>; 3],
    ) -> (f64x8<S>, f64x8<S>, mask64x8<S>) {
        let closing = unfused::product(simd, &self.normal, direction);
        let sure = closing.abs().simd_gt(f64x8::splat(simd, self.least));
        (height / closing, closing, sure)
    }

    /// Returns [`Plane::height`] of eight rays.
    #[inline(always)]
    pub(crate) fn heights<S: Simd>(&self, simd: S, origin: &[f64x8<S>; 3]) -> f64x8<S> {
        let corner = [
            f64x8::splat(simd, self.corner.x),
            f64x8::splat(simd, self.corner.y),
            f64x8::splat(simd, self.corner.z),
        ];
        unfused::product(simd, &self.normal, &minus(&corner, origin))
    }
}

/// Returns the distance at which a ray hits a triangle, from either side; its edges and corners are part of it.
fn meet(ray: &Ray, corners: &[Point3<f64>; 3]) -> Option<f64> {
    let d = ray.direction.into_inner();
    let [kx, ky, kz] = axes(ray);
    let shear = Vector3::new(d[kx] / d[kz], d[ky] / d[kz], 1.0 / d[kz]);
    let [a, b, c] = corners.map(|p| {
        let p = p - ray.origin;
        Vector3::new(p[kx] - shear.x * p[kz], p[ky] - shear.y * p[kz], shear.z * p[kz])
    });
    let (u, v, w) = (edge(&c, &b), edge(&a, &c), edge(&b, &a));
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let sum = u + v + w;
    if sum == 0.0 {
        return None;
    }
    let distance = Plane::new(corners)
        .distance(ray)
        .unwrap_or_else(|| (u * a.z + v * b.z + w * c.z) / sum);
    (distance > 0.0 && distance < FARTHEST).then_some(distance)
}

/// Returns the axes, the one with the ray's largest direction component last.
#[inline(always)]
fn axes(ray: &Ray) -> [usize; 3] {
    let d = &ray.direction;
    let (x, y, z) = (d.x.abs(), d.y.abs(), d.z.abs());
    if x >= y && x >= z {
        [1, 2, 0]
    } else if y >= z {
        [2, 0, 1]
    } else {
        [0, 1, 2]
    }
}

/// Returns the edge function p×q with an exact sign.
fn edge(p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
    let (left, right) = (p.x * q.y, p.y * q.x);
    let value = left - right;
    // Each product, and the difference, is rounded by at most half a unit in the last place.
    if value.abs() > 2.0 * f64::EPSILON * (left.abs() + right.abs()) {
        return value;
    }
    let (left_rest, right_rest) = (p.x.mul_add(q.y, -left), p.y.mul_add(q.x, -right));
    value + (left_rest - right_rest)
}
