//! Rays in rows: a coordinate of sixteen rays side by side, one row or some.

use super::build::rounded;
use crate::footprint::Ray;
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};
use nalgebra::{Point3, Vector3};

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

/// Rays in f64. What the last row has too many are copies of the first ray.
pub(super) struct Rays<const R: usize> {
    pub(super) count: usize,
    pub(super) direction: Vectors<f64, R>,
    pub(super) origin: Origin<R>,
}

/// Where rays start.
pub(super) enum Origin<const R: usize> {
    /// All at one point, bit for bit.
    Common(Point3<f64>),
    Each(Vectors<f64, R>),
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
}

impl<const R: usize> Rays<R> {
    pub(super) fn blank() -> Self {
        Self {
            count: 0,
            direction: [Rows::of(0.0); 3],
            origin: Origin::Common(Point3::origin()),
        }
    }

    /// Takes rays, as many as fit, one at least.
    #[inline(always)]
    pub(super) fn fill(&mut self, rays: &[Ray]) {
        assert!(!rays.is_empty() && rays.len() <= R * LANES, "they fit");
        self.count = rays.len();
        fill(&mut self.direction, rays, |ray| ray.direction.into_inner());
        let first = rays[0].origin;
        let [a, b, c] = [first.x, first.y, first.z].map(f64::to_bits);
        let apart = rays.iter().fold(0, |apart, ray| {
            let [x, y, z] = [ray.origin.x, ray.origin.y, ray.origin.z].map(f64::to_bits);
            apart | (x ^ a) | (y ^ b) | (z ^ c)
        });
        self.origin = if apart == 0 {
            Origin::Common(first)
        } else {
            let mut origins = [Rows::of(0.0); 3];
            fill(&mut origins, rays, |ray| ray.origin.coords);
            Origin::Each(origins)
        };
    }

    /// Directions in f32.
    #[inline(always)]
    pub(super) fn narrow<S: Simd>(&self, simd: S, narrow: &mut Vectors<f32, R>) {
        for (wide, narrow) in self.direction.iter().zip(narrow) {
            for (wide, narrow) in wide.0.iter().zip(&mut narrow.0) {
                let [low, high] = halves(simd, wide);
                low.narrow(high).store_slice(narrow);
            }
        }
    }

    /// The start of the first ray in f32.
    #[inline(always)]
    pub(super) fn start(&self) -> [f32; 3] {
        let first = match &self.origin {
            Origin::Common(point) => [point.x, point.y, point.z],
            Origin::Each([x, y, z]) => [x.0[0][0], y.0[0][0], z.0[0][0]],
        };
        [rounded(first[0]), rounded(first[1]), rounded(first[2])]
    }

    /// Starts of a half of a row (the first or the second).
    #[inline(always)]
    pub(super) fn starts<S: Simd>(&self, simd: S, row: usize, second: usize) -> [f64x8<S>; 3] {
        match &self.origin {
            Origin::Common(point) => [
                f64x8::splat(simd, point.x),
                f64x8::splat(simd, point.y),
                f64x8::splat(simd, point.z),
            ],
            Origin::Each(origins) => half(simd, origins, row, second),
        }
    }
}

/// Puts vectors of rays in rows, and what is left of the last with that of the first ray.
#[inline(always)]
fn fill<const R: usize>(rows: &mut Vectors<f64, R>, rays: &[Ray], of: impl Fn(&Ray) -> Vector3<f64>) {
    for (row, some) in rays.chunks(LANES).enumerate() {
        for (lane, ray) in some.iter().enumerate() {
            let vector = of(ray);
            for k in 0..3 {
                rows[k].0[row][lane] = vector[k];
            }
        }
    }
    for ray in rays.len()..R * LANES {
        for row in &mut *rows {
            row.set(ray, row.get(0));
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
    of: &Vectors<f64, R>,
    row: usize,
    second: usize,
) -> [f64x8<S>; 3] {
    let from = second * HALF;
    [
        f64x8::from_slice(simd, &of[0].0[row][from..from + HALF]),
        f64x8::from_slice(simd, &of[1].0[row][from..from + HALF]),
        f64x8::from_slice(simd, &of[2].0[row][from..from + HALF]),
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
