//! Traversal of the triangle index by individual rays. The f64 distances to the triangles hit are computed eight at a time.

use crate::index::line::Line;
use crate::index::traversal::Traversal;
use crate::index::wide::{Child, Leaf, Node, WIDTH, WideBvh};
use crate::lanes::inlined;
use crate::mesh::eight::Outcome;
use crate::mesh::exact::{Judge, TriangleHit};
use crate::mesh::pending::{Pending, Settled};
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
pub(crate) fn follow<S: Simd, F: FnMut(usize, Option<TriangleHit>)>(
    simd: S,
    wide: &WideBvh,
    judge: &Judge<'_>,
    count: usize,
    rays: impl Fn(usize) -> Ray,
    mut emit: F,
) {
    let mut traversal = Traversal::new();
    let mut outcome = Outcome::default();
    let mut pending = Pending::default();
    let settle = inlined(
        #[inline(always)]
        |pending: &mut Pending, emit: &mut F| {
            let emit_settled = inlined(
                #[inline(always)]
                |found: Settled| {
                    let (triangle, distance) = (found.triangle, found.distance);
                    emit(found.ray, Some(TriangleHit { triangle, distance }));
                },
            );
            pending.settle::<_, false>(simd, judge, &rays, emit_settled);
        },
    );
    for number in 0..count {
        let ray = rays(number);
        let line = Line::new(&ray, wide.reach);
        let mut nearest = Nearest::nothing();
        let limit = nearest.high;
        let boxes = inlined(
            #[inline(always)]
            |node: &Node, limit: f32| line.boxes(simd, node, limit),
        );
        let visit = inlined(
            #[inline(always)]
            |child: Child| {
                let leaf = &wide.leaves[child.number()];
                line.triangles(simd, leaf, child.count(), nearest.high, &mut outcome);
                nearest.take(leaf, &outcome, judge, &ray);
                nearest.high
            },
        );
        traversal.run(&wide.nodes, limit, boxes, visit);
        match (nearest.triangle, nearest.distance) {
            (None, _) => emit(number, None),
            (Some(triangle), Some(distance)) => emit(number, Some(TriangleHit { triangle, distance })),
            (Some(triangle), None) => {
                if pending.add(number, triangle) {
                    settle(&mut pending, &mut emit);
                }
            }
        }
    }
    settle(&mut pending, &mut emit);
}
