//! A ray against a triangle mesh, without a gap between triangles that share an edge.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2(1), 2013:
//! space is sheared so that the ray becomes the z axis, and three edge functions in the x–y plane decide. A vertex
//! is sheared alike for every triangle that holds it, and an edge's function only changes its sign when the edge is
//! walked the other way; so two triangles never both disown a ray at the edge between them. Unlike the paper, which
//! computes in f32 and falls back to f64 where a function is zero, the sign of a function that rounding could have
//! changed is found from the exact products (fused multiply-add).

use super::FARTHEST;
use crate::footprint::Ray;
use nalgebra::{Point3, Vector3};

/// Decides in f64 which triangles of a mesh the rays of a bundle meet.
pub(super) struct Judge<'a> {
    pub(super) vertices: &'a [Point3<f64>],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) rays: &'a [Ray],
}

/// A ray as the triangle test wants it.
pub(super) struct Sheared<'a> {
    ray: &'a Ray,
    /// The axis along which the ray goes farthest, and the two others.
    axes: [usize; 3],
    shear: Vector3<f64>,
}

impl Judge<'_> {
    /// Distance at which a ray meets a triangle.
    pub(super) fn meet(&self, ray: usize, triangle: u32) -> Option<f64> {
        let corners = self.triangles[triangle as usize].map(|v| self.vertices[v as usize]);
        Sheared::new(&self.rays[ray]).meet(&corners)
    }
}

impl<'a> Sheared<'a> {
    pub(super) fn new(ray: &'a Ray) -> Self {
        let d = ray.direction.into_inner();
        let z = d.iamax();
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Self {
            ray,
            axes: [x, y, z],
            shear: Vector3::new(d[x] / d[z], d[y] / d[z], 1.0 / d[z]),
        }
    }

    /// Distance at which the ray meets a triangle, from either side; its edges and corners belong to it.
    pub(super) fn meet(&self, corners: &[Point3<f64>; 3]) -> Option<f64> {
        let [kx, ky, kz] = self.axes;
        let [a, b, c] = corners.map(|p| {
            let p = p - self.ray.origin;
            Vector3::new(
                p[kx] - self.shear.x * p[kz],
                p[ky] - self.shear.y * p[kz],
                self.shear.z * p[kz],
            )
        });
        let (u, v, w) = (edge(&c, &b), edge(&a, &c), edge(&b, &a));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let distance = (u * a.z + v * b.z + w * c.z) / sum;
        (distance > 0.0 && distance < FARTHEST).then_some(distance)
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
