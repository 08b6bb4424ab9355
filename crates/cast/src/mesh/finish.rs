//! Exact (f64) hit distances for a packet once the f32 pass has fixed each ray's triangle: rays that share a triangle are
//! computed together from its plane, the others eight at a time.

use crate::hit::NONE;
use crate::lanes::inlined;
use crate::mesh::exact::{Judge, Plane};
use crate::mesh::pending::{Pending, Settled};
use crate::packet::in_rows::InRows;
use crate::packet::rows::{HALF, LANES, Rows, half};
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f64x8, mask32x16, mask64x8, u32x16};

/// Hits of one row of sixteen rays.
pub(crate) struct RowHits<'a> {
    pub(crate) row: usize,
    /// One bit per ray, set for a hit; the numbers of the other rays are undefined.
    pub(crate) some: u64,
    pub(crate) triangle: &'a [u32; LANES],
    pub(crate) distance: &'a [f64; LANES],
    /// Dot product of the ray's direction and the triangle's normal, if requested.
    pub(crate) closing: &'a [f64; LANES],
}

/// If the incidence is requested, rays of a row that share a triangle are computed individually below this count.
const FEW: u32 = 5;

/// State of the computation.
struct Distances<'a, const R: usize> {
    rays: &'a InRows<'a, R>,
    judge: &'a Judge<'a>,
    distance: Rows<f64, R>,
    closing: Rows<f64, R>,
    pending: Pending,
    /// A direct-mapped cache of recent triangles, indexed by triangle modulo `R`.
    kept: [Kept; R],
}

/// A cached triangle: neighboring rows often share some.
#[derive(Clone, Copy)]
struct Kept {
    triangle: u32,
    plane: Plane,
    /// 1/|N|, if the incidence is requested.
    inverse: f64,
    /// Height of the plane above the common origin, if there is one.
    height: f64,
}

/// Emits, row by row, the distances of the rays to the triangles found, with the incidence if `CLOSING`.
#[inline(always)]
pub(crate) fn finish<S: Simd, const R: usize, const CLOSING: bool>(
    simd: S,
    found: &[[u32; LANES]; R],
    rays: &InRows<'_, R>,
    judge: &Judge<'_>,
    mut emit: impl FnMut(&RowHits<'_>),
) {
    let none = Kept {
        triangle: NONE,
        plane: Plane::default(),
        inverse: 0.0,
        height: 0.0,
    };
    let mut state = Distances {
        rays,
        judge,
        distance: Rows::of(0.0),
        closing: Rows::of(0.0),
        pending: Pending::default(),
        kept: [none; R],
    };
    let mut parts = [0; R];
    let rows = rays.count.div_ceil(LANES);
    for (row, (numbers, some)) in found.iter().zip(&mut parts).enumerate().take(rows) {
        let triangles = u32x16::simd_from(simd, *numbers);
        *some = !triangles.simd_eq(u32x16::splat(simd, NONE)).to_bitmask();
        *some &= (1 << LANES.min(rays.count - row * LANES)) - 1;
        // One triangle at a time, with all rays that hit it.
        let mut open = *some;
        while open != 0 {
            let triangle = numbers[open.trailing_zeros() as usize & (LANES - 1)];
            let same = triangles.simd_eq(u32x16::splat(simd, triangle));
            let lanes = same.to_bitmask() & open;
            open &= !lanes;
            if CLOSING && lanes.count_ones() < FEW {
                state.postpone(simd, row, lanes, triangle);
            } else {
                state.meet::<S, CLOSING>(simd, row, same, lanes, triangle);
            }
        }
    }
    if CLOSING {
        state.settle(simd);
    }
    for (row, triangle) in found.iter().enumerate().take(rows) {
        emit(&RowHits {
            row,
            some: parts[row],
            triangle,
            distance: &state.distance.0[row],
            closing: &state.closing.0[row],
        });
    }
}

impl<const R: usize> Distances<'_, R> {
    /// Defers the rays in `lanes` to the individual computation.
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
        let emit = inlined(
            #[inline(always)]
            |settled: Settled| {
                distance.set(settled.ray, settled.distance);
                closing.set(settled.ray, settled.closing);
            },
        );
        self.pending.settle::<S, true>(simd, self.judge, &ray, emit);
    }

    /// Computes the distances of the rays in `lanes` to one triangle.
    #[inline(always)]
    fn meet<S: Simd, const CLOSING: bool>(
        &mut self,
        simd: S,
        row: usize,
        same: mask32x16<S>,
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
        let (low, high) = same.widen();
        for (second, same) in [low, high].into_iter().enumerate() {
            let height = match &rays.common {
                Some(_) => f64x8::splat(simd, kept.height),
                None => kept.plane.heights(simd, &half(simd, &rays.origin, row, second)),
            };
            let direction = half(simd, &rays.direction, row, second);
            let (distance, closing, steep) = kept.plane.distances(simd, height, &direction);
            put(simd, same, distance, &mut self.distance.0[row], second);
            if CLOSING {
                let closing = closing * f64x8::splat(simd, kept.inverse);
                put(simd, same, closing, &mut self.closing.0[row], second);
            }
            unsure &= !((steep & same).to_bitmask() << (second * HALF));
        }
        while unsure != 0 {
            let number = row * LANES + unsure.trailing_zeros() as usize;
            unsure &= unsure - 1;
            let ray = rays.get(number);
            self.distance.set(number, judge.distance(&ray, triangle));
            if CLOSING {
                self.closing.set(number, judge.closing(triangle, &ray));
            }
        }
    }
}

/// Stores the selected numbers in one half of a row.
#[inline(always)]
fn put<S: Simd>(simd: S, which: mask64x8<S>, numbers: f64x8<S>, row: &mut [f64; LANES], second: usize) {
    let place = &mut row[second * HALF..(second + 1) * HALF];
    let present = f64x8::from_slice(simd, place);
    which.select(numbers, present).store_slice(place);
}
