//! Rays through the index over triangles, each by itself. The ways to what they met are found in f64 eight at a time.

use super::FARTHEST;
use super::bundle::around;
use super::exact::Judge;
use super::single::{Line, Outcome};
use super::triangles::Met;
use super::wide::{Leaf, WIDTH, Walk, Wide};
use fearless_simd::Simd;

/// What a ray has met so far.
struct Nearest {
    low: f32,
    high: f32,
    triangle: Option<u32>,
    /// In f64, if known.
    way: Option<f64>,
}

/// Rays whose triangle is known, but not the way to it.
#[derive(Default)]
struct Pending {
    count: usize,
    /// Each ray and its triangle.
    found: [(usize, u32); WIDTH],
}

impl Nearest {
    fn nothing() -> Self {
        let (low, high) = around(FARTHEST);
        Self {
            low,
            high,
            triangle: None,
            way: None,
        }
    }

    /// Decides in f64 about a triangle that the ray may meet.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, judge: &Judge<'_>, ray: usize, triangle: u32) {
        let Some(way) = judge.meet(ray, triangle) else {
            return;
        };
        let present = match self.triangle {
            None => FARTHEST,
            Some(triangle) => *self.way.get_or_insert_with(|| judge.way(ray, triangle)),
        };
        if way < present || (way == present && self.triangle.is_some_and(|t| triangle < t)) {
            self.triangle = Some(triangle);
            self.way = Some(way);
            (self.low, self.high) = around(way);
        }
    }

    /// Takes what the ray meets of a leaf.
    #[inline(always)]
    fn take(&mut self, leaf: &Leaf, outcome: &Outcome, judge: &Judge<'_>, ray: usize) {
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
                    way: None,
                };
            } else if !(surely && low > self.high) {
                self.decide(judge, ray, leaf.triangles[lane]);
            }
        }
    }
}

impl Pending {
    /// Takes one more; whether that is all there is room for.
    #[inline(always)]
    fn add(&mut self, ray: usize, triangle: u32) -> bool {
        self.found[self.count] = (ray, triangle);
        self.count += 1;
        self.count == WIDTH
    }

    /// Finds the ways and tells them.
    #[inline(always)]
    fn tell<S: Simd>(&mut self, simd: S, judge: &Judge<'_>, tell: &mut impl FnMut(usize, Option<Met>)) {
        let found = &self.found[..self.count];
        let mut ways = [0.0; WIDTH];
        if self.count == WIDTH {
            ways = judge.ways(simd, &self.found);
        } else {
            for (way, &(ray, triangle)) in ways.iter_mut().zip(found) {
                *way = judge.way(ray, triangle);
            }
        }
        for (&(ray, triangle), &distance) in found.iter().zip(&ways) {
            tell(ray, Some(Met { triangle, distance }));
        }
        self.count = 0;
    }
}

/// Follows rays through the index and tells what each meets, in no order.
#[inline(always)]
pub(super) fn follow<S: Simd>(
    simd: S,
    wide: &Wide,
    judge: &Judge<'_>,
    mut tell: impl FnMut(usize, Option<Met>),
) {
    let mut walk = Walk::new();
    let mut outcome = Outcome::default();
    let mut pending = Pending::default();
    for (number, ray) in judge.rays.iter().enumerate() {
        let line = Line::new(ray, wide.reach);
        let mut nearest = Nearest::nothing();
        let mut next = Some(walk.start());
        while let Some(child) = next {
            let mut nearer = None;
            if child.is_leaf() {
                let leaf = &wide.leaves[child.number()];
                line.triangles(simd, leaf, child.count(), nearest.high, &mut outcome);
                nearest.take(leaf, &outcome, judge, number);
            } else {
                let node = &wide.nodes[child.number()];
                let (met, near) = line.boxes(simd, node, nearest.high);
                nearer = walk.enter(node, met, near);
            }
            next = nearer.or_else(|| walk.next(nearest.high));
        }
        match (nearest.triangle, nearest.way) {
            (None, _) => tell(number, None),
            (Some(triangle), Some(distance)) => tell(number, Some(Met { triangle, distance })),
            (Some(triangle), None) => {
                if pending.add(number, triangle) {
                    pending.tell(simd, judge, &mut tell);
                }
            }
        }
    }
    pending.tell(simd, judge, &mut tell);
}
