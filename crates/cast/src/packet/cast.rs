//! Ray packets: directions and origins in f32 lanes, with the pyramid that encloses them. Rays that do not form a narrow
//! cone are split into smaller packets, or cast individually.

use crate::lanes::{cross, size};
use crate::packet::in_rows::InRows;
use crate::packet::pyramid::{Pyramid, Start};
use crate::packet::rays::Rays;
use crate::packet::rows::{FOUR_ROWS, HALF, LANES, MOST, ROWS, Rows, TWO_ROWS, Vectors, halves, whole};
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};
use std::ops::Range;

/// Maximum offset of an origin from the reference, as a fraction of the scene's reach.
const TOGETHER: f32 = 0.02;

/// Rays cast together, in `R` rows of lanes.
pub(crate) struct Packet<'a, const R: usize> {
    pub(crate) rays: InRows<'a, R>,
    pub(crate) start: Start,
    pub(crate) direction: Vectors<f32, R>,
    /// Origins relative to the reference, if the rays do not share one origin.
    pub(crate) offset: Vectors<f32, R>,
    /// direction × offset, under the same condition.
    pub(crate) moment: Vectors<f32, R>,
    pub(crate) pyramid: Pyramid,
}

impl<'a, const R: usize> Packet<'a, R> {
    pub(crate) fn new(rays: &'a Rays, which: Range<usize>) -> Self {
        Self {
            rays: InRows::of(rays, which),
            start: Start::default(),
            direction: [Rows::of(0.0); 3],
            offset: [Rows::of(0.0); 3],
            moment: [Rows::of(0.0); 3],
            pyramid: Pyramid::blank(),
        }
    }

    /// Whether the rays have different origins.
    #[inline(always)]
    pub(crate) fn apart(&self) -> bool {
        self.rays.common.is_none()
    }

    /// Computes the f32 rows and the pyramid for geometry whose coordinates do not exceed `reach`. Returns whether the rays
    /// form a narrow cone.
    #[inline(always)]
    pub(crate) fn surround<S: Simd>(&mut self, simd: S, reach: f32) -> bool {
        self.rays.narrow(simd, &mut self.direction);
        let reference = self.rays.start();
        self.start = Start {
            reference,
            reach: reference[0].abs().max(reference[1].abs()).max(reference[2].abs()),
            spread: 0.0,
        };
        if self.apart() {
            self.start.spread = self.part(simd);
            if self.start.spread > TOGETHER * reach {
                return false;
            }
        }
        self.pyramid.surround(simd, &self.direction, &self.start, reach)
    }

    /// Computes the offsets from the reference and the moments. Returns an upper bound on the offsets' L1 norm.
    #[inline(always)]
    fn part<S: Simd>(&mut self, simd: S) -> f32 {
        for k in 0..3 {
            let from = f64x8::splat(simd, self.start.reference[k].into());
            for row in 0..R {
                let [low, high] = halves(simd, &self.rays.origin[k][row]);
                (low - from)
                    .narrow(high - from)
                    .store_slice(&mut self.offset[k].0[row]);
            }
            self.offset[k].fill_up(self.rays.count);
        }
        let mut most = f32x16::splat(simd, 0.0);
        for row in 0..R {
            let (d, o) = (whole(simd, &self.direction, row), whole(simd, &self.offset, row));
            most = most.max(size(&o));
            let moment = cross(&d, &o);
            for (moment, rows) in moment.iter().zip(&mut self.moment) {
                moment.store_slice(&mut rows.0[row]);
            }
        }
        1.001 * most.reduce_max()
    }
}

/// Geometry that rays can be cast into, individually or as packets of `R` rows.
pub(crate) trait Caster<T> {
    /// Finds the hit of each ray individually.
    fn cast_each(&self, rays: &Rays, which: Range<usize>, found: &mut [T]);

    /// Returns whether the rays form a narrow cone; if they do, also finds the hit of each.
    fn cast_rows<const R: usize>(&self, rays: &Rays, which: Range<usize>, found: &mut [T]) -> bool;
}

/// Finds the hit of each ray, one full packet at a time.
pub(crate) fn cast_all<T>(caster: &impl Caster<T>, rays: &Rays, found: &mut [T]) {
    assert_eq!(rays.len(), found.len(), "one result slot per ray");
    for (number, found) in found.chunks_mut(MOST).enumerate() {
        let first = number * MOST;
        cast_some(caster, rays, first..first + found.len(), found);
    }
}

/// Casts one packet. If the rays do not form a narrow cone, each half is tried again; few rays are cast individually.
fn cast_some<T>(caster: &impl Caster<T>, rays: &Rays, which: Range<usize>, found: &mut [T]) {
    let all = which.clone();
    let narrow = match which.len() {
        0 | 1 => false,
        count if count <= LANES => caster.cast_rows::<1>(rays, all, found),
        count if count <= TWO_ROWS => caster.cast_rows::<2>(rays, all, found),
        count if count <= FOUR_ROWS => caster.cast_rows::<4>(rays, all, found),
        _ => caster.cast_rows::<ROWS>(rays, all, found),
    };
    if narrow {
        return;
    }
    if which.len() <= HALF {
        caster.cast_each(rays, which, found);
    } else {
        let middle = which.len() / 2;
        let (first, second) = found.split_at_mut(middle);
        let middle = which.start + middle;
        cast_some(caster, rays, which.start..middle, first);
        cast_some(caster, rays, middle..which.end, second);
    }
}
