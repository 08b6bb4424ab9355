//! The pyramid that encloses a packet of rays, in f32.
//!
//! The rays of a narrow cone with nearly one origin are inside a pyramid. No ray hits anything that is outside one of its
//! sides, or outside one of the sides of its projection along a coordinate axis. All bounds are conservative.

use crate::index::wide::WIDTH;
use crate::lanes;
use crate::lanes::inlined;
use crate::packet::rows::{LANES, Vectors, whole};
use crate::rounding::ROUNDING;
use fearless_simd::{Simd, f32x4, f32x8, f32x16, prelude::*};

/// Rounding error of a slope, with a safety margin.
const SLOPE_SLACK: f32 = 2e-6;

/// Minimum cosine between the packet's axis and each of its rays: wider cones contain too much that only few rays hit.
const NARROW: f32 = 0.97;

/// Indices of the sides among [`LANES`]: two for the projection along each axis, then the four of the pyramid.
const FOUR: usize = 6;
const FAR: usize = 10;
const NEAR: usize = 11;

/// The pyramid around a packet, as half-spaces.
pub(crate) struct Pyramid {
    /// Outward normals of the sides, by axis. A point beyond a side is outside the packet.
    normal: [[f32; LANES]; 3],
    /// Maximum dot product of the normal and a point that is not outside.
    edge: [f32; LANES],
    /// By axis, whether the innermost corner of a box is on its low (0) or high side (1).
    inner: [[u32; LANES]; 3],
    /// Four directions, by axis: every ray is a nonnegative combination of them.
    pub(crate) corners: [[f32; 4]; 3],
}

/// Origins of the rays, as far as the pyramid needs them.
#[derive(Default)]
pub(crate) struct Start {
    /// The reference point to which coordinates are relative.
    pub(crate) reference: [f32; 3],
    /// Its largest coordinate, in absolute value.
    pub(crate) reach: f32,
    /// Maximum L1 distance of an origin from the reference.
    pub(crate) spread: f32,
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

/// A + s·B.
fn plus(a: [f32; 3], s: f32, b: [f32; 3]) -> [f32; 3] {
    [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]]
}

fn unit(a: [f32; 3]) -> Option<[f32; 3]> {
    let norm = dot(a, a).sqrt();
    (norm > 1e-7).then(|| {
        let inverse = 1.0 / norm;
        [a[0] * inverse, a[1] * inverse, a[2] * inverse]
    })
}

#[inline(always)]
fn along<S: Simd>(v: &[f32x16<S>; 3], n: [f32; 3]) -> f32x16<S> {
    let s = v[0].token();
    let splat = inlined(
        #[inline(always)]
        |x: f32| f32x16::splat(s, x),
    );
    v[2].mul_add(splat(n[2]), v[1].mul_add(splat(n[1]), v[0] * splat(n[0])))
}

impl Pyramid {
    pub(crate) fn blank() -> Self {
        Self {
            normal: [[0.0; LANES]; 3],
            edge: [0.0; LANES],
            inner: [[0; LANES]; 3],
            corners: [[0.0; 4]; 3],
        }
    }

    /// Computes the sides around the directions, for geometry whose coordinates do not exceed `reach`. Returns whether
    /// the rays form a narrow cone.
    #[inline(always)]
    pub(crate) fn surround<S: Simd, const R: usize>(
        &mut self,
        simd: S,
        direction: &Vectors<f32, R>,
        start: &Start,
        reach: f32,
    ) -> bool {
        let mut sum = whole(simd, direction, 0);
        for row in 1..R {
            let d = whole(simd, direction, row);
            for k in 0..3 {
                sum[k] += d[k];
            }
        }
        let Some(forward) = unit([sum[0].reduce_sum(), sum[1].reduce_sum(), sum[2].reduce_sum()]) else {
            return false;
        };
        // The ray farthest from the axis determines how the pyramid is oriented.
        let (mut farthest, mut most) = ([0.0; 3], -1.0);
        let mut least = f32x16::splat(simd, f32::INFINITY);
        for row in 0..R {
            let d = whole(simd, direction, row);
            least = least.min(along(&d, forward));
            let middle = [
                f32x16::splat(simd, forward[0]),
                f32x16::splat(simd, forward[1]),
                f32x16::splat(simd, forward[2]),
            ];
            let off = lanes::minus(&d, &middle);
            let square = lanes::dot(&off, &off);
            let greatest = square.reduce_max();
            if greatest > most {
                let lanes = square.simd_ge(f32x16::splat(simd, greatest)).to_bitmask();
                let lane = (lanes.trailing_zeros() as usize).min(LANES - 1);
                most = greatest;
                for k in 0..3 {
                    farthest[k] = direction[k].0[row][lane] - forward[k];
                }
            }
        }
        let least = least.reduce_min();
        if least.is_nan() || least < NARROW {
            return false;
        }
        let across = |a: [f32; 3]| unit(plus(a, -dot(a, forward), forward));
        let any = if forward[0].abs() < 0.6 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 1.0, 0.0]
        };
        let wide = if most > 1e-12 { across(farthest) } else { None };
        let Some(wide) = wide.or_else(|| across(any)) else {
            return false;
        };
        let narrow = cross(forward, wide);
        let infinite = f32x16::splat(simd, f32::INFINITY);
        let (mut low, mut high) = ([infinite; 2], [-infinite; 2]);
        for row in 0..R {
            let d = whole(simd, direction, row);
            let inverse = f32x16::splat(simd, 1.0) / along(&d, forward);
            let (a, b) = (along(&d, wide) * inverse, along(&d, narrow) * inverse);
            (low[0], high[0]) = (low[0].min(a), high[0].max(a));
            (low[1], high[1]) = (low[1].min(b), high[1].max(b));
        }
        let a = [
            low[0].reduce_min() - SLOPE_SLACK,
            high[0].reduce_max() + SLOPE_SLACK,
        ];
        let b = [
            low[1].reduce_min() - SLOPE_SLACK,
            high[1].reduce_max() + SLOPE_SLACK,
        ];
        let mut put = inlined(
            #[inline(always)]
            |place: usize, sign: f32, normal: [f32; 3]| {
                for (row, coordinate) in self.normal.iter_mut().zip(normal) {
                    row[place] = sign * coordinate;
                }
            },
        );
        put(FOUR, 1.0, plus(wide, -a[1], forward));
        put(FOUR + 1, -1.0, plus(wide, -a[0], forward));
        put(FOUR + 2, 1.0, plus(narrow, -b[1], forward));
        put(FOUR + 3, -1.0, plus(narrow, -b[0], forward));
        put(NEAR, 1.0, forward);
        put(FAR, -1.0, forward);
        let (a, b) = (
            f32x4::simd_from(simd, [a[0], a[0], a[1], a[1]]),
            f32x4::simd_from(simd, [b[0], b[1], b[0], b[1]]),
        );
        let corner = inlined(
            #[inline(always)]
            |k: usize| {
                let forward = f32x4::splat(simd, forward[k]);
                forward + a * f32x4::splat(simd, wide[k]) + b * f32x4::splat(simd, narrow[k])
            },
        );
        let corners = [corner(0), corner(1), corner(2)];
        for (corner, row) in corners.iter().zip(&mut self.corners) {
            corner.store_slice(row);
        }
        let mut unbounded = [false; 3];
        for (axis, a, b) in [(0, 1, 2), (1, 2, 0), (2, 0, 1)] {
            unbounded[axis] = !self.project(&corners, forward, axis, (a, b));
        }
        self.place(simd, start, reach);
        for (axis, unbounded) in unbounded.into_iter().enumerate() {
            if unbounded {
                self.edge[2 * axis] = f32::INFINITY;
                self.edge[2 * axis + 1] = f32::INFINITY;
            }
        }
        true
    }

    /// Computes the normals of the two sides of the projection along `axis`; a and b are the other axes. Returns `false`
    /// if the rays are nearly parallel to `axis`, so that the projection excludes nothing.
    #[inline(always)]
    fn project<S: Simd>(
        &mut self,
        corners: &[f32x4<S>; 3],
        forward: [f32; 3],
        axis: usize,
        (a, b): (usize, usize),
    ) -> bool {
        // Slope of the minor over the major coordinate.
        let (i, j) = if forward[a].abs() >= forward[b].abs() {
            (a, b)
        } else {
            (b, a)
        };
        let sign = 1.0_f32.copysign(forward[i]);
        let slope = corners[j] / corners[i];
        let least = (corners[i] * sign).reduce_min();
        let (low, high) = (slope.reduce_min(), slope.reduce_max());
        let place = 2 * axis;
        for k in 0..3 {
            (self.normal[k][place], self.normal[k][place + 1]) = (0.0, 0.0);
        }
        if least < 0.05 {
            return false;
        }
        // Products of slopes are rounded like the corners.
        let pad = 4.0 * SLOPE_SLACK * (1.0 + low.abs().max(high.abs()));
        let (low, high) = (low - pad, high + pad);
        let (above, below) = if sign > 0.0 { (high, low) } else { (low, high) };
        (self.normal[j][place], self.normal[i][place]) = (1.0, -above);
        (self.normal[j][place + 1], self.normal[i][place + 1]) = (-1.0, below);
        true
    }

    /// Moves the sides to the origins of the rays.
    #[inline(always)]
    fn place<S: Simd>(&mut self, simd: S, start: &Start, reach: f32) {
        // Covers the rounding of the dot products and of the reference.
        let slack = f32x16::splat(simd, 16.0 * ROUNDING * (reach + start.reach + start.spread));
        // The rounding of the common origin, or the distance of the origins from the reference.
        let apart = f32x16::splat(simd, start.spread.max(2.0 * ROUNDING * start.reach));
        let normal = [
            f32x16::simd_from(simd, self.normal[0]),
            f32x16::simd_from(simd, self.normal[1]),
            f32x16::simd_from(simd, self.normal[2]),
        ];
        let [x, y, z] = [normal[0].abs(), normal[1].abs(), normal[2].abs()];
        let edge = along(&normal, start.reference) + x.max(y).max(z) * apart + (x + y + z) * slack;
        edge.store_slice(&mut self.edge);
        for k in 0..3 {
            for side in 0..LANES {
                self.inner[k][side] = u32::from(self.normal[k][side] < 0.0);
            }
        }
    }

    /// Returns which of eight boxes a ray may hit before `limit`, and a lower bound on the distance to each.
    #[inline(always)]
    pub(crate) fn boxes<S: Simd>(
        &self,
        simd: S,
        bounds: &[[[f32; WIDTH]; 2]; 3],
        limit: f32,
    ) -> (u32, f32x8<S>) {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let corner = inlined(
            #[inline(always)]
            |side: usize, axis: usize| {
                f32x8::simd_from(simd, bounds[axis][(self.inner[axis][side] & 1) as usize])
            },
        );
        let term = inlined(
            #[inline(always)]
            |side: usize, axis: usize, sum: f32x8<S>| {
                corner(side, axis).mul_add(splat(self.normal[axis][side]), sum)
            },
        );
        let all = inlined(
            #[inline(always)]
            |side: usize| term(side, 2, term(side, 1, term(side, 0, splat(-self.edge[side])))),
        );
        // In the projection along one axis.
        let two = inlined(
            #[inline(always)]
            |side: usize, a: usize, b: usize| term(side, a, term(side, b, splat(-self.edge[side]))),
        );
        let a = two(0, 1, 2).max(two(1, 1, 2));
        let b = two(2, 2, 0).max(two(3, 2, 0));
        let c = two(4, 0, 1).max(two(5, 0, 1));
        let d = all(FOUR).max(all(FOUR + 1));
        let e = all(FOUR + 2).max(all(FOUR + 3));
        let outside = a.max(b).max(c.max(d)).max(e.max(all(FAR)));
        let near = all(NEAR) * splat(1.0 - 1e-6);
        let hits = outside.simd_le(splat(0.0)) & near.simd_le(splat(limit));
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        (hits.to_bitmask() as u32, near)
    }

    /// Returns which of eight triangles a ray may hit.
    #[inline(always)]
    pub(crate) fn triangles<S: Simd>(&self, simd: S, corners: &[[f32x8<S>; 3]; 3]) -> u32 {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let mut outside = splat(f32::NEG_INFINITY);
        for side in [FOUR, FOUR + 1, FOUR + 2, FOUR + 3, FAR] {
            let normal = [
                splat(self.normal[0][side]),
                splat(self.normal[1][side]),
                splat(self.normal[2][side]),
            ];
            let (a, b, c) = (
                lanes::dot(&corners[0], &normal),
                lanes::dot(&corners[1], &normal),
                lanes::dot(&corners[2], &normal),
            );
            outside = outside.max(a.min(b).min(c) - splat(self.edge[side]));
        }
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        let hits = outside.simd_le(splat(0.0)).to_bitmask() as u32;
        hits
    }
}
