//! One ray against the eight boxes of a node or the eight triangles of a leaf.
//!
//! The errors are those of [`beam`](super::beam) with the ray's origin as the reference, and with looser bounds: the
//! distance to the farthest corner is bounded by the reach of the mesh, the longest edge by two adjacent edges. One edge
//! function is N·d minus the other two, and carries the errors of all three.

use crate::index::wide::{Leaf, Node, WIDTH};
use crate::lanes::{cross, dot, inlined, minus, size};
use crate::ray::Ray;
use crate::rounding::ROUNDING;
use crate::rounding::rounded;
use fearless_simd::f32x8;
use fearless_simd::{Simd, prelude::*};

/// A ray in f32, prepared for slab tests.
pub(crate) struct Line {
    start: [f32; 3],
    direction: [f32; 3],
    /// By axis, whether the ray enters a box at its low (0) or high side (1).
    entry: [usize; 3],
    /// By axis, the distance to a slab side as a factor and a subtrahend, rounded so that boxes are entered early and
    /// left late.
    early: [[f32; 2]; 3],
    late: [[f32; 2]; 3],
    /// Error of a corner's coordinate relative to the origin.
    eta: f32,
    /// Upper bound on the L1 norm of a corner relative to the origin.
    far: f32,
}

/// Result of testing eight triangles.
#[derive(Default)]
pub(crate) struct Outcome {
    /// Bounds of the distance to each.
    pub(crate) low: [f32; WIDTH],
    pub(crate) high: [f32; WIDTH],
    /// Lanes that the ray may hit, and those that it certainly hits.
    pub(crate) may: u32,
    pub(crate) surely: u32,
}

impl Line {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, reach: f32) -> Self {
        let start: [f32; 3] = std::array::from_fn(|k| rounded(ray.origin[k]));
        let direction: [f32; 3] = std::array::from_fn(|k| rounded(ray.direction[k]));
        let greatest = start.iter().fold(0.0_f32, |m, c| c.abs().max(m));
        // Its inverse stays finite, and a ray inside the slab stays inside up to the search limit.
        const LEAST: f32 = 1e-20;
        let slack = 4.0 * ROUNDING * (greatest + reach);
        let mut line = Self {
            start,
            direction,
            entry: [0; 3],
            early: [[0.0; 2]; 3],
            late: [[0.0; 2]; 3],
            eta: 3.0 * ROUNDING * (reach + greatest),
            far: 3.0 * (reach + greatest),
        };
        for k in 0..3 {
            let d = direction[k];
            let inverse = 1.0 / d.abs().max(LEAST).copysign(d);
            line.entry[k] = usize::from(d.is_sign_negative());
            let slack = slack.copysign(d);
            let (early, late) = (inverse * (1.0 - 8.0 * ROUNDING), inverse * (1.0 + 8.0 * ROUNDING));
            line.early[k] = [early, (start[k] + slack) * early];
            line.late[k] = [late, (start[k] - slack) * late];
        }
        line
    }

    /// Returns which of eight boxes the ray hits before `limit`, and the entry distances.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(&self, simd: S, node: &Node, limit: f32) -> (u32, f32x8<S>) {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let side = inlined(
            #[inline(always)]
            |k: usize, far: usize| f32x8::simd_from(simd, node.bounds[k][(self.entry[k] ^ far) & 1]),
        );
        let distance = inlined(
            #[inline(always)]
            |side: f32x8<S>, [factor, subtrahend]: [f32; 2]| side.mul_sub(splat(factor), splat(subtrahend)),
        );
        let enter = inlined(
            #[inline(always)]
            |k: usize| distance(side(k, 0), self.early[k]),
        );
        let leave = inlined(
            #[inline(always)]
            |k: usize| distance(side(k, 1), self.late[k]),
        );
        let near = enter(0).max(enter(1)).max(enter(2).max(splat(0.0)));
        let far = leave(0).min(leave(1)).min(leave(2));
        let met = near.simd_le(far.min(splat(limit)));
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        (met.to_bitmask() as u32, near)
    }

    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(
        &self,
        simd: S,
        leaf: &Leaf,
        count: usize,
        limit: f32,
        outcome: &mut Outcome,
    ) {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let corner = inlined(
            #[inline(always)]
            |corner: usize| {
                [
                    f32x8::simd_from(simd, leaf.corners[corner][0]),
                    f32x8::simd_from(simd, leaf.corners[corner][1]),
                    f32x8::simd_from(simd, leaf.corners[corner][2]),
                ]
            },
        );
        let three = inlined(
            #[inline(always)]
            |v: &[f32; 3]| [splat(v[0]), splat(v[1]), splat(v[2])],
        );
        let d = three(&self.direction);
        let a = corner(0);
        let (b, c) = (minus(&corner(1), &a), minus(&corner(2), &a));
        let a = minus(&a, &three(&self.start));
        let normal = cross(&b, &c);
        let closing = dot(&normal, &d);
        let moment = cross(&a, &d);
        let (v, w) = (dot(&c, &moment), -dot(&b, &moment));
        let u = closing - v - w;
        let long = size(&b).max(size(&c));
        let eta = splat(self.eta);
        let error = (long + splat(4.0 * self.eta)) * splat(64.0 * ROUNDING * self.far + 16.0 * self.eta);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let may = least.simd_ge(-error) | most.simd_le(error);
        outcome.may = 0;
        if may.to_bitmask() == 0 {
            return;
        }
        let inside = least.simd_gt(error) | most.simd_lt(-error);
        let cube = long * long * long;
        let error = splat(16.0 * ROUNDING * self.far + 4.0 * self.eta);
        let error = error.mul_add(size(&normal), cube * splat(128.0 * ROUNDING)) * 2.0;
        let least = long * long.mul_add(splat(128.0 * ROUNDING), eta * 32.0);
        let inverse = splat(1.0) / closing;
        let distance = dot(&normal, &a) * inverse;
        let error = error * inverse.abs();
        let (low, high) = (distance - error, distance + error);
        let sure = closing.abs().simd_gt(least);
        let aside = sure & (low.simd_gt(splat(limit)) | high.simd_lt(splat(0.0)));
        low.store_slice(&mut outcome.low);
        high.store_slice(&mut outcome.high);
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        {
            outcome.may = (may.to_bitmask() & !aside.to_bitmask()) as u32 & ((1 << count) - 1);
            outcome.surely = (inside & sure & low.simd_gt(splat(0.0))).to_bitmask() as u32;
        }
    }
}
