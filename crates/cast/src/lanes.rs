//! Vector arithmetic in SIMD lanes.
//!
//! An instruction set that is detected at run time applies to one function and whatever is inlined into it. So every
//! function on lanes is always inlined, closures included ([`inlined`]), and `array::map` is avoided.

use fearless_simd::{Simd, SimdFloat, f64x8};

/// Returns the closure itself, as the place for an attribute: `inlined(#[inline(always)] |x| …)`.
#[inline(always)]
pub(crate) fn inlined<F>(closure: F) -> F {
    closure
}

#[inline(always)]
pub(crate) fn minus<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn dot<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> L {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(crate) fn cross<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
    [
        a[1].mul_sub(b[2], a[2] * b[1]),
        a[2].mul_sub(b[0], a[0] * b[2]),
        a[0].mul_sub(b[1], a[1] * b[0]),
    ]
}

/// Returns the L1 norm, an upper bound on the length.
#[inline(always)]
pub(crate) fn size<S: Simd, L: SimdFloat<S>>(a: &[L; 3]) -> L {
    a[0].abs() + a[1].abs() + a[2].abs()
}

/// Arithmetic without fused multiply-add, in the order of the scalar code: results in lanes are bit-identical to it.
pub(crate) mod unfused {
    use super::{Simd, SimdFloat, f64x8};
    use fearless_simd::prelude::*;
    use nalgebra::Vector3;

    #[inline(always)]
    pub(crate) fn dot<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> L {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// Returns the dot products of one vector with eight.
    #[inline(always)]
    pub(crate) fn product<S: Simd>(simd: S, a: &Vector3<f64>, b: &[f64x8<S>; 3]) -> f64x8<S> {
        let a = [
            f64x8::splat(simd, a.x),
            f64x8::splat(simd, a.y),
            f64x8::splat(simd, a.z),
        ];
        dot(&a, b)
    }

    #[inline(always)]
    pub(crate) fn cross<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    }
}
