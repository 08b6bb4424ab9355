//! Packets against all surfaces of a world: whole shapes are culled by their boxes, polygons are intersected with eight
//! rays at a time.
//!
//! A polygon's plane and edges are computed in f64 in the same order as for a single ray, so the results are
//! bit-identical. Where the whole pyramid around the rays passes inside or outside the polygon, no edges are tested.

use crate::hit::{Hit, NONE};
use crate::index::traversal::Traversal;
use crate::index::wide::{Child, Node};
use crate::lanes::{inlined, minus, unfused};
use crate::mesh::finish::RowHits;
use crate::packet::cast::{Caster, Packet, cast_all};
use crate::packet::in_rows::InRows;
use crate::packet::rays::Rays;
use crate::packet::rows::{HALF, LANES, Rows, half};
use crate::ray::{FARTHEST, Ray};
use crate::rounding::upwards;
use crate::shape::Shape;
use crate::solid::polygon::{EDGE_SLACK, Polygon};
use crate::world::{World, numbered};
use fearless_simd::{Level, Simd, dispatch, prelude::*};
use fearless_simd::{f64x4, f64x8, mask32x8, mask64x8, u32x8};
use nalgebra::Vector3;
use std::ops::Range;

/// Where a packet's pyramid crosses a polygon's plane, relative to the polygon.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Passes {
    Inside,
    Outside,
    /// On both sides of an edge, or undecided.
    Partly,
}

/// Nearest hit of every ray so far.
struct Nearest<const R: usize> {
    distance: Rows<f64, R>,
    surface: Rows<u32, R>,
    /// For a mesh, the triangle and the dot product of the direction and its normal.
    triangle: Rows<u32, R>,
    closing: Rows<f64, R>,
    /// Upper bound on the distances.
    limit: f32,
}

/// Hits of eight rays on one surface.
struct Candidates<S: Simd> {
    surface: u32,
    /// Infinite for a miss.
    distance: f64x8<S>,
    /// For a mesh, the triangle and the dot product of the direction and its normal.
    of_mesh: Option<(u32x8<S>, f64x8<S>)>,
}

/// A world without one surface, as a rule the mirror that the rays leave, and the instruction set to cast with.
struct InWorld<'a> {
    world: &'a World,
    level: Level,
    except: Option<usize>,
}

impl Caster<Option<Hit>> for InWorld<'_> {
    fn cast_each(&self, rays: &Rays, which: Range<usize>, hits: &mut [Option<Hit>]) {
        for (ray, hit) in which.zip(hits) {
            *hit = self.world.cast_at(self.level, &rays.get(ray), self.except);
        }
    }

    fn cast_rows<const R: usize>(&self, rays: &Rays, which: Range<usize>, hits: &mut [Option<Hit>]) -> bool {
        dispatch!(self.level, simd => {
            let mut packet = Packet::<R>::new(rays, which);
            let narrow = packet.surround(simd, self.world.reach);
            if narrow {
                let mut nearest = Nearest::new(packet.rays.count);
                self.world.traverse(simd, &packet, self.except, &mut nearest);
                for (ray, hit) in hits.iter_mut().enumerate() {
                    *hit = nearest.hit(self.world, &packet.rays, ray);
                }
            }
            narrow
        })
    }
}

impl World {
    /// Finds the nearest hit of each ray, ignoring the surface `except`: what [`World::cast`] finds for each, faster if the
    /// rays are coherent, that is if those of a packet form a narrow cone with nearly one origin.
    ///
    /// # Panics
    /// If the numbers of rays and result slots differ.
    pub fn cast_packets(&self, rays: &Rays, except: Option<usize>, hits: &mut [Option<Hit>]) {
        self.cast_packets_at(Level::new(), rays, except, hits);
    }

    pub(crate) fn cast_packets_at(
        &self,
        level: Level,
        rays: &Rays,
        except: Option<usize>,
        hits: &mut [Option<Hit>],
    ) {
        let world = self;
        cast_all(&InWorld { world, level, except }, rays, hits);
    }

    #[inline(always)]
    fn traverse<S: Simd, const R: usize>(
        &self,
        simd: S,
        packet: &Packet<'_, R>,
        except: Option<usize>,
        nearest: &mut Nearest<R>,
    ) {
        let boxes = inlined(
            #[inline(always)]
            |node: &Node, limit: f32| packet.pyramid.boxes(simd, &node.bounds, limit),
        );
        let visit = inlined(
            #[inline(always)]
            |child: Child| {
                if except != Some(child.number()) {
                    self.intersect(simd, packet, child.number(), nearest);
                } else if let curved @ Shape::Curved(_) = &self.shapes[child.number()] {
                    let again = |ray: &Ray| Some(curved.hit_again(ray)?.0);
                    nearest.each(simd, packet, numbered(child.number()), again);
                }
                nearest.limit
            },
        );
        Traversal::new().run(&self.nodes, upwards(FARTHEST), boxes, visit);
    }

    #[inline(always)]
    fn intersect<S: Simd, const R: usize>(
        &self,
        simd: S,
        packet: &Packet<'_, R>,
        surface: usize,
        nearest: &mut Nearest<R>,
    ) {
        match &self.shapes[surface] {
            Shape::Polygon(polygon) => nearest.polygon(simd, packet, surface, polygon),
            Shape::Mesh(mesh) => {
                let take = inlined(
                    #[inline(always)]
                    |row: &RowHits<'_>| nearest.mesh(simd, numbered(surface), row),
                );
                mesh.hits_of_packet::<_, R, true>(simd, packet, take);
                nearest.set_limit(simd);
            }
            other => nearest.each(simd, packet, numbered(surface), |ray| other.distance(ray)),
        }
    }
}

impl<const R: usize> Nearest<R> {
    #[inline(always)]
    fn new(count: usize) -> Self {
        let mut nearest = Self {
            distance: Rows::of(f64::INFINITY),
            surface: Rows::of(NONE),
            triangle: Rows::of(NONE),
            closing: Rows::of(0.0),
            limit: upwards(FARTHEST),
        };
        // Padding hits nothing.
        for ray in count..R * LANES {
            nearest.distance.set(ray, f64::NEG_INFINITY);
        }
        nearest
    }

    /// Returns the hit of a ray on its nearest surface.
    #[inline(always)]
    fn hit(&self, world: &World, rays: &InRows<'_, R>, number: usize) -> Option<Hit> {
        let surface = self.surface.get(number);
        if surface == NONE {
            return None;
        }
        let (triangle, closing) = match &world.shapes[surface as usize] {
            Shape::Mesh(_) => (self.triangle.get(number), self.closing.get(number)),
            _ => {
                let ray = rays.get(number);
                (
                    NONE,
                    world.closing(surface, NONE, &ray, self.distance.get(number)),
                )
            }
        };
        Some(Hit {
            surface,
            triangle,
            distance: self.distance.get(number),
            closing,
        })
    }

    /// Casts the rays one by one into a surface.
    #[inline(always)]
    fn each<S: Simd>(
        &mut self,
        simd: S,
        packet: &Packet<'_, R>,
        surface: u32,
        cast: impl Fn(&Ray) -> Option<f64>,
    ) {
        for ray in 0..packet.rays.count {
            if let Some(distance) = cast(&packet.rays.get(ray)) {
                self.take(ray, distance, surface);
            }
        }
        self.set_limit(simd);
    }

    /// Records a hit on a surface other than a mesh, if it is nearer, or as near with a lower index. Returns whether it is.
    fn take(&mut self, ray: usize, distance: f64, surface: u32) -> bool {
        let nearer = (distance, surface) < (self.distance.get(ray), self.surface.get(ray));
        if nearer {
            self.distance.set(ray, distance);
            self.surface.set(ray, surface);
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

    /// Records the hits of one half of a row that are nearer, or as near with a lower index. Returns whether any is.
    #[inline(always)]
    fn take_half<S: Simd>(&mut self, simd: S, row: usize, second: usize, of: &Candidates<S>) -> bool {
        let places = second * HALF..(second + 1) * HALF;
        let present = f64x8::from_slice(simd, &self.distance.0[row][places.clone()]);
        let number = u32x8::splat(simd, of.surface);
        let surfaces = u32x8::from_slice(simd, &self.surface.0[row][places.clone()]);
        let (nearer, as_near) = (of.distance.simd_lt(present), of.distance.simd_eq(present));
        let mut which = nearer;
        if as_near.to_bitmask() != 0 {
            let infinite = f64x8::splat(simd, f64::INFINITY);
            let before = number.simd_lt(surfaces).to_bitmask();
            let before = mask64x8::from_bitmask(simd, before);
            which |= as_near & before & of.distance.simd_lt(infinite);
        }
        let bits = which.to_bitmask();
        if bits == 0 {
            return false;
        }
        let narrow = mask32x8::from_bitmask(simd, bits);
        which
            .select(of.distance, present)
            .store_slice(&mut self.distance.0[row][places.clone()]);
        narrow
            .select(number, surfaces)
            .store_slice(&mut self.surface.0[row][places.clone()]);
        if let Some((triangle, closing)) = of.of_mesh {
            let triangles = u32x8::from_slice(simd, &self.triangle.0[row][places.clone()]);
            let closings = f64x8::from_slice(simd, &self.closing.0[row][places.clone()]);
            narrow
                .select(triangle, triangles)
                .store_slice(&mut self.triangle.0[row][places.clone()]);
            which
                .select(closing, closings)
                .store_slice(&mut self.closing.0[row][places]);
        }
        true
    }

    #[inline(always)]
    fn mesh<S: Simd>(&mut self, simd: S, surface: u32, row: &RowHits<'_>) {
        for second in 0..2 {
            let places = second * HALF..(second + 1) * HALF;
            let some = mask64x8::from_bitmask(simd, row.some >> (second * HALF) & 0xff);
            let distance = f64x8::from_slice(simd, &row.distance[places.clone()]);
            let candidates = Candidates {
                surface,
                distance: some.select(distance, f64x8::splat(simd, f64::INFINITY)),
                of_mesh: Some((
                    u32x8::from_slice(simd, &row.triangle[places.clone()]),
                    f64x8::from_slice(simd, &row.closing[places]),
                )),
            };
            self.take_half(simd, row.row, second, &candidates);
        }
    }

    #[inline(always)]
    fn polygon<S: Simd>(&mut self, simd: S, packet: &Packet<'_, R>, surface: usize, polygon: &Polygon) {
        let passes = passes(simd, packet, polygon);
        if passes == Passes::Outside {
            return;
        }
        let mut changed = false;
        for row in 0..R {
            for second in 0..2 {
                let candidates = Candidates {
                    surface: numbered(surface),
                    distance: distances(simd, packet, row, second, polygon, passes == Passes::Inside),
                    of_mesh: None,
                };
                changed |= self.take_half(simd, row, second, &candidates);
            }
        }
        if changed {
            self.set_limit(simd);
        }
    }
}

/// Returns the distances at which eight rays hit a polygon, infinite for a miss: `Polygon::cast` in lanes.
#[inline(always)]
fn distances<S: Simd, const R: usize>(
    simd: S,
    packet: &Packet<'_, R>,
    row: usize,
    second: usize,
    polygon: &Polygon,
    inside: bool,
) -> f64x8<S> {
    let origin = packet.rays.starts(simd, row, second);
    let direction = half(simd, &packet.rays.direction, row, second);
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
    let closing = unfused::product(simd, &polygon.normal, &direction);
    let seen = minus(&splat(&polygon.origin.coords), &origin);
    let distance = unfused::product(simd, &polygon.normal, &seen) / closing;
    if inside {
        return distance;
    }
    let point = [
        origin[0] + direction[0] * distance,
        origin[1] + direction[1] * distance,
        origin[2] + direction[2] * distance,
    ];
    let mut inside =
        distance.simd_gt(f64x8::splat(simd, 0.0)) & distance.simd_lt(f64x8::splat(simd, FARTHEST));
    for (inwards, edge) in &polygon.edges {
        inside &= unfused::product(simd, inwards, &point).simd_ge(f64x8::splat(simd, edge - EDGE_SLACK));
    }
    inside.select(distance, f64x8::splat(simd, f64::INFINITY))
}

/// Returns where the pyramid around the rays crosses a polygon's plane.
///
/// The plane cuts the pyramid in a convex outline whose corners are on the pyramid's edges. Rays with origins up to δ from
/// the apex deviate by at most δ(1 + 1/N·d) there.
#[inline(always)]
fn passes<S: Simd, const R: usize>(simd: S, packet: &Packet<'_, R>, polygon: &Polygon) -> Passes {
    let splat = inlined(
        #[inline(always)]
        |x: f64| f64x4::splat(simd, x),
    );
    let corner = inlined(
        #[inline(always)]
        |k: usize| {
            let [a, b, c, d] = packet.pyramid.corners[k];
            f64x4::simd_from(simd, [a.into(), b.into(), c.into(), d.into()])
        },
    );
    let (x, y, z) = (corner(0), corner(1), corner(2));
    let along = inlined(
        #[inline(always)]
        |v: &Vector3<f64>| x * splat(v.x) + y * splat(v.y) + z * splat(v.z),
    );
    let [sx, sy, sz] = packet.start.reference.map(f64::from);
    let n = &polygon.normal;
    let height =
        n.x * (polygon.origin.x - sx) + n.y * (polygon.origin.y - sy) + n.z * (polygon.origin.z - sz);
    let closing = along(n);
    let distance = splat(height) / closing;
    let (least, most) = (distance.reduce_min(), distance.reduce_max());
    // Covers the spread of the origins and all rounding.
    let apart = f64::from(packet.start.spread) + 1e-6 * (1.0 + f64::from(packet.start.reach));
    let flattest = closing.abs().reduce_min();
    let margin = apart * (1.0 + 2.0 / flattest);
    if !(least * flattest > 2.0 * apart && most < 0.5 * FARTHEST) {
        return Passes::Partly;
    }
    let mut inside = true;
    for (inwards, edge) in &polygon.edges {
        let start = inwards.x * sx + inwards.y * sy + inwards.z * sz;
        let over = along(inwards) * distance + splat(start - edge);
        if over.reduce_max() < -margin {
            return Passes::Outside;
        }
        inside &= over.reduce_min() > margin;
    }
    if inside { Passes::Inside } else { Passes::Partly }
}
