//! A bundle of rays in lanes of f32, and the pyramid around it.
//!
//! The rays of a narrow cone, from nearly one point, lie in a pyramid. What is outside one of its sides, or outside one
//! of the sides that it has in projection along an axis, is met by none of them. All of it errs outwards.

use super::build::{downwards, rounded, upwards};
use super::lanes;
use super::lanes::inlined;
use super::wide::{ROUNDING, WIDTH};
use crate::footprint::Ray;
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f32x8, f32x16};

/// Rays that one instruction treats.
pub(super) const LANES: usize = 16;

/// Most rays of a bundle.
pub(super) const MOST: usize = 64;

/// Number of a triangle that is none.
pub(super) const NONE: u32 = u32::MAX;

/// Rounding of a slope in the pyramid, with room to spare.
const SLOPE_SLACK: f32 = 2e-6;

/// Least cosine between the bundle's middle and each of its rays: in wider cones there is too much that few rays meet.
const NARROW: f32 = 0.97;

/// Greatest offset of a start, as a part of how far all things reach.
const TOGETHER: f32 = 0.02;

/// Numbers of all rays.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub(super) struct Row<T>(pub(super) [[T; LANES]; MOST / LANES]);

/// What is behind a plane is out of the bundle.
#[derive(Clone, Copy, Default)]
pub(super) struct Side {
    normal: [f32; 3],
    /// By axis whether a box's corner that is farthest inside has its low (0) or its high side (1).
    inner: [usize; 3],
    /// Greatest product of the normal with a point that is not out.
    edge: f32,
}

/// A bundle.
pub(super) struct Bundle {
    pub(super) count: usize,
    /// The point that coordinates are relative to.
    pub(super) reference: [f32; 3],
    /// Greatest coordinate of it.
    pub(super) reference_reach: f32,
    /// Whether all rays start at one point.
    pub(super) common: bool,
    /// Greatest offset of a start from the reference, by the sum of its coordinates.
    pub(super) spread: f32,
    pub(super) direction: [Row<f32>; 3],
    /// Starts relative to the reference.
    pub(super) offset: [Row<f32>; 3],
    /// Direction × offset.
    pub(super) moment: [Row<f32>; 3],
    /// The sides in projection: two each without the first, the second and the third axis.
    projected: [[Side; 2]; 3],
    /// The four sides of the pyramid.
    sides: [Side; 4],
    near: Side,
    far: Side,
}

impl<T: Copy> Row<T> {
    pub(super) fn of(value: T) -> Self {
        Self([[value; LANES]; MOST / LANES])
    }

    pub(super) fn get(&self, ray: usize) -> T {
        self.0[ray / LANES][ray % LANES]
    }

    pub(super) fn set(&mut self, ray: usize, value: T) {
        self.0[ray / LANES][ray % LANES] = value;
    }
}

impl Side {
    fn new(normal: [f32; 3], edge: f32) -> Self {
        Self {
            normal,
            inner: normal.map(|n| usize::from(n < 0.0)),
            edge,
        }
    }
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

fn unit(a: [f32; 3]) -> Option<[f32; 3]> {
    let norm = dot(a, a).sqrt();
    (norm > 1e-7).then(|| a.map(|x| x / norm))
}

#[inline(always)]
fn row<S: Simd>(simd: S, row: &Row<f32>, vector: usize) -> f32x16<S> {
    f32x16::simd_from(simd, row.0[vector])
}

#[inline(always)]
fn rows<S: Simd>(simd: S, rows: &[Row<f32>; 3], vector: usize) -> [f32x16<S>; 3] {
    [
        row(simd, &rows[0], vector),
        row(simd, &rows[1], vector),
        row(simd, &rows[2], vector),
    ]
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

/// Least and greatest.
#[derive(Clone, Copy)]
struct Span(f32, f32);

/// Of what the vectors hold. Rows are filled up with copies of the first ray.
#[inline(always)]
fn span<S: Simd>(simd: S, vectors: usize, value: impl Fn(usize) -> f32x16<S>) -> Span {
    let (mut low, mut high) = (
        f32x16::splat(simd, f32::INFINITY),
        f32x16::splat(simd, f32::NEG_INFINITY),
    );
    for vector in 0..vectors {
        let value = value(vector);
        low = low.min(value);
        high = high.max(value);
    }
    Span(low.reduce_min(), high.reduce_max())
}

/// The normals of the two sides without a third axis; `None` if the rays go along that axis: then nothing is out.
#[inline(always)]
fn projection(edges: &[[f32; 3]; 4], forward: [f32; 3], a: usize, b: usize) -> Option<[[f32; 3]; 2]> {
    // The slope of the lesser over the greater.
    let (i, j) = if forward[a].abs() >= forward[b].abs() {
        (a, b)
    } else {
        (b, a)
    };
    let sign = 1.0_f32.copysign(forward[i]);
    let mut least = f32::INFINITY;
    let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
    for edge in edges {
        least = least.min(sign * edge[i]);
        let slope = edge[j] / edge[i];
        low = low.min(slope);
        high = high.max(slope);
    }
    if least < 0.05 {
        return None;
    }
    // Products of slopes are rounded as the edges are.
    let pad = 4.0 * SLOPE_SLACK * (1.0 + low.abs().max(high.abs()));
    let (low, high) = (low - pad, high + pad);
    let (above, below) = if sign > 0.0 { (high, low) } else { (low, high) };
    let mut sides = [[0.0; 3]; 2];
    (sides[0][j], sides[0][i]) = (1.0, -above);
    (sides[1][j], sides[1][i]) = (-1.0, below);
    Some(sides)
}

impl Bundle {
    /// At most [`MOST`] rays among things whose coordinates reach so far; `None` if they are no narrow cone.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, rays: &[Ray], reach: f32) -> Option<Self> {
        let first = rays.first()?;
        debug_assert!(rays.len() <= MOST);
        let vectors = rays.len().div_ceil(LANES);
        let reference: [f32; 3] = std::array::from_fn(|k| rounded(first.origin[k]));
        let origin: [f64; 3] = std::array::from_fn(|k| f64::from(reference[k]));
        let common = rays.iter().all(|r| r.origin == first.origin);
        let mut bundle = Self {
            count: rays.len(),
            reference,
            reference_reach: reference.iter().fold(0.0, |m, c| c.abs().max(m)),
            common,
            spread: 0.0,
            direction: [Row::of(0.0); 3],
            offset: [Row::of(0.0); 3],
            moment: [Row::of(0.0); 3],
            projected: [[Side::default(); 2]; 3],
            sides: [Side::default(); 4],
            near: Side::default(),
            far: Side::default(),
        };
        for (vector, rays) in rays.chunks(LANES).enumerate() {
            for lane in 0..LANES {
                let ray = rays.get(lane).unwrap_or(first);
                for k in 0..3 {
                    bundle.direction[k].0[vector][lane] = rounded(ray.direction[k]);
                }
            }
        }
        if !common {
            for i in 0..vectors * LANES {
                let ray = rays.get(i).unwrap_or(first);
                for (k, row) in bundle.offset.iter_mut().enumerate() {
                    row.set(i, rounded(ray.origin[k] - origin[k]));
                }
            }
            bundle.spread = 1.001
                * span(
                    simd,
                    vectors,
                    #[inline(always)]
                    |v| {
                        let [x, y, z] = rows(simd, &bundle.offset, v);
                        x.abs() + y.abs() + z.abs()
                    },
                )
                .1;
            if bundle.spread > TOGETHER * reach {
                return None;
            }
            for v in 0..vectors {
                let d = rows(simd, &bundle.direction, v);
                let o = rows(simd, &bundle.offset, v);
                for k in 0..3 {
                    let (p, q) = ((k + 1) % 3, (k + 2) % 3);
                    (d[p] * o[q] - d[q] * o[p]).store_slice(&mut bundle.moment[k].0[v]);
                }
            }
        }
        bundle.surround(simd, vectors, reach).then_some(bundle)
    }

    /// Finds the sides; whether the rays are a narrow cone.
    #[inline(always)]
    fn surround<S: Simd>(&mut self, simd: S, vectors: usize, reach: f32) -> bool {
        let direction = inlined(
            #[inline(always)]
            |v: usize| rows(simd, &self.direction, v),
        );
        let mut sum = [f32x16::splat(simd, 0.0); 3];
        for v in 0..vectors {
            let d = direction(v);
            for k in 0..3 {
                sum[k] += d[k];
            }
        }
        let sum = [sum[0].reduce_sum(), sum[1].reduce_sum(), sum[2].reduce_sum()];
        let Some(forward) = unit(sum) else { return false };
        let Span(least, _) = span(
            simd,
            vectors,
            #[inline(always)]
            |v| along(&direction(v), forward),
        );
        if least.is_nan() || least < NARROW {
            return false;
        }
        // The ray farthest from the middle shows how the bundle lies.
        let (mut farthest, mut most) = ([0.0; 3], -1.0);
        for v in 0..vectors {
            let d = direction(v);
            let middle = [
                f32x16::splat(simd, forward[0]),
                f32x16::splat(simd, forward[1]),
                f32x16::splat(simd, forward[2]),
            ];
            let off = lanes::less(&d, &middle);
            let square = lanes::dot(&off, &off);
            let greatest = square.reduce_max();
            if greatest > most {
                let lane = square
                    .simd_ge(f32x16::splat(simd, greatest))
                    .to_bitmask()
                    .trailing_zeros() as usize;
                most = greatest;
                farthest = std::array::from_fn(|k| self.direction[k].0[v][lane.min(LANES - 1)] - forward[k]);
            }
        }
        let across = inlined(
            #[inline(always)]
            |a: [f32; 3]| unit(std::array::from_fn(|k| a[k] - forward[k] * dot(a, forward))),
        );
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
        // Products of points and normals, and the reference, are rounded.
        let slack = 16.0 * ROUNDING * (reach + self.reference_reach + self.spread);
        let side = inlined(
            #[inline(always)]
            |normal: [f32; 3]| {
                let [x, y, z] = [normal[0].abs(), normal[1].abs(), normal[2].abs()];
                // The rounding of the one start, or how far others are from the reference.
                let start = x.max(y).max(z) * self.spread.max(2.0 * ROUNDING * self.reference_reach);
                Side::new(normal, dot(normal, self.reference) + start + slack * (x + y + z))
            },
        );
        let slopes = inlined(
            #[inline(always)]
            |to: [f32; 3]| {
                let Span(low, high) = span(
                    simd,
                    vectors,
                    #[inline(always)]
                    |v| {
                        let d = direction(v);
                        along(&d, to) / along(&d, forward)
                    },
                );
                [low - SLOPE_SLACK, high + SLOPE_SLACK]
            },
        );
        let (across, up) = (slopes(wide), slopes(narrow));
        let plus = |a: [f32; 3], s: f32, b: [f32; 3]| [a[0] + s * b[0], a[1] + s * b[1], a[2] + s * b[2]];
        let negative = |a: [f32; 3]| [-a[0], -a[1], -a[2]];
        self.sides = [
            side(plus(wide, -across[1], forward)),
            side(negative(plus(wide, -across[0], forward))),
            side(plus(narrow, -up[1], forward)),
            side(negative(plus(narrow, -up[0], forward))),
        ];
        // Every ray is a sum of the pyramid's edges, none of them taken away.
        let edge = |a: f32, b: f32| plus(plus(forward, a, wide), b, narrow);
        let edges = [
            edge(across[0], up[0]),
            edge(across[0], up[1]),
            edge(across[1], up[0]),
            edge(across[1], up[1]),
        ];
        for (axis, (a, b)) in [(1, 2), (2, 0), (0, 1)].into_iter().enumerate() {
            self.projected[axis] = projection(&edges, forward, a, b)
                .map_or([Side::new([0.0; 3], f32::INFINITY); 2], |[above, below]| {
                    [side(above), side(below)]
                });
        }
        self.near = side(forward);
        self.far = side(negative(forward));
        true
    }

    /// Which of eight boxes some ray may meet before `limit`, and a way along a ray that is shorter than that to them.
    #[inline(always)]
    pub(super) fn boxes<S: Simd>(
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
            |side: &Side, axis: usize| f32x8::simd_from(simd, bounds[axis][side.inner[axis] & 1]),
        );
        let term = inlined(
            #[inline(always)]
            |side: &Side, axis: usize| corner(side, axis) * splat(side.normal[axis]),
        );
        let all = inlined(
            #[inline(always)]
            |side: &Side| {
                let xy = corner(side, 1).mul_add(splat(side.normal[1]), term(side, 0));
                corner(side, 2).mul_add(splat(side.normal[2]), xy - splat(side.edge))
            },
        );
        let two = inlined(
            #[inline(always)]
            |side: &Side, a: usize, b: usize| {
                corner(side, a).mul_add(splat(side.normal[a]), term(side, b) - splat(side.edge))
            },
        );
        let out = inlined(
            #[inline(always)]
            |x: f32x8<S>, y: f32x8<S>| x.max(y),
        );
        let [x, y, z] = &self.projected;
        let a = out(two(&x[0], 1, 2), two(&x[1], 1, 2));
        let b = out(two(&y[0], 2, 0), two(&y[1], 2, 0));
        let c = out(two(&z[0], 0, 1), two(&z[1], 0, 1));
        let d = out(all(&self.sides[0]), all(&self.sides[1]));
        let e = out(all(&self.sides[2]), all(&self.sides[3]));
        let outside = out(out(out(a, b), out(c, d)), out(e, all(&self.far)));
        let near = all(&self.near) * splat(1.0 - 1e-6);
        let met = outside.simd_le(splat(0.0)) & near.simd_le(splat(limit));
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        (met.to_bitmask() as u32, near)
    }

    /// Which of eight triangles some ray may meet.
    #[inline(always)]
    pub(super) fn triangles<S: Simd>(&self, simd: S, corners: &[[f32x8<S>; 3]; 3]) -> u32 {
        let splat = inlined(
            #[inline(always)]
            |x: f32| f32x8::splat(simd, x),
        );
        let mut outside = splat(f32::NEG_INFINITY);
        for side in self.sides.iter().chain([&self.far]) {
            let normal = [
                splat(side.normal[0]),
                splat(side.normal[1]),
                splat(side.normal[2]),
            ];
            let (a, b, c) = (
                lanes::dot(&corners[0], &normal),
                lanes::dot(&corners[1], &normal),
                lanes::dot(&corners[2], &normal),
            );
            outside = outside.max(a.min(b).min(c) - splat(side.edge));
        }
        // Eight lanes.
        #[allow(clippy::cast_possible_truncation)]
        let met = outside.simd_le(splat(0.0)).to_bitmask() as u32;
        met
    }
}

/// An interval of f32 around a number of f64.
pub(super) fn around(x: f64) -> (f32, f32) {
    (downwards(x), upwards(x))
}
