//! Rows of a packet: one coordinate of sixteen rays per row, in one or more rows.

use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

/// Rays that one instruction processes in f32.
pub(crate) const LANES: usize = 16;

/// Rays that one instruction processes in f64.
pub(crate) const HALF: usize = LANES / 2;

/// Maximum number of rows of a packet. Packets also come with one, two and four rows; the constants below are the rays
/// that fit.
pub(crate) const ROWS: usize = 8;
pub(crate) const TWO_ROWS: usize = 2 * LANES;
pub(crate) const FOUR_ROWS: usize = 4 * LANES;
pub(crate) const MOST: usize = ROWS * LANES;

/// Rays of a full packet of [`World::cast_packets`](crate::World::cast_packets) and
/// [`Triangles::cast_packets`](crate::Triangles::cast_packets).
pub const PACKET: usize = MOST;

/// One number per ray.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(crate) struct Rows<T, const R: usize>(pub(crate) [[T; LANES]; R]);

/// Points or directions, by axis.
pub(crate) type Vectors<T, const R: usize> = [Rows<T, R>; 3];

/// Coordinates in f64 of `R` rows of rays, by axis.
pub(crate) type F64Rows<'a, const R: usize> = [&'a [[f64; LANES]; R]; 3];

impl<T: Copy, const R: usize> Rows<T, R> {
    pub(crate) fn of(value: T) -> Self {
        Self([[value; LANES]; R])
    }

    pub(crate) fn get(&self, ray: usize) -> T {
        self.0[ray / LANES][ray % LANES]
    }

    pub(crate) fn set(&mut self, ray: usize, value: T) {
        self.0[ray / LANES][ray % LANES] = value;
    }

    /// Fills the padding after `count` rays with the first ray's number.
    pub(crate) fn fill_up(&mut self, count: usize) {
        let all = self.0.as_flattened_mut();
        let first = all[0];
        all[count..].fill(first);
    }
}

/// Returns a row of f64 as two SIMD vectors.
#[inline(always)]
pub(crate) fn halves<S: Simd>(simd: S, row: &[f64; LANES]) -> [f64x8<S>; 2] {
    [
        f64x8::from_slice(simd, &row[..HALF]),
        f64x8::from_slice(simd, &row[HALF..]),
    ]
}

/// Returns the points or directions of one half of a row (0 or 1), in f64.
#[inline(always)]
pub(crate) fn half<S: Simd, const R: usize>(
    simd: S,
    [x, y, z]: &F64Rows<'_, R>,
    row: usize,
    second: usize,
) -> [f64x8<S>; 3] {
    let from = second * HALF;
    [
        f64x8::from_slice(simd, &x[row][from..from + HALF]),
        f64x8::from_slice(simd, &y[row][from..from + HALF]),
        f64x8::from_slice(simd, &z[row][from..from + HALF]),
    ]
}

/// Returns the points or directions of a row, in f32.
#[inline(always)]
pub(crate) fn whole<S: Simd, const R: usize>(simd: S, of: &Vectors<f32, R>, row: usize) -> [f32x16<S>; 3] {
    [
        f32x16::simd_from(simd, of[0].0[row]),
        f32x16::simd_from(simd, of[1].0[row]),
        f32x16::simd_from(simd, of[2].0[row]),
    ]
}
