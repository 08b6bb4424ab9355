//! One ray through the index over triangles: eight boxes or eight triangles at a time.
//!
//! The errors are those of [`beam`](super::beam), with the ray's own start as the reference.

use super::FARTHEST;
use super::build::{downwards, rounded, upwards};
use super::bundle::around;
use super::exact::Judge;
use super::lanes::{cross, dot, inlined, less, size};
use super::triangles::Met;
use super::wide::{Leaf, Node, ROUNDING, WIDTH, Walk, Wide};
use crate::footprint::Ray;
use fearless_simd::f32x8;
use fearless_simd::{Simd, prelude::*};

/// The ray in f32.
struct Line {
    start: [f32; 3],
    direction: [f32; 3],
    /// By axis, whether the ray comes to a box's low side (0) or high side (1) first.
    entry: [usize; 3],
    inverse: [f32; 3],
    /// The start, moved so that boxes are left late and entered early.
    late: [f32; 3],
    early: [f32; 3],
    /// Error of a corner's coordinate seen from the start.
    eta: f32,
}

/// What the ray has met so far.
struct Nearest {
    low: f32,
    high: f32,
    triangle: Option<u32>,
    /// In f64, if known.
    way: Option<f64>,
}

/// What eight triangles are to the ray.
struct Outcome {
    low: [f32; WIDTH],
    high: [f32; WIDTH],
    /// Lanes that the ray may meet, and those that it surely meets.
    may: u32,
    surely: u32,
}

impl Line {
    fn new(ray: &Ray, reach: f32) -> Self {
        let start: [f32; 3] = std::array::from_fn(|k| rounded(ray.origin[k]));
        let direction: [f32; 3] = std::array::from_fn(|k| rounded(ray.direction[k]));
        let greatest = start.iter().fold(0.0_f32, |m, c| c.abs().max(m));
        // Its inverse stays finite, and the ray stays in the box for as long as anything is looked for.
        const LEAST: f32 = 1e-20;
        let inverse = direction.map(|d| 1.0 / if d.abs() < LEAST { LEAST.copysign(d) } else { d });
        let entry = direction.map(|d| usize::from(d.is_sign_negative()));
        let slack = 4.0 * ROUNDING * (greatest + reach);
        let moved = |sign: f32| {
            std::array::from_fn(|k| {
                start[k]
                    + if entry[k] == 0 {
                        sign * slack
                    } else {
                        -sign * slack
                    }
            })
        };
        Self {
            start,
            direction,
            entry,
            inverse,
            early: moved(1.0),
            late: moved(-1.0),
            eta: 3.0 * ROUNDING * (reach + greatest),
        }
    }

    /// Which of eight boxes the ray meets before `limit`, and where.
    #[inline(always)]
    fn boxes<S: Simd>(&self, simd: S, node: &Node, limit: f32) -> (u32, f32x8<S>) {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let side = inlined(
            #[inline(always)]
            |k: usize, far: usize| f32x8::simd_from(simd, node.bounds[k][(self.entry[k] ^ far) & 1]),
        );
        let enter = inlined(
            #[inline(always)]
            |k: usize| (side(k, 0) - splat(self.early[k])) * splat(self.inverse[k]),
        );
        let leave = inlined(
            #[inline(always)]
            |k: usize| (side(k, 1) - splat(self.late[k])) * splat(self.inverse[k]),
        );
        let near = enter(0).max(enter(1)).max(enter(2)).max(splat(0.0)) * splat(1.0 - 8.0 * ROUNDING);
        let far = leave(0).min(leave(1)).min(leave(2)) * splat(1.0 + 8.0 * ROUNDING);
        let met = near.simd_le(far.min(splat(limit)));
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        (met.to_bitmask() as u32, near)
    }

    #[inline(always)]
    fn triangles<S: Simd>(&self, simd: S, leaf: &Leaf, limit: f32) -> Outcome {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let seen = inlined(
            #[inline(always)]
            |corner: usize| {
                [
                    f32x8::simd_from(simd, leaf.corners[corner][0]) - splat(self.start[0]),
                    f32x8::simd_from(simd, leaf.corners[corner][1]) - splat(self.start[1]),
                    f32x8::simd_from(simd, leaf.corners[corner][2]) - splat(self.start[2]),
                ]
            },
        );
        let [a, b, c] = [seen(0), seen(1), seen(2)];
        let d = [
            splat(self.direction[0]),
            splat(self.direction[1]),
            splat(self.direction[2]),
        ];
        let (bc, ca, ab) = (less(&b, &c), less(&c, &a), less(&a, &b));
        let (u, v, w) = (
            dot(&d, &cross(&bc, &b)),
            dot(&d, &cross(&ca, &c)),
            dot(&d, &cross(&ab, &a)),
        );
        let long = size(&bc).max(size(&ca)).max(size(&ab));
        let far = size(&a).max(size(&b)).max(size(&c));
        let eta = splat(self.eta);
        let error = far.mul_add(splat(20.0 * ROUNDING), eta * 4.0) * eta.mul_add(splat(4.0), long);
        let (least, most) = (u.min(v).min(w), u.max(v).max(w));
        let may = least.simd_ge(-error) | most.simd_le(error);
        let mut outcome = Outcome {
            low: [0.0; WIDTH],
            high: [0.0; WIDTH],
            may: 0,
            surely: 0,
        };
        if may.to_bitmask() == 0 {
            return outcome;
        }
        let inside = least.simd_gt(error) | most.simd_lt(-error);
        let normal = cross(&ca, &ab);
        let cube = long * long * long;
        let error = far.mul_add(splat(16.0 * ROUNDING), eta * 4.0);
        let error = error.mul_add(size(&normal), cube * splat(16.0 * ROUNDING)) * 2.0;
        let least = long * long.mul_add(splat(16.0 * ROUNDING), eta * 8.0) * 2.0;
        let closing = dot(&normal, &d);
        let inverse = splat(1.0) / closing;
        let way = dot(&normal, &a) * inverse;
        let error = error * inverse.abs();
        let (low, high) = (way - error, way + error);
        let sure = closing.abs().simd_gt(least);
        let aside = sure & (low.simd_gt(splat(limit)) | high.simd_lt(splat(0.0)));
        low.store_slice(&mut outcome.low);
        high.store_slice(&mut outcome.high);
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        {
            outcome.may = (may.to_bitmask() & !aside.to_bitmask()) as u32;
            outcome.surely = (inside & sure & low.simd_gt(splat(0.0))).to_bitmask() as u32;
        }
        outcome
    }
}

impl Nearest {
    fn way(&mut self, judge: &Judge<'_>) -> f64 {
        let Some(triangle) = self.triangle else {
            return FARTHEST;
        };
        *self.way.get_or_insert_with(|| judge.way(0, triangle))
    }

    /// Decides in f64 about a triangle that the ray may meet.
    #[inline(never)]
    fn decide(&mut self, judge: &Judge<'_>, triangle: u32) {
        let Some(way) = judge.meet(0, triangle) else {
            return;
        };
        let present = self.way(judge);
        if way < present || (way == present && self.triangle.is_some_and(|t| triangle < t)) {
            self.triangle = Some(triangle);
            self.way = Some(way);
            (self.low, self.high) = around(way);
        }
    }
}

/// Follows a ray through the index.
#[inline(always)]
pub(super) fn follow<S: Simd>(simd: S, wide: &Wide, ray: &Ray, judge: &Judge<'_>) -> Option<Met> {
    let line = Line::new(ray, wide.reach);
    let mut nearest = Nearest {
        low: downwards(FARTHEST),
        high: upwards(FARTHEST),
        triangle: None,
        way: None,
    };
    let mut walk = Walk::new();
    while let Some(child) = walk.next(nearest.high) {
        if child.is_leaf() {
            let leaf = &wide.leaves[child.number()];
            let outcome = line.triangles(simd, leaf, nearest.high);
            let mut may = outcome.may & ((1 << child.count()) - 1);
            while may != 0 {
                let lane = may.trailing_zeros() as usize & 7;
                may &= may - 1;
                let (low, high) = (outcome.low[lane], outcome.high[lane]);
                let surely = outcome.surely >> lane & 1 == 1;
                if surely && high < nearest.low {
                    nearest = Nearest {
                        low,
                        high,
                        triangle: Some(leaf.triangles[lane]),
                        way: None,
                    };
                } else if !(surely && low > nearest.high) {
                    nearest.decide(judge, leaf.triangles[lane]);
                }
            }
        } else {
            let node = &wide.nodes[child.number()];
            let (met, near) = line.boxes(simd, node, nearest.high);
            walk.push(node, met, near);
        }
    }
    let distance = nearest.way(judge);
    Some(Met {
        triangle: nearest.triangle?,
        distance,
    })
}
