//! A range of rays, viewed in rows of lanes in f64.

use crate::packet::rays::Rays;
use crate::packet::rows::{F64Rows, LANES, Vectors, half, halves};
use crate::ray::Ray;
use crate::rounding::rounded;
use fearless_simd::{Simd, f64x8, prelude::*};
use nalgebra::{Point3, Unit, Vector3};
use std::ops::Range;

/// Rays in f64. The lanes after the last ray are padding, never read as data.
pub(crate) struct InRows<'a, const R: usize> {
    pub(crate) count: usize,
    pub(crate) direction: F64Rows<'a, R>,
    pub(crate) origin: F64Rows<'a, R>,
    /// The common origin, if all origins are bit-identical.
    pub(crate) common: Option<Point3<f64>>,
}

impl<'a, const R: usize> InRows<'a, R> {
    /// The given rays: at least one, and at most `R` rows.
    #[inline(always)]
    pub(crate) fn of(rays: &'a Rays, which: Range<usize>) -> Self {
        let count = which.len();
        assert!((1..=R * LANES).contains(&count), "the rays fit in the rows");
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

    /// Returns one ray.
    pub(crate) fn get(&self, ray: usize) -> Ray {
        let of = |[x, y, z]: &F64Rows<'_, R>| {
            let at = |row: &[[f64; LANES]; R]| row[ray / LANES][ray % LANES];
            Vector3::new(at(x), at(y), at(z))
        };
        Ray {
            origin: Point3::from(of(&self.origin)),
            // Stored with unit length; renormalizing could change the last bit.
            direction: Unit::new_unchecked(of(&self.direction)),
        }
    }

    /// Writes the directions in f32; the padding of the last row is copies of the first ray.
    #[inline(always)]
    pub(crate) fn narrow<S: Simd>(&self, simd: S, narrow: &mut Vectors<f32, R>) {
        for (wide, narrow) in self.direction.iter().zip(narrow) {
            for (wide, narrow) in wide.iter().zip(&mut narrow.0) {
                let [low, high] = halves(simd, wide);
                low.narrow(high).store_slice(narrow);
            }
            narrow.fill_up(self.count);
        }
    }

    /// Returns the origin of the first ray in f32.
    #[inline(always)]
    pub(crate) fn start(&self) -> [f32; 3] {
        let [x, y, z] = self.origin;
        [rounded(x[0][0]), rounded(y[0][0]), rounded(z[0][0])]
    }

    /// Returns the origins of one half of a row (0 or 1).
    #[inline(always)]
    pub(crate) fn starts<S: Simd>(&self, simd: S, row: usize, second: usize) -> [f64x8<S>; 3] {
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
