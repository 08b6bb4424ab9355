//! One ray against the eight boxes of a node, by slabs in f32 and conservatively: rounding never hides a box that the ray
//! enters.

use crate::index::wide::Node;
use crate::lanes::inlined;
use crate::ray::Ray;
use crate::rounding::{ROUNDING, rounded};
use fearless_simd::{Simd, f32x8, prelude::*};

/// A ray in f32, prepared for slab tests.
pub(crate) struct Line {
    pub(crate) start: [f32; 3],
    pub(crate) direction: [f32; 3],
    /// By axis, whether the ray enters a box at its low (0) or high side (1).
    entry: [usize; 3],
    /// By axis, the distance to a slab side as a factor and a subtrahend, rounded so that boxes are entered early and
    /// left late.
    early: [[f32; 2]; 3],
    late: [[f32; 2]; 3],
    /// Error of a corner's coordinate relative to the origin.
    pub(crate) eta: f32,
    /// Upper bound on the L1 norm of a corner relative to the origin.
    pub(crate) far: f32,
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
        let hits = near.simd_le(far.min(splat(limit)));
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        (hits.to_bitmask() as u32, near)
    }
}
