//! Traversal of the triangle index by individual rays. The f64 distances to the triangles hit are computed eight at a time.

use crate::index::wide::{Leaf, WIDTH, Walk, WideBvh};
use crate::lanes::inlined;
use crate::mesh::exact::Judge;
use crate::mesh::exact::Met;
use crate::mesh::pending::{Pending, Settled};
use crate::mesh::single::{Line, Outcome};
use crate::ray::FARTHEST;
use crate::ray::Ray;
use crate::rounding::around;
use fearless_simd::Simd;

/// Nearest hit of a ray so far.
struct Nearest {
    low: f32,
    high: f32,
    triangle: Option<u32>,
    /// The distance in f64, if already computed.
    distance: Option<f64>,
}

impl Nearest {
    fn nothing() -> Self {
        let (low, high) = around(FARTHEST);
        Self {
            low,
            high,
            triangle: None,
            distance: None,
        }
    }

    /// Decides in f64 whether the ray hits a triangle, nearer than before.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, judge: &Judge<'_>, ray: &Ray, triangle: u32) {
        let Some(distance) = judge.meet(ray, triangle) else {
            return;
        };
        let present = match self.triangle {
            None => FARTHEST,
            Some(triangle) => *self.distance.get_or_insert_with(|| judge.distance(ray, triangle)),
        };
        if distance < present || (distance == present && self.triangle.is_some_and(|t| triangle < t)) {
            self.triangle = Some(triangle);
            self.distance = Some(distance);
            (self.low, self.high) = around(distance);
        }
    }

    /// Updates the nearest hit from the triangles of a leaf.
    #[inline(always)]
    fn take(&mut self, leaf: &Leaf, outcome: &Outcome, judge: &Judge<'_>, ray: &Ray) {
        let mut may = outcome.may;
        while may != 0 {
            let lane = may.trailing_zeros() as usize & (WIDTH - 1);
            may &= may - 1;
            let (low, high) = (outcome.low[lane], outcome.high[lane]);
            let surely = outcome.surely >> lane & 1 == 1;
            if surely && high < self.low {
                *self = Self {
                    low,
                    high,
                    triangle: Some(leaf.triangles[lane]),
                    distance: None,
                };
            } else if !(surely && low > self.high) {
                self.decide(judge, ray, leaf.triangles[lane]);
            }
        }
    }
}

/// Traverses the index with `count` rays and emits the nearest hit of each, in no particular order.
#[inline(always)]
pub(crate) fn follow<S: Simd, F: FnMut(usize, Option<Met>)>(
    simd: S,
    wide: &WideBvh,
    judge: &Judge<'_>,
    count: usize,
    rays: impl Fn(usize) -> Ray,
    mut emit: F,
) {
    let mut walk = Walk::new();
    let mut outcome = Outcome::default();
    let mut pending = Pending::default();
    let settle = inlined(
        #[inline(always)]
        |pending: &mut Pending, emit: &mut F| {
            let emit_settled = inlined(
                #[inline(always)]
                |found: Settled| {
                    let (triangle, distance) = (found.triangle, found.distance);
                    emit(found.ray, Some(Met { triangle, distance }));
                },
            );
            pending.settle::<_, false>(simd, judge, &rays, emit_settled);
        },
    );
    for number in 0..count {
        let ray = rays(number);
        let line = Line::new(&ray, wide.reach);
        let mut nearest = Nearest::nothing();
        let mut next = Some(walk.start());
        while let Some(child) = next {
            let mut nearer = None;
            if child.is_leaf() {
                let leaf = &wide.leaves[child.number()];
                line.triangles(simd, leaf, child.count(), nearest.high, &mut outcome);
                nearest.take(leaf, &outcome, judge, &ray);
            } else {
                let node = &wide.nodes[child.number()];
                let (met, near) = line.boxes(simd, node, nearest.high);
                nearer = walk.enter(node, met, near);
            }
            next = nearer.or_else(|| walk.next(nearest.high));
        }
        match (nearest.triangle, nearest.distance) {
            (None, _) => emit(number, None),
            (Some(triangle), Some(distance)) => emit(number, Some(Met { triangle, distance })),
            (Some(triangle), None) => {
                if pending.add(number, triangle) {
                    settle(&mut pending, &mut emit);
                }
            }
        }
    }
    settle(&mut pending, &mut emit);
}
