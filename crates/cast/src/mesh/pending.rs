//! Queue of rays whose triangle is known but not the f64 distance to it: computed eight at a time, each ray with its own
//! triangle.

use crate::lanes::{inlined, minus, size, unfused};
use crate::mesh::exact::{Judge, STEEP};
use crate::ray::Ray;
use fearless_simd::{Simd, f64x8, prelude::*};

const LANES: usize = 8;

/// Rays whose triangle is known, but not the distance to it.
#[derive(Default)]
pub(crate) struct Pending {
    count: usize,
    /// Each ray and its triangle.
    found: [(usize, u32); LANES],
}

/// The computed hit of a ray on its triangle.
pub(crate) struct Settled {
    pub(crate) ray: usize,
    pub(crate) triangle: u32,
    /// Bit-identical to [`Judge::distance`].
    pub(crate) distance: f64,
    /// [`Judge::closing`], if requested.
    pub(crate) closing: f64,
}

impl Pending {
    /// Adds a ray. Returns whether the queue is full and [`Pending::settle`] must be called.
    #[inline(always)]
    pub(crate) fn add(&mut self, ray: usize, triangle: u32) -> bool {
        self.found[self.count] = (ray, triangle);
        self.count += 1;
        self.count == LANES
    }

    /// Computes the distances and emits them.
    #[inline(always)]
    pub(crate) fn settle<S: Simd, const CLOSING: bool>(
        &mut self,
        simd: S,
        judge: &Judge<'_>,
        rays: &impl Fn(usize) -> Ray,
        mut emit: impl FnMut(Settled),
    ) {
        let count = std::mem::take(&mut self.count);
        if count == 0 {
            return;
        }
        for lane in count..LANES {
            self.found[lane] = self.found[0];
        }
        let [mut a, mut b, mut c, mut origin, mut direction] = [[[0.0; LANES]; 3]; 5];
        for (lane, &(ray, triangle)) in self.found.iter().enumerate() {
            let (ray, corners) = (rays(ray), judge.corners(triangle));
            for k in 0..3 {
                a[k][lane] = corners[0][k];
                b[k][lane] = corners[1][k];
                c[k][lane] = corners[2][k];
                origin[k][lane] = ray.origin[k];
                direction[k][lane] = ray.direction[k];
            }
        }
        let load = inlined(
            #[inline(always)]
            |v: &[[f64; LANES]; 3]| {
                [
                    f64x8::simd_from(simd, v[0]),
                    f64x8::simd_from(simd, v[1]),
                    f64x8::simd_from(simd, v[2]),
                ]
            },
        );
        let (a, direction) = (load(&a), load(&direction));
        let (p, q) = (minus(&load(&b), &a), minus(&load(&c), &a));
        let long = size(&p).max(size(&q));
        let normal = unfused::cross(&p, &q);
        let closing = unfused::dot(&normal, &direction);
        let least = f64x8::splat(simd, STEEP) * long * long;
        let sure = closing.abs().simd_gt(least).to_bitmask();
        let (mut distances, mut closings) = ([0.0; LANES], [0.0; LANES]);
        (unfused::dot(&normal, &minus(&a, &load(&origin))) / closing).store_slice(&mut distances);
        if CLOSING {
            let inverse = f64x8::splat(simd, 1.0) / unfused::dot(&normal, &normal).sqrt();
            (closing * inverse).store_slice(&mut closings);
        }
        for (lane, &(number, triangle)) in self.found[..count].iter().enumerate() {
            let mut settled = Settled {
                ray: number,
                triangle,
                distance: distances[lane],
                closing: closings[lane],
            };
            if sure >> lane & 1 == 0 {
                let ray = rays(number);
                settled.distance = judge.distance(&ray, triangle);
                settled.closing = judge.closing(triangle, &ray);
            }
            emit(settled);
        }
    }
}
