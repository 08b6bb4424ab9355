//! Rows of a bundle: a coordinate of sixteen rays side by side, one row or some.

use super::build::rounded;
use super::rays::Rays;
use crate::footprint::Ray;
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};
use nalgebra::{Point3, Unit, Vector3};
use std::ops::Range;

/// Rays that one instruction treats in f32.
pub(super) const LANES: usize = 16;

/// Rays that one instruction treats in f64.
pub(super) const HALF: usize = LANES / 2;

/// Most rows of a bundle. Bundles also come with one, two and four, and these are what fits.
pub(super) const ROWS: usize = 8;
pub(super) const TWO_ROWS: usize = 2 * LANES;
pub(super) const FOUR_ROWS: usize = 4 * LANES;
pub(super) const MOST: usize = ROWS * LANES;

/// A number of every ray.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Rows<T, const R: usize>(pub(super) [[T; LANES]; R]);

/// Points or directions, by axis.
pub(super) type Vectors<T, const R: usize> = [Rows<T, R>; 3];

/// Coordinates in f64 of so many rows of rays, by axis.
pub(super) type Wide<'a, const R: usize> = [&'a [[f64; LANES]; R]; 3];

/// Rays in f64. What the last row has too many may be anything.
pub(super) struct InRows<'a, const R: usize> {
    pub(super) count: usize,
    pub(super) direction: Wide<'a, R>,
    pub(super) origin: Wide<'a, R>,
    /// Where all of them start, bit for bit, if they do.
    pub(super) common: Option<Point3<f64>>,
}

impl<T: Copy, const R: usize> Rows<T, R> {
    pub(super) fn of(value: T) -> Self {
        Self([[value; LANES]; R])
    }

    pub(super) fn get(&self, ray: usize) -> T {
        self.0[ray / LANES][ray % LANES]
    }

    pub(super) fn set(&mut self, ray: usize, value: T) {
        self.0[ray / LANES][ray % LANES] = value;
    }

    /// Gives all after so many rays the number of the first.
    pub(super) fn fill_up(&mut self, count: usize) {
        let all = self.0.as_flattened_mut();
        let first = all[0];
        all[count..].fill(first);
    }
}

impl<'a, const R: usize> InRows<'a, R> {
    /// Some rays, as many as fit, one at least.
    #[inline(always)]
    pub(super) fn of(rays: &'a Rays, which: Range<usize>) -> Self {
        let count = which.len();
        assert!((1..=R * LANES).contains(&count), "they fit");
        let [origin, direction] = rays.rows(which.start);
        let mut apart = 0;
        for row in origin {
            let row = &row.as_flattened()[..count];
            let first = row[0].to_bits();
            apart = row.iter().fold(apart, |apart, x| apart | (first ^ x.to_bits()));
        }
        Self {
            count,
            direction,
            origin,
            common: (apart == 0).then(|| rays.get(which.start).origin),
        }
    }

    /// One of them.
    pub(super) fn get(&self, ray: usize) -> Ray {
        let of = |[x, y, z]: &Wide<'_, R>| {
            let at = |row: &[[f64; LANES]; R]| row[ray / LANES][ray % LANES];
            Vector3::new(at(x), at(y), at(z))
        };
        Ray {
            origin: Point3::from(of(&self.origin)),
            // As it came.
            direction: Unit::new_unchecked(of(&self.direction)),
        }
    }

    /// Directions in f32; what the last row has too many are copies of the first ray.
    #[inline(always)]
    pub(super) fn narrow<S: Simd>(&self, simd: S, narrow: &mut Vectors<f32, R>) {
        for (wide, narrow) in self.direction.iter().zip(narrow) {
            for (wide, narrow) in wide.iter().zip(&mut narrow.0) {
                let [low, high] = halves(simd, wide);
                low.narrow(high).store_slice(narrow);
            }
            narrow.fill_up(self.count);
        }
    }

    /// The start of the first ray in f32.
    #[inline(always)]
    pub(super) fn start(&self) -> [f32; 3] {
        let [x, y, z] = self.origin;
        [rounded(x[0][0]), rounded(y[0][0]), rounded(z[0][0])]
    }

    /// Starts of a half of a row (the first or the second).
    #[inline(always)]
    pub(super) fn starts<S: Simd>(&self, simd: S, row: usize, second: usize) -> [f64x8<S>; 3] {
        match &self.common {
            Some(point) => [
                f64x8::splat(simd, point.x),
                f64x8::splat(simd, point.y),
                f64x8::splat(simd, point.z),
            ],
            None => half(simd, &self.origin, row, second),
        }
    }
}

/// A row of f64 as two vectors.
#[inline(always)]
pub(super) fn halves<S: Simd>(simd: S, row: &[f64; LANES]) -> [f64x8<S>; 2] {
    [
        f64x8::from_slice(simd, &row[..HALF]),
        f64x8::from_slice(simd, &row[HALF..]),
    ]
}

/// The points or directions of a half of a row (the first or the second), in f64.
#[inline(always)]
pub(super) fn half<S: Simd, const R: usize>(
    simd: S,
    [x, y, z]: &Wide<'_, R>,
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

/// The points or directions of a row, in f32.
#[inline(always)]
pub(super) fn whole<S: Simd, const R: usize>(simd: S, of: &Vectors<f32, R>, row: usize) -> [f32x16<S>; 3] {
    [
        f32x16::simd_from(simd, of[0].0[row]),
        f32x16::simd_from(simd, of[1].0[row]),
        f32x16::simd_from(simd, of[2].0[row]),
    ]
}
