//! Ways of a bundle's rays to the triangles that they are known to meet, in f64: rays of one triangle by its plane, rays that
//! have one to themselves eight at a time.

use crate::hit::NONE;
use crate::lanes::inlined;
use crate::mesh::exact::{Judge, Plane};
use crate::mesh::pending::{Pending, Settled};
use crate::packet::in_rows::InRows;
use crate::packet::rows::{HALF, LANES, Rows, half};
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f64x8, mask32x16, mask64x8, u32x16};

/// What sixteen rays in a row meet.
pub(crate) struct MetInRow<'a> {
    pub(crate) row: usize,
    /// A bit for every ray that meets anything; the others have any numbers.
    pub(crate) some: u64,
    pub(crate) triangle: &'a [u32; LANES],
    pub(crate) distance: &'a [f64; LANES],
    /// Product of the ray's direction with the triangle's normal, if it was asked for.
    pub(crate) closing: &'a [f64; LANES],
}

/// Where the normal counts too, fewer rays of a row with the same triangle are looked at each by itself.
const FEW: u32 = 5;

/// What is known so far.
struct Ways<'a, const R: usize> {
    rays: &'a InRows<'a, R>,
    judge: &'a Judge<'a>,
    distance: Rows<f64, R>,
    closing: Rows<f64, R>,
    pending: Pending,
    /// As many as there are rows, each in the place that its number gives it.
    kept: [Kept; R],
}

/// A triangle that was looked at: neighboring rows have some in common.
#[derive(Clone, Copy)]
struct Kept {
    triangle: u32,
    plane: Plane,
    /// One over the length of the plane's normal, if it was asked for.
    inverse: f64,
    /// Height of the plane over where all rays start, if they do.
    height: f64,
}

/// Tells, row by row, how far rays go to these triangles, and under which incidence if that is asked for.
#[inline(always)]
pub(crate) fn finish<S: Simd, const R: usize, const CLOSING: bool>(
    simd: S,
    found: &[[u32; LANES]; R],
    rays: &InRows<'_, R>,
    judge: &Judge<'_>,
    mut tell: impl FnMut(&MetInRow<'_>),
) {
    let none = Kept {
        triangle: NONE,
        plane: Plane::default(),
        inverse: 0.0,
        height: 0.0,
    };
    let mut ways = Ways {
        rays,
        judge,
        distance: Rows::of(0.0),
        closing: Rows::of(0.0),
        pending: Pending::default(),
        kept: [none; R],
    };
    let mut somes = [0; R];
    let rows = rays.count.div_ceil(LANES);
    for (row, (numbers, some)) in found.iter().zip(&mut somes).enumerate().take(rows) {
        let triangles = u32x16::simd_from(simd, *numbers);
        *some = !triangles.simd_eq(u32x16::splat(simd, NONE)).to_bitmask();
        *some &= (1 << LANES.min(rays.count - row * LANES)) - 1;
        // Rays of the same triangle, one triangle after the other.
        let mut open = *some;
        while open != 0 {
            let triangle = numbers[open.trailing_zeros() as usize & (LANES - 1)];
            let alike = triangles.simd_eq(u32x16::splat(simd, triangle));
            let lanes = alike.to_bitmask() & open;
            open &= !lanes;
            if CLOSING && lanes.count_ones() < FEW {
                ways.postpone(simd, row, lanes, triangle);
            } else {
                ways.meet::<S, CLOSING>(simd, row, alike, lanes, triangle);
            }
        }
    }
    if CLOSING {
        ways.settle(simd);
    }
    for (row, triangle) in found.iter().enumerate().take(rows) {
        tell(&MetInRow {
            row,
            some: somes[row],
            triangle,
            distance: &ways.distance.0[row],
            closing: &ways.closing.0[row],
        });
    }
}

impl<const R: usize> Ways<'_, R> {
    /// Leaves some rays of a row with one triangle for later.
    #[inline(always)]
    fn postpone<S: Simd>(&mut self, simd: S, row: usize, mut lanes: u64, triangle: u32) {
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            if self.pending.add(row * LANES + lane, triangle) {
                self.settle(simd);
            }
        }
    }

    #[inline(always)]
    fn settle<S: Simd>(&mut self, simd: S) {
        let (rays, distance, closing) = (self.rays, &mut self.distance, &mut self.closing);
        let ray = inlined(
            #[inline(always)]
            |ray: usize| rays.get(ray),
        );
        let tell = inlined(
            #[inline(always)]
            |settled: Settled| {
                distance.set(settled.ray, settled.way);
                closing.set(settled.ray, settled.closing);
            },
        );
        self.pending.settle::<S, true>(simd, self.judge, &ray, tell);
    }

    /// Finds the ways of some rays of a row to one triangle.
    #[inline(always)]
    fn meet<S: Simd, const CLOSING: bool>(
        &mut self,
        simd: S,
        row: usize,
        alike: mask32x16<S>,
        lanes: u64,
        triangle: u32,
    ) {
        let (rays, judge) = (self.rays, self.judge);
        let kept = &mut self.kept[triangle as usize % R];
        if triangle != kept.triangle {
            kept.triangle = triangle;
            kept.plane = judge.plane(triangle);
            if CLOSING {
                kept.inverse = kept.plane.inverse();
            }
            if let Some(start) = &rays.common {
                kept.height = kept.plane.height(start);
            }
        }
        let mut unsure = lanes;
        let (low, high) = alike.widen();
        for (second, alike) in [low, high].into_iter().enumerate() {
            let height = match &rays.common {
                Some(_) => f64x8::splat(simd, kept.height),
                None => kept.plane.heights(simd, &half(simd, &rays.origin, row, second)),
            };
            let direction = half(simd, &rays.direction, row, second);
            let (way, closing, steep) = kept.plane.ways(simd, height, &direction);
            put(simd, alike, way, &mut self.distance.0[row], second);
            if CLOSING {
                let closing = closing * f64x8::splat(simd, kept.inverse);
                put(simd, alike, closing, &mut self.closing.0[row], second);
            }
            unsure &= !((steep & alike).to_bitmask() << (second * HALF));
        }
        while unsure != 0 {
            let number = row * LANES + unsure.trailing_zeros() as usize;
            unsure &= unsure - 1;
            let ray = rays.get(number);
            self.distance.set(number, judge.way(&ray, triangle));
            if CLOSING {
                self.closing.set(number, judge.closing(triangle, &ray));
            }
        }
    }
}

/// Puts numbers in a half of a row where they count.
#[inline(always)]
fn put<S: Simd>(simd: S, which: mask64x8<S>, numbers: f64x8<S>, row: &mut [f64; LANES], second: usize) {
    let place = &mut row[second * HALF..(second + 1) * HALF];
    let present = f64x8::from_slice(simd, place);
    which.select(numbers, present).store_slice(place);
}
