//! Small arithmetic in lanes.
//!
//! An instruction set that is found at run time holds for one function and what is inlined into it. So all that works
//! in lanes is always inlined, closures too ([`inlined`]), and arrays are not mapped.

use fearless_simd::{Simd, SimdFloat, f64x8};

/// A closure that is inlined wherever it is called: write `inlined(#[inline(always)] |x| …)`.
#[inline(always)]
pub(crate) fn inlined<F>(closure: F) -> F {
    closure
}

#[inline(always)]
pub(crate) fn less<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> [L; 3] {
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

/// Sum of the coordinates' sizes: not less than the length.
#[inline(always)]
pub(crate) fn size<S: Simd, L: SimdFloat<S>>(a: &[L; 3]) -> L {
    a[0].abs() + a[1].abs() + a[2].abs()
}

/// Products and sums each rounded by itself, in the order of a vector alone: what is worked out in lanes is then the same to
/// the bit.
pub(crate) mod unfused {
    use super::{Simd, SimdFloat, f64x8};
    use fearless_simd::prelude::*;
    use nalgebra::Vector3;

    #[inline(always)]
    pub(crate) fn dot<S: Simd, L: SimdFloat<S>>(a: &[L; 3], b: &[L; 3]) -> L {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    /// Of one vector and eight.
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
