//! A beam against all surfaces: whole shapes are left out by their boxes, polygons are met eight rays at a time.
//!
//! A polygon's plane and edges are computed in f64 as for a ray alone, in the same order: the answer is the same to the
//! bit. Where the whole pyramid around the rays passes inside the polygon, or outside, its edges need not be tried.

use super::build::upwards;
use super::bundle::{Bundle, Caster, cast_all};
use super::exact::product;
use super::lanes::{inlined, less};
use super::rows::{HALF, LANES, Rows, half};
use super::wide::Walk;
use super::{EDGE_SLACK, FARTHEST, Hit, Met, Polygon, Shape, World};
use crate::footprint::Ray;
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use fearless_simd::{f64x4, f64x8};
use nalgebra::{Unit, Vector3};

/// Number of a surface that is none.
const NONE: u32 = u32::MAX;

/// Where the corners of a pyramid meet a polygon's plane, as seen from the polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Passes {
    Inside,
    Outside,
    /// Or nothing is known.
    Partly,
}

/// The nearest surface of every ray.
struct Nearest<const R: usize> {
    distance: Rows<f64, R>,
    surface: Rows<u32, R>,
    /// Its triangle, if it is a mesh.
    triangle: Rows<u32, R>,
    /// Not less than the greatest distance.
    limit: f32,
}

/// A world without the surface that the rays left, with what the machine has.
struct InWorld<'a> {
    world: &'a World,
    level: Level,
    left: Option<usize>,
}

impl Caster<Option<Hit>> for InWorld<'_> {
    fn cast_each(&self, rays: &[Ray], hits: &mut [Option<Hit>]) {
        for (ray, hit) in rays.iter().zip(hits) {
            *hit = self.world.cast(ray, self.left);
        }
    }

    fn cast_rows<const R: usize>(&self, rays: &[Ray], hits: &mut [Option<Hit>]) -> bool {
        dispatch!(self.level, simd => {
            let mut bundle = Bundle::<R>::blank();
            let narrow = bundle.fill(simd, rays, self.world.reach);
            if narrow {
                let nearest = self.world.sweep(simd, &bundle, rays, self.left);
                for (i, (ray, hit)) in rays.iter().zip(hits).enumerate() {
                    *hit = self.world.hit(ray, nearest.surface.get(i), nearest.triangle.get(i), nearest.distance.get(i));
                }
            }
            narrow
        })
    }
}

impl World {
    pub(super) fn cast_beam_at(
        &self,
        level: Level,
        rays: &[Ray],
        left: Option<usize>,
        hits: &mut [Option<Hit>],
    ) {
        let world = self;
        cast_all(&InWorld { world, level, left }, rays, hits);
    }

    #[inline(always)]
    fn sweep<S: Simd, const R: usize>(
        &self,
        simd: S,
        bundle: &Bundle<R>,
        rays: &[Ray],
        left: Option<usize>,
    ) -> Nearest<R> {
        let mut nearest = Nearest::new(rays.len());
        let mut walk = Walk::new();
        let mut next = Some(walk.start());
        while let Some(child) = next {
            let mut nearer = None;
            if !child.is_leaf() {
                let node = &self.nodes[child.number()];
                let (met, near) = bundle.pyramid.boxes(simd, &node.bounds, nearest.limit);
                nearer = walk.enter(node, met, near);
            } else if left != Some(child.number()) {
                self.meet(simd, bundle, rays, child.number(), &mut nearest);
            }
            next = nearer.or_else(|| walk.next(nearest.limit));
        }
        nearest
    }

    #[inline(always)]
    fn meet<S: Simd, const R: usize>(
        &self,
        simd: S,
        bundle: &Bundle<R>,
        rays: &[Ray],
        surface: usize,
        nearest: &mut Nearest<R>,
    ) {
        match &self.shapes[surface] {
            Shape::Polygon(polygon) => nearest.polygon(simd, bundle, surface, polygon),
            Shape::Mesh(mesh) => {
                let take = inlined(
                    #[inline(always)]
                    |ray: usize, met: Option<Met>| {
                        if let Some(met) = met {
                            nearest.take(ray, met.distance, surface, met.triangle);
                        }
                    },
                );
                mesh.nearest_of_bundle(simd, bundle, rays, take);
                nearest.set_limit(simd);
            }
            other => {
                for (i, ray) in rays.iter().enumerate() {
                    if let Some(distance) = other.distance(ray) {
                        nearest.take(i, distance, surface, NONE);
                    }
                }
                nearest.set_limit(simd);
            }
        }
    }

    /// What there is to know of a surface that a ray meets at a distance.
    #[inline(always)]
    fn hit(&self, ray: &Ray, surface: u32, triangle: u32, distance: f64) -> Option<Hit> {
        if surface == NONE {
            return None;
        }
        let surface = surface as usize;
        let normal: Unit<Vector3<f64>> = match &self.shapes[surface] {
            Shape::Polygon(polygon) => polygon.normal,
            Shape::Mesh(mesh) => mesh.normal(triangle, ray),
            other => other.cast(ray)?.1,
        };
        Some(Hit::new(surface, distance, normal, ray))
    }
}

impl<const R: usize> Nearest<R> {
    #[inline(always)]
    fn new(count: usize) -> Self {
        let mut nearest = Self {
            distance: Rows::of(f64::INFINITY),
            surface: Rows::of(NONE),
            triangle: Rows::of(NONE),
            limit: upwards(FARTHEST),
        };
        // What a row is filled up with meets nothing.
        for ray in count..R * LANES {
            nearest.distance.set(ray, f64::NEG_INFINITY);
        }
        nearest
    }

    /// A surface at some distance; of surfaces at the same distance the first counts. Whether it does.
    fn take(&mut self, ray: usize, distance: f64, surface: usize, triangle: u32) -> bool {
        let surface = numbered(surface);
        let nearer = (distance, surface) < (self.distance.get(ray), self.surface.get(ray));
        if nearer {
            self.distance.set(ray, distance);
            self.surface.set(ray, surface);
            self.triangle.set(ray, triangle);
        }
        nearer
    }

    #[inline(always)]
    fn set_limit<S: Simd>(&mut self, simd: S) {
        let mut most = f64x8::splat(simd, 0.0);
        for row in 0..R {
            for half in self.distance.0[row].chunks_exact(HALF) {
                most = most.max(f64x8::from_slice(simd, half));
            }
        }
        self.limit = upwards(most.reduce_max().min(FARTHEST));
    }

    #[inline(always)]
    fn polygon<S: Simd>(&mut self, simd: S, bundle: &Bundle<R>, surface: usize, polygon: &Polygon) {
        let passes = passes(simd, bundle, polygon);
        if passes == Passes::Outside {
            return;
        }
        let mut changed = false;
        for row in 0..R {
            for second in 0..2 {
                let distances = distances(simd, bundle, row, second, polygon, passes == Passes::Inside);
                let from = second * HALF;
                let present = f64x8::from_slice(simd, &self.distance.0[row][from..from + HALF]);
                let nearer = distances.simd_lt(present).to_bitmask();
                if nearer == (1 << HALF) - 1 {
                    let places = from..from + HALF;
                    distances.store_slice(&mut self.distance.0[row][places.clone()]);
                    self.surface.0[row][places.clone()].fill(numbered(surface));
                    self.triangle.0[row][places].fill(NONE);
                    changed = true;
                    continue;
                }
                // One that is as near may be a surface before this one.
                let mut open = nearer | distances.simd_eq(present).to_bitmask();
                if open == 0 {
                    continue;
                }
                let mut all = [0.0; HALF];
                distances.store_slice(&mut all);
                while open != 0 {
                    let lane = open.trailing_zeros() as usize & (HALF - 1);
                    open &= open - 1;
                    if all[lane] < f64::INFINITY {
                        changed |= self.take(row * LANES + from + lane, all[lane], surface, NONE);
                    }
                }
            }
        }
        if changed {
            self.set_limit(simd);
        }
    }
}

/// A surface's number; those of shapes in a node of the index are as small.
#[allow(clippy::cast_possible_truncation)]
fn numbered(surface: usize) -> u32 {
    surface as u32
}

/// Distances at which eight rays meet a polygon, infinite where they do not: `Polygon::cast`.
#[inline(always)]
fn distances<S: Simd, const R: usize>(
    simd: S,
    bundle: &Bundle<R>,
    row: usize,
    second: usize,
    polygon: &Polygon,
    inside: bool,
) -> f64x8<S> {
    let origin = bundle.rays.starts(simd, row, second);
    let direction = half(simd, &bundle.rays.direction, row, second);
    let splat = inlined(
        #[inline(always)]
        |v: &Vector3<f64>| {
            [
                f64x8::splat(simd, v.x),
                f64x8::splat(simd, v.y),
                f64x8::splat(simd, v.z),
            ]
        },
    );
    let closing = product(simd, &polygon.normal, &direction);
    let seen = less(&splat(&polygon.origin.coords), &origin);
    let distance = product(simd, &polygon.normal, &seen) / closing;
    if inside {
        return distance;
    }
    let point = [
        origin[0] + direction[0] * distance,
        origin[1] + direction[1] * distance,
        origin[2] + direction[2] * distance,
    ];
    let mut met = distance.simd_gt(f64x8::splat(simd, 0.0)) & distance.simd_lt(f64x8::splat(simd, FARTHEST));
    for (inwards, edge) in &polygon.edges {
        met &= product(simd, inwards, &point).simd_ge(f64x8::splat(simd, edge - EDGE_SLACK));
    }
    met.select(distance, f64x8::splat(simd, f64::INFINITY))
}

/// How the pyramid around the rays passes a polygon.
///
/// The plane cuts it in a convex outline whose corners are where the pyramid's do. Rays that start elsewhere than at its
/// tip, by δ at most, are off by δ(1 + 1/N·d) there.
#[inline(always)]
fn passes<S: Simd, const R: usize>(simd: S, bundle: &Bundle<R>, polygon: &Polygon) -> Passes {
    let splat = inlined(
        #[inline(always)]
        |x: f64| f64x4::splat(simd, x),
    );
    let corner = inlined(
        #[inline(always)]
        |k: usize| {
            let [a, b, c, d] = bundle.pyramid.corners[k];
            f64x4::simd_from(simd, [a.into(), b.into(), c.into(), d.into()])
        },
    );
    let (x, y, z) = (corner(0), corner(1), corner(2));
    let along = inlined(
        #[inline(always)]
        |v: &Vector3<f64>| x * splat(v.x) + y * splat(v.y) + z * splat(v.z),
    );
    let [sx, sy, sz] = bundle.start.reference.map(f64::from);
    let n = &polygon.normal;
    let height =
        n.x * (polygon.origin.x - sx) + n.y * (polygon.origin.y - sy) + n.z * (polygon.origin.z - sz);
    let closing = along(n);
    let way = splat(height) / closing;
    let (least, most) = (way.reduce_min(), way.reduce_max());
    // The rounding of the tip, and of everything.
    let apart = f64::from(bundle.start.spread) + 1e-6 * (1.0 + f64::from(bundle.start.reach));
    let flattest = closing.abs().reduce_min();
    let margin = apart * (1.0 + 2.0 / flattest);
    if !(least * flattest > 2.0 * apart && most < 0.5 * FARTHEST) {
        return Passes::Partly;
    }
    let mut inside = true;
    for (inwards, edge) in &polygon.edges {
        let start = inwards.x * sx + inwards.y * sy + inwards.z * sz;
        let over = along(inwards) * way + splat(start - edge);
        if over.reduce_max() < -margin {
            return Passes::Outside;
        }
        inside &= over.reduce_min() > margin;
    }
    if inside { Passes::Inside } else { Passes::Partly }
}
