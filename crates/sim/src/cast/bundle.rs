//! A bundle of rays in lanes of f32, and the pyramid around it.

use super::build::{downwards, upwards};
use super::lanes::{cross, size};
use super::pyramid::{Pyramid, Start};
use super::rows::{FOUR_ROWS, HALF, LANES, MOST, Origin, ROWS, Rays, Rows, TWO_ROWS, Vectors, halves, whole};
use crate::footprint::Ray;
use fearless_simd::{Simd, f32x16, f64x8, prelude::*};

/// Greatest offset of a start, as a part of how far all things reach.
const TOGETHER: f32 = 0.02;

/// A bundle.
pub(super) struct Bundle<const R: usize> {
    pub(super) rays: Rays<R>,
    pub(super) start: Start,
    pub(super) direction: Vectors<f32, R>,
    /// `None` if all rays start at one point.
    pub(super) apart: Option<Apart<R>>,
    pub(super) pyramid: Pyramid,
}

/// How rays start apart from each other.
pub(super) struct Apart<const R: usize> {
    /// Starts relative to the reference.
    pub(super) offset: Vectors<f32, R>,
    /// Direction × offset.
    pub(super) moment: Vectors<f32, R>,
    /// Not less than the greatest sum of an offset's coordinates.
    spread: f32,
}

impl<const R: usize> Bundle<R> {
    pub(super) fn blank() -> Self {
        Self {
            rays: Rays::blank(),
            start: Start::default(),
            direction: [Rows::of(0.0); 3],
            apart: None,
            pyramid: Pyramid::blank(),
        }
    }

    /// Takes rays among things whose coordinates reach so far; whether they are a narrow cone.
    #[inline(always)]
    pub(super) fn fill<S: Simd>(&mut self, simd: S, rays: &[Ray], reach: f32) -> bool {
        self.rays.fill(rays);
        self.rays.narrow(simd, &mut self.direction);
        let reference = self.rays.start();
        self.start = Start {
            reference,
            reach: reference[0].abs().max(reference[1].abs()).max(reference[2].abs()),
            spread: 0.0,
        };
        self.apart = match &self.rays.origin {
            Origin::Common(_) => None,
            Origin::Each(origins) => Some(Apart::new(simd, origins, &self.direction, reference)),
        };
        if let Some(apart) = &self.apart {
            self.start.spread = apart.spread;
            if apart.spread > TOGETHER * reach {
                return false;
            }
        }
        self.pyramid.surround(simd, &self.direction, &self.start, reach)
    }
}

impl<const R: usize> Apart<R> {
    #[inline(always)]
    fn new<S: Simd>(
        simd: S,
        origins: &Vectors<f64, R>,
        direction: &Vectors<f32, R>,
        reference: [f32; 3],
    ) -> Self {
        let mut apart = Self {
            offset: [Rows::of(0.0); 3],
            moment: [Rows::of(0.0); 3],
            spread: 0.0,
        };
        let mut most = f32x16::splat(simd, 0.0);
        for row in 0..R {
            for k in 0..3 {
                let from = f64x8::splat(simd, reference[k].into());
                let [low, high] = halves(simd, &origins[k].0[row]);
                (low - from)
                    .narrow(high - from)
                    .store_slice(&mut apart.offset[k].0[row]);
            }
            let (d, o) = (whole(simd, direction, row), whole(simd, &apart.offset, row));
            most = most.max(size(&o));
            let moment = cross(&d, &o);
            for (moment, rows) in moment.iter().zip(&mut apart.moment) {
                moment.store_slice(&mut rows.0[row]);
            }
        }
        apart.spread = 1.001 * most.reduce_max();
        apart
    }
}

/// What rays can be cast into, each by itself or as a bundle of so many rows.
pub(super) trait Caster<T> {
    /// What each of some rays meets.
    fn cast_each(&self, rays: &[Ray], found: &mut [T]);

    /// Whether rays are a narrow cone; then also what each of them meets.
    fn cast_rows<const R: usize>(&self, rays: &[Ray], found: &mut [T]) -> bool;
}

/// What each of some rays meets, as many at a time as fit in a bundle.
pub(super) fn cast_all<T>(caster: &impl Caster<T>, rays: &[Ray], found: &mut [T]) {
    assert_eq!(rays.len(), found.len(), "every ray has its place");
    for (rays, found) in rays.chunks(MOST).zip(found.chunks_mut(MOST)) {
        cast_some(caster, rays, found);
    }
}

/// What is no narrow cone may be two, unless it is few rays.
fn cast_some<T>(caster: &impl Caster<T>, rays: &[Ray], found: &mut [T]) {
    let narrow = match rays {
        [] | [_] => false,
        _ if rays.len() <= LANES => caster.cast_rows::<1>(rays, found),
        _ if rays.len() <= TWO_ROWS => caster.cast_rows::<2>(rays, found),
        _ if rays.len() <= FOUR_ROWS => caster.cast_rows::<4>(rays, found),
        _ => caster.cast_rows::<ROWS>(rays, found),
    };
    if narrow {
        return;
    }
    if rays.len() <= HALF {
        caster.cast_each(rays, found);
    } else {
        let middle = rays.len() / 2;
        let (first, second) = found.split_at_mut(middle);
        cast_some(caster, &rays[..middle], first);
        cast_some(caster, &rays[middle..], second);
    }
}

/// An interval of f32 around a number of f64.
pub(super) fn around(x: f64) -> (f32, f32) {
    (downwards(x), upwards(x))
}
