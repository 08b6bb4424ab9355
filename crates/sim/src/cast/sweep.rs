//! A beam against all surfaces: whole shapes are left out by their boxes, polygons are met eight rays at a time.
//!
//! A polygon's plane and edges are computed in f64 as for a ray alone, in the same order: the answer is the same to the
//! bit.

use super::build::upwards;
use super::bundle::{Bundle, MOST};
use super::exact::LANES;
use super::lanes::{inlined, less, load};
use super::wide::{Child, Node, STACK};
use super::{EDGE_SLACK, FARTHEST, Hit, Polygon, Shape, World};
use crate::footprint::Ray;
use fearless_simd::f64x8;
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use nalgebra::{Unit, Vector3};

impl World {
    pub(super) fn cast_beam_at(
        &self,
        level: Level,
        rays: &[Ray],
        left: Option<usize>,
        hits: &mut [Option<Hit>],
    ) {
        assert_eq!(rays.len(), hits.len(), "every ray has its place");
        for (rays, hits) in rays.chunks(MOST).zip(hits.chunks_mut(MOST)) {
            self.cast_some(level, rays, left, hits);
        }
    }

    /// What is no narrow cone may be two.
    fn cast_some(&self, level: Level, rays: &[Ray], left: Option<usize>, hits: &mut [Option<Hit>]) {
        if let [ray] = rays {
            hits[0] = self.cast(ray, left);
            return;
        }
        let done = dispatch!(level, simd => match Bundle::new(simd, rays, self.reach) {
            Some(bundle) => {
                self.sweep(simd, &bundle, rays, left, hits);
                true
            }
            None => false,
        });
        if !done {
            let middle = rays.len() / 2;
            let (first, second) = hits.split_at_mut(middle);
            self.cast_some(level, &rays[..middle], left, first);
            self.cast_some(level, &rays[middle..], left, second);
        }
    }

    #[inline(always)]
    fn sweep<S: Simd>(
        &self,
        simd: S,
        bundle: &Bundle,
        rays: &[Ray],
        left: Option<usize>,
        hits: &mut [Option<Hit>],
    ) {
        let mut nearest = [(f64::INFINITY, usize::MAX); MOST];
        let mut normals = [Vector3::x_axis(); MOST];
        let mut met = [None; MOST];
        let nearest_of = inlined(
            #[inline(always)]
            |surface: usize, limit: &mut f32| {
                if left == Some(surface) {
                    return;
                }
                let mut changed = false;
                let mut take = inlined(
                    #[inline(always)]
                    |ray: usize, distance: f64, normal: Unit<Vector3<f64>>| {
                        if (distance, surface) < nearest[ray] {
                            nearest[ray] = (distance, surface);
                            normals[ray] = normal;
                            changed = true;
                        }
                    },
                );
                match &self.shapes[surface] {
                    Shape::Polygon(one) => {
                        for first in (0..rays.len()).step_by(LANES) {
                            let distances = polygon(simd, one, &rays[first..]);
                            let count = LANES.min(rays.len() - first);
                            for (lane, distance) in distances[..count].iter().enumerate() {
                                if *distance < f64::INFINITY {
                                    take(first + lane, *distance, one.normal);
                                }
                            }
                        }
                    }
                    Shape::Mesh(mesh) => {
                        mesh.nearest_of_beam(rays, &mut met[..rays.len()]);
                        for (i, ray) in rays.iter().enumerate() {
                            if let Some(met) = met[i] {
                                take(i, met.distance, mesh.normal(met.triangle, ray));
                            }
                        }
                    }
                    other => {
                        for (i, ray) in rays.iter().enumerate() {
                            if let Some((distance, normal)) = other.cast(ray) {
                                take(i, distance, normal);
                            }
                        }
                    }
                }
                if changed {
                    let farthest = nearest[..rays.len()].iter().fold(0.0, |m: f64, n| m.max(n.0));
                    *limit = upwards(farthest.min(FARTHEST));
                }
            },
        );
        boxes(simd, &self.nodes, bundle, upwards(FARTHEST), nearest_of);
        for (i, hit) in hits.iter_mut().enumerate() {
            let (distance, surface) = nearest[i];
            *hit = (surface != usize::MAX).then(|| Hit::new(surface, distance, normals[i], &rays[i]));
        }
    }
}

/// Tells of every shape whose box some ray of the bundle may meet within `limit`, which `tell` may lower; the nearest
/// box comes first, as far as boxes have an order.
#[inline(always)]
pub(super) fn boxes<S: Simd>(
    simd: S,
    nodes: &[Node],
    bundle: &Bundle,
    mut limit: f32,
    mut tell: impl FnMut(usize, &mut f32),
) {
    let mut stack = [(0.0_f32, Child::NONE); STACK];
    stack[0] = (0.0, Child::node(0));
    let mut height = 1;
    while height > 0 {
        height -= 1;
        let (near, child) = stack[height];
        if near > limit {
            continue;
        }
        if child.is_leaf() {
            tell(child.number(), &mut limit);
            continue;
        }
        let node = &nodes[child.number()];
        let (met, near) = bundle.boxes(simd, &node.bounds, limit);
        height = node.push(met, near, &mut stack, height);
    }
}

/// Distances at which up to eight rays meet a polygon, infinite where they do not: `Polygon::cast`.
#[inline(always)]
pub(super) fn polygon<S: Simd>(simd: S, polygon: &Polygon, rays: &[Ray]) -> [f64; LANES] {
    let (mut origin, mut direction) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    for (lane, ray) in rays.iter().take(LANES).enumerate() {
        for k in 0..3 {
            origin[k][lane] = ray.origin[k];
            direction[k][lane] = ray.direction[k];
        }
    }
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
    // Not fused, as for a ray alone.
    let dot = inlined(
        #[inline(always)]
        |a: &[f64x8<S>; 3], b: &[f64x8<S>; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2],
    );
    let (origin, direction) = (load(simd, &origin), load(simd, &direction));
    let normal = splat(&polygon.normal);
    let closing = dot(&normal, &direction);
    let distance = dot(&normal, &less(&splat(&polygon.origin.coords), &origin)) / closing;
    let point = [
        origin[0] + direction[0] * distance,
        origin[1] + direction[1] * distance,
        origin[2] + direction[2] * distance,
    ];
    let mut met = distance.simd_gt(f64x8::splat(simd, 0.0)) & distance.simd_lt(f64x8::splat(simd, FARTHEST));
    for (inwards, edge) in &polygon.edges {
        met &= dot(&splat(inwards), &point).simd_ge(f64x8::splat(simd, edge - EDGE_SLACK));
    }
    let mut distances = [0.0; LANES];
    met.select(distance, f64x8::splat(simd, f64::INFINITY))
        .store_slice(&mut distances);
    distances
}
