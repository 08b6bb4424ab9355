//! A ray against a triangle mesh, without a gap between triangles that share an edge.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2(1), 2013:
//! space is sheared so that the ray becomes the z axis, and three edge functions in the x–y plane decide. A vertex
//! is sheared alike for every triangle that holds it, and an edge's function only changes its sign when the edge is
//! walked the other way; so two triangles never both disown a ray at the edge between them. Unlike the paper, which
//! computes in f32 and falls back to f64 where a function is zero, the sign of a function that rounding could have
//! changed is found from the exact products (fused multiply-add). The distance is that to the triangle's plane.

use crate::lanes::{less, unfused};
use crate::ray::FARTHEST;
use crate::ray::Ray;
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f64x8, mask64x8};
use nalgebra::{Point3, Unit, Vector3};

/// Where a ray meets a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Met {
    /// Number of the triangle.
    pub triangle: u32,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
}

/// Decides in f64 which triangles of a mesh rays meet.
pub(crate) struct Judge<'a> {
    pub(crate) vertices: &'a [Point3<f64>],
    pub(crate) triangles: &'a [[u32; 3]],
}

/// A triangle's plane.
#[derive(Clone, Copy, Default)]
pub(crate) struct Plane {
    corner: Point3<f64>,
    /// (B − A)×(C − A).
    normal: Vector3<f64>,
    /// Least product of the normal and a direction with which the way is good.
    least: f64,
}

/// Least part of a triangle's greatest extent squared that its normal along a ray has where the way is that to the plane:
/// of slivers, and for rays along the plane, it is the mean of the corners' ways.
pub(crate) const STEEP: f64 = 1e-7;

impl Judge<'_> {
    /// Distance at which a ray meets a triangle.
    pub(crate) fn meet(&self, ray: &Ray, triangle: u32) -> Option<f64> {
        meet(ray, &self.corners(triangle))
    }

    /// Distance to a triangle that the ray surely meets: what [`Judge::meet`] gives, to the bit.
    pub(crate) fn way(&self, ray: &Ray, triangle: u32) -> f64 {
        let corners = self.corners(triangle);
        let plane = Plane::new(&corners);
        match plane.way(ray) {
            Some(way) => way,
            None => meet(ray, &corners).unwrap_or(FARTHEST),
        }
    }

    /// Normal of a triangle, for a ray that meets it.
    pub(crate) fn normal(&self, triangle: u32, ray: &Ray) -> Unit<Vector3<f64>> {
        // A sliver without an area has no normal; any that looks back does.
        Unit::try_new(self.plane(triangle).normal, f64::MIN_POSITIVE).unwrap_or(-ray.direction)
    }

    /// Product of a ray's direction with the normal of a triangle that it meets: the cosine of the incidence, with a sign.
    pub(crate) fn closing(&self, triangle: u32, ray: &Ray) -> f64 {
        let plane = self.plane(triangle);
        let inverse = plane.inverse();
        if inverse.is_finite() {
            plane.normal.dot(&ray.direction) * inverse
        } else {
            // Of a sliver without an area any normal that looks back does.
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

    /// How far a ray goes to the plane; `None` where that is not good ([`STEEP`]).
    fn way(&self, ray: &Ray) -> Option<f64> {
        let closing = self.normal.dot(&ray.direction);
        (closing.abs() > self.least).then(|| self.height(&ray.origin) / closing)
    }

    /// One over the normal's length.
    pub(crate) fn inverse(&self) -> f64 {
        1.0 / self.normal.norm()
    }

    /// N·(A − O).
    pub(crate) fn height(&self, origin: &Point3<f64>) -> f64 {
        self.normal.dot(&(self.corner - origin))
    }

    /// [`Plane::way`] of eight rays, the products of their directions with the normal, and where both are good.
    #[inline(always)]
    pub(crate) fn ways<S: Simd>(
        &self,
        simd: S,
        height: f64x8<S>,
        direction: &[f64x8<S>; 3],
    ) -> (f64x8<S>, f64x8<S>, mask64x8<S>) {
        let closing = unfused::product(simd, &self.normal, direction);
        let sure = closing.abs().simd_gt(f64x8::splat(simd, self.least));
        (height / closing, closing, sure)
    }

    /// [`Plane::height`] of eight rays.
    #[inline(always)]
    pub(crate) fn heights<S: Simd>(&self, simd: S, origin: &[f64x8<S>; 3]) -> f64x8<S> {
        let corner = [
            f64x8::splat(simd, self.corner.x),
            f64x8::splat(simd, self.corner.y),
            f64x8::splat(simd, self.corner.z),
        ];
        unfused::product(simd, &self.normal, &less(&corner, origin))
    }
}

/// Distance at which a ray meets a triangle, from either side; its edges and corners belong to it.
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
        .way(ray)
        .unwrap_or_else(|| (u * a.z + v * b.z + w * c.z) / sum);
    (distance > 0.0 && distance < FARTHEST).then_some(distance)
}

/// The axis along which a ray goes farthest, after the two others.
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

/// The edge function p×q, its sign exact.
fn edge(p: &Vector3<f64>, q: &Vector3<f64>) -> f64 {
    let (left, right) = (p.x * q.y, p.y * q.x);
    let value = left - right;
    // Both products are off by half a unit in their last place at most, and so is the difference.
    if value.abs() > 2.0 * f64::EPSILON * (left.abs() + right.abs()) {
        return value;
    }
    let (left_rest, right_rest) = (p.x.mul_add(q.y, -left), p.y.mul_add(q.x, -right));
    value + (left_rest - right_rest)
}
