//! A ray against a triangle mesh, without a gap between triangles that share an edge.
//!
//! Woop, Benthin, Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2(1), 2013:
//! space is sheared so that the ray becomes the z axis, and three edge functions in the x–y plane decide. A vertex
//! is sheared alike for every triangle that holds it, and an edge's function only changes its sign when the edge is
//! walked the other way; so two triangles never both disown a ray at the edge between them. Unlike the paper, which
//! computes in f32 and falls back to f64 where a function is zero, the sign of a function that rounding could have
//! changed is found from the exact products (fused multiply-add).

use super::FARTHEST;
use super::lanes::{inlined, less, load};
use crate::footprint::Ray;
use fearless_simd::f64x8;
use fearless_simd::{Simd, prelude::*};
use nalgebra::{Point3, Vector3};

/// Rays that are treated at once.
pub(super) const LANES: usize = 8;

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
        let [a, b, c] = self.triangles[triangle as usize];
        let corners = [a, b, c].map(|v| self.vertices[v as usize]);
        Sheared::new(&self.rays[ray]).meet(&corners)
    }

    /// The same for eight rays from `first` on, each with a triangle of its own; to the bit what [`Judge::meet`] gives.
    ///
    /// Rays beyond the last one and rays with the triangle `none` have no distance.
    #[inline(always)]
    pub(super) fn meet_each<S: Simd>(
        &self,
        simd: S,
        first: usize,
        triangles: &[u32; LANES],
        none: u32,
    ) -> [Option<f64>; LANES] {
        let mut direction = [[1.0; LANES]; 3];
        let mut origin = [[0.0; LANES]; 3];
        let mut wanted = 0_u64;
        let mut one = none;
        let mut alike = true;
        for (lane, ray) in self.rays[first..].iter().take(LANES).enumerate() {
            for k in 0..3 {
                direction[k][lane] = ray.direction[k];
                origin[k][lane] = ray.origin[k];
            }
            let triangle = triangles[lane];
            if triangle != none {
                wanted |= 1 << lane;
                alike &= one == none || one == triangle;
                one = triangle;
            }
        }
        if wanted == 0 {
            return [None; LANES];
        }
        let direction = load(simd, &direction);
        let origin = load(simd, &origin);
        // As in [`axes`].
        let [x, y, z] = [direction[0].abs(), direction[1].abs(), direction[2].abs()];
        let (along_x, over_z) = (x.simd_ge(y) & x.simd_ge(z), y.simd_ge(z));
        let turned = inlined(
            #[inline(always)]
            |[x, y, z]: [f64x8<S>; 3]| {
                let (if_y, if_z) = ([z, x, y], [x, y, z]);
                let if_x = [y, z, x];
                [
                    along_x.select(if_x[0], over_z.select(if_y[0], if_z[0])),
                    along_x.select(if_x[1], over_z.select(if_y[1], if_z[1])),
                    along_x.select(if_x[2], over_z.select(if_y[2], if_z[2])),
                ]
            },
        );
        let corner = inlined(
            #[inline(always)]
            |corner: usize| {
                let seen = if alike {
                    let vertex = &self.vertices[self.triangles[one as usize][corner] as usize];
                    [
                        f64x8::splat(simd, vertex.x),
                        f64x8::splat(simd, vertex.y),
                        f64x8::splat(simd, vertex.z),
                    ]
                } else {
                    let mut corners = [[0.0; LANES]; 3];
                    for lane in 0..LANES {
                        if wanted >> lane & 1 == 1 {
                            let vertex =
                                &self.vertices[self.triangles[triangles[lane] as usize][corner] as usize];
                            for k in 0..3 {
                                corners[k][lane] = vertex[k];
                            }
                        }
                    }
                    load(simd, &corners)
                };
                turned(less(&seen, &origin))
            },
        );
        let [dx, dy, dz] = turned(direction);
        let shear = [dx / dz, dy / dz, f64x8::splat(simd, 1.0) / dz];
        let sheared = inlined(
            #[inline(always)]
            |[x, y, z]: [f64x8<S>; 3]| (x - shear[0] * z, y - shear[1] * z, shear[2] * z),
        );
        let (a, b, c) = (sheared(corner(0)), sheared(corner(1)), sheared(corner(2)));
        let zero = f64x8::splat(simd, 0.0);
        // An edge function and whether its sign is beyond doubt, as in [`edge`].
        let edge = inlined(
            #[inline(always)]
            |p: &(f64x8<S>, f64x8<S>, f64x8<S>), q: &(f64x8<S>, f64x8<S>, f64x8<S>)| {
                let (left, right) = (p.0 * q.1, p.1 * q.0);
                let value = left - right;
                let sure = value
                    .abs()
                    .simd_gt((left.abs() + right.abs()) * f64x8::splat(simd, 2.0 * f64::EPSILON));
                (value, sure)
            },
        );
        let ((u, su), (v, sv), (w, sw)) = (edge(&c, &b), edge(&a, &c), edge(&b, &a));
        let sum = u + v + w;
        let distance = (u * a.2 + v * b.2 + w * c.2) / sum;
        let front = u.simd_gt(zero) & v.simd_gt(zero) & w.simd_gt(zero);
        let back = u.simd_lt(zero) & v.simd_lt(zero) & w.simd_lt(zero);
        let within = distance.simd_gt(zero) & distance.simd_lt(f64x8::splat(simd, FARTHEST));
        let met = (su & sv & sw & (front | back) & within).to_bitmask();
        let mut distances = [0.0; LANES];
        distance.store_slice(&mut distances);
        let mut all = [None; LANES];
        for lane in 0..LANES {
            if wanted >> lane & 1 == 0 {
                continue;
            }
            all[lane] = if met >> lane & 1 == 1 {
                Some(distances[lane])
            } else {
                self.meet(first + lane, triangles[lane])
            };
        }
        all
    }
}

impl<'a> Sheared<'a> {
    pub(super) fn new(ray: &'a Ray) -> Self {
        let d = ray.direction.into_inner();
        let [x, y, z] = axes(ray);
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
