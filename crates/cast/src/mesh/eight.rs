//! One ray against the eight triangles of a leaf.
//!
//! The errors are those of [`packet`](super::packet) with the ray's origin as the reference, and with looser bounds: the
//! distance to the farthest corner is bounded by the reach of the mesh, the longest edge by two adjacent edges. One edge
//! function is N·d minus the other two, and carries the errors of all three.

use crate::index::line::Line;
use crate::index::wide::{Leaf, WIDTH};
use crate::lanes::{cross, dot, inlined, minus, size};
use crate::rounding::ROUNDING;
use fearless_simd::{Simd, f32x8, prelude::*};

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
