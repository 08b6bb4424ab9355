//! Traversal of the triangle index by a packet of rays: boxes are tested against the packet's pyramid, triangles against
//! its rays in lanes.
//!
//! A ray hits a triangle if it passes all three edges on the same side. With the corners A, B, C relative to the origin,
//! the edge functions d·(B×(C−B)), d·(C×(A−C)) and d·(A×(B−A)) have one sign, and the distance is N·A/N·d, where N is
//! the normal. For an origin at an offset δ, (d×δ)·(B−C) is added to an edge function and N·δ/N·d is subtracted from the
//! distance. In f32 the error of each is bounded:
//!
//! - of a corner, by η = 3u(M + |O|) in each coordinate, where u is half a unit in the last place, M the largest
//!   coordinate of the mesh and O the reference;
//! - of an edge function, by (4η + 20u(R + 2|δ|))(L + 4η), where R is the distance to the farthest corner and L the
//!   longest edge: a corner that moves by η turns the edge seen from the origin, but a ray that hits the triangle is
//!   no farther than L from any corner, and so d·(η×C) = η·(C×d) ≤ ηL;
//! - of N·d, by 8ηL + 16uL²; below twice that the result is undecided;
//! - of the distance, by 2((4η + 16u(R + |δ|))|N| + 16uL³)/|N·d|: moved corners move the point on the triangle, no
//!   lever is longer than the triangle, and the factor 2 covers the error of N·d.
//!
//! So each ray has an interval that contains its nearest distance in f64. A certain hit that is certainly nearer replaces
//! it; overlapping intervals are decided in f64 at once ([`Judge`]); the f64 distances are computed at the end
//! ([`finish`](super::finish)).

use crate::hit::NONE;
use crate::index::traversal::Traversal;
use crate::index::wide::{Child, Leaf, Node, WIDTH, WideBvh};
use crate::lanes::{cross, dot, inlined, minus, size};
use crate::mesh::exact::Judge;
use crate::packet::cast::Packet;
use crate::packet::in_rows::InRows;
use crate::packet::rows::{LANES, Rows, Vectors, whole};
use crate::ray::FARTHEST;
use crate::rounding::{ROUNDING, around, downwards, upwards};
use fearless_simd::{Simd, prelude::*};
use fearless_simd::{f32x8, f32x16, u32x16};

/// Nearest hits of a packet so far.
pub(crate) struct Found<const R: usize> {
    /// Bounds of the nearest distance.
    low: Rows<f32, R>,
    high: Rows<f32, R>,
    triangle: Rows<u32, R>,
    /// Maximum of the upper bounds.
    limit: f32,
}

/// Precomputed numbers of eight triangles, indexed by [`At`].
type Facts = [[f32; WIDTH]; 25];

/// Indices into [`Facts`].
struct At;

impl At {
    /// B×(C−B), C×(A−C), A×(B−A).
    const CROSSES: usize = 0;
    /// B−C, C−A, A−B.
    const EDGES: usize = 9;
    const NORMAL: usize = 18;
    /// N·A.
    const HEIGHT: usize = 21;
    const EDGE_ERROR: usize = 22;
    const DISTANCE_ERROR: usize = 23;
    const LEAST_CLOSING: usize = 24;
}

impl<const R: usize> Found<R> {
    pub(crate) fn new(count: usize) -> Self {
        let farthest = upwards(FARTHEST);
        let mut found = Self {
            low: Rows::of(downwards(FARTHEST)),
            high: Rows::of(farthest),
            triangle: Rows::of(NONE),
            limit: farthest,
        };
        // Padding hits nothing.
        for ray in count..R * LANES {
            found.high.set(ray, f32::NEG_INFINITY);
        }
        found
    }

    /// Decides in f64 whether a ray hits a triangle, nearer than before.
    #[cold]
    #[inline(never)]
    fn decide(&mut self, judge: &Judge<'_>, rays: &InRows<'_, R>, number: usize, triangle: u32) {
        let ray = &rays.get(number);
        let Some(distance) = judge.meet(ray, triangle) else {
            return;
        };
        let present = match self.triangle.get(number) {
            NONE => FARTHEST,
            triangle => judge.distance(ray, triangle),
        };
        if distance < present || (distance == present && triangle < self.triangle.get(number)) {
            self.triangle.set(number, triangle);
            let (low, high) = around(distance);
            self.low.set(number, low);
            self.high.set(number, high);
        }
    }

    /// Returns the nearest triangle of every ray, [`NONE`] for a miss.
    pub(crate) fn triangles(&self) -> &[[u32; LANES]; R] {
        &self.triangle.0
    }
}

/// Traverses the index with a packet.
#[inline(always)]
pub(crate) fn follow<S: Simd, const R: usize>(
    simd: S,
    wide: &WideBvh,
    packet: &Packet<'_, R>,
    judge: &Judge<'_>,
    found: &mut Found<R>,
) {
    let boxes = inlined(
        #[inline(always)]
        |node: &Node, limit: f32| packet.pyramid.boxes(simd, &node.bounds, limit),
    );
    let visit = inlined(
        #[inline(always)]
        |child: Child| {
            let triangles = &wide.leaves[child.number()];
            leaf(simd, triangles, child.count(), wide.reach, packet, judge, found);
            found.limit
        },
    );
    Traversal::new().run(&wide.nodes, upwards(FARTHEST), boxes, visit);
}

#[inline(always)]
fn leaf<S: Simd, const R: usize>(
    simd: S,
    leaf: &Leaf,
    count: usize,
    reach: f32,
    packet: &Packet<'_, R>,
    judge: &Judge<'_>,
    found: &mut Found<R>,
) {
    let load = inlined(
        #[inline(always)]
        |corner: usize, axis: usize| f32x8::simd_from(simd, leaf.corners[corner][axis]),
    );
    let corner = inlined(
        #[inline(always)]
        |corner: usize| [load(corner, 0), load(corner, 1), load(corner, 2)],
    );
    let corners = [corner(0), corner(1), corner(2)];
    let mut hits = packet.pyramid.triangles(simd, &corners) & ((1 << count) - 1);
    if hits == 0 {
        return;
    }
    let facts = facts(simd, &corners, reach, packet);
    let mut changed = false;
    while hits != 0 {
        let lane = hits.trailing_zeros() as usize & 7;
        hits &= hits - 1;
        changed |= triangle(simd, &facts, lane, leaf.triangles[lane], packet, judge, found);
    }
    if changed {
        let mut limit = f32x16::splat(simd, f32::NEG_INFINITY);
        for row in 0..R {
            limit = limit.max(f32x16::simd_from(simd, found.high.0[row]));
        }
        found.limit = limit.reduce_max();
    }
}

#[inline(always)]
fn facts<S: Simd, const R: usize>(
    simd: S,
    corners: &[[f32x8<S>; 3]; 3],
    reach: f32,
    packet: &Packet<'_, R>,
) -> Facts {
    let splat = inlined(
        #[inline(always)]
        |x: f32| f32x8::splat(simd, x),
    );
    let seen = inlined(
        #[inline(always)]
        |corner: &[f32x8<S>; 3]| {
            [
                corner[0] - splat(packet.start.reference[0]),
                corner[1] - splat(packet.start.reference[1]),
                corner[2] - splat(packet.start.reference[2]),
            ]
        },
    );
    let [a, b, c] = [seen(&corners[0]), seen(&corners[1]), seen(&corners[2])];
    let (bc, ca, ab) = (minus(&b, &c), minus(&c, &a), minus(&a, &b));
    // (B − A)×(C − A).
    let normal = cross(&ca, &ab);
    let height = dot(&normal, &a);
    let far = size(&a).max(size(&b)).max(size(&c));
    let long = size(&bc).max(size(&ca)).max(size(&ab));
    let eta = splat(3.0 * ROUNDING * (reach + packet.start.reach));
    let spread = splat(packet.start.spread);
    let u = inlined(
        #[inline(always)]
        |times: f32| splat(times * ROUNDING),
    );
    let edge_error = spread.mul_add(u(40.0), far.mul_add(u(20.0), eta * 4.0)) * eta.mul_add(splat(4.0), long);
    let cube = long * long * long;
    let distance_error =
        ((far + spread).mul_add(u(16.0), eta * 4.0)).mul_add(size(&normal), cube * u(16.0)) * 2.0;
    let least_closing = long * (long.mul_add(u(16.0), eta * 8.0)) * 2.0;
    let mut facts = [[0.0; WIDTH]; 25];
    let mut put = inlined(
        #[inline(always)]
        |at: usize, value: f32x8<S>| value.store_slice(&mut facts[at]),
    );
    for (i, vector) in [cross(&bc, &b), cross(&ca, &c), cross(&ab, &a)]
        .iter()
        .enumerate()
    {
        for (k, coordinate) in vector.iter().enumerate() {
            put(At::CROSSES + 3 * i + k, *coordinate);
        }
    }
    if packet.apart() {
        for (i, vector) in [bc, ca, ab].iter().enumerate() {
            for (k, coordinate) in vector.iter().enumerate() {
                put(At::EDGES + 3 * i + k, *coordinate);
            }
        }
    }
    for (k, coordinate) in normal.iter().enumerate() {
        put(At::NORMAL + k, *coordinate);
    }
    put(At::HEIGHT, height);
    put(At::EDGE_ERROR, edge_error);
    put(At::DISTANCE_ERROR, distance_error);
    put(At::LEAST_CLOSING, least_closing);
    facts
}

/// Tests one triangle against all rays. Returns whether any nearest hit changed.
#[inline(always)]
fn triangle<S: Simd, const R: usize>(
    simd: S,
    facts: &Facts,
    lane: usize,
    number: u32,
    packet: &Packet<'_, R>,
    judge: &Judge<'_>,
    found: &mut Found<R>,
) -> bool {
    let fact = inlined(
        #[inline(always)]
        |at: usize| f32x16::splat(simd, facts[at][lane]),
    );
    let product = inlined(
        #[inline(always)]
        |v: &[f32x16<S>; 3], at: usize| {
            v[2].mul_add(fact(at + 2), v[1].mul_add(fact(at + 1), v[0] * fact(at)))
        },
    );
    let more = inlined(
        #[inline(always)]
        |v: &[f32x16<S>; 3], at: usize, sum: f32x16<S>| {
            v[2].mul_add(
                fact(at + 2),
                v[1].mul_add(fact(at + 1), v[0].mul_add(fact(at), sum)),
            )
        },
    );
    let mut changed = false;
    for row in 0..R {
        let load = inlined(
            #[inline(always)]
            |rows: &Vectors<f32, R>| whole(simd, rows, row),
        );
        let direction = load(&packet.direction);
        let edge = inlined(
            #[inline(always)]
            |i: usize| {
                let about = product(&direction, At::CROSSES + 3 * i);
                if packet.apart() {
                    more(&load(&packet.moment), At::EDGES + 3 * i, about)
                } else {
                    about
                }
            },
        );
        let (u, v, w) = (edge(0), edge(1), edge(2));
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let error = fact(At::EDGE_ERROR);
        let may = least.simd_ge(-error) | most.simd_le(error);
        if may.to_bitmask() == 0 {
            continue;
        }
        let inside = least.simd_gt(error) | most.simd_lt(-error);
        let closing = product(&direction, At::NORMAL);
        let mut height = fact(At::HEIGHT);
        if packet.apart() {
            height -= product(&load(&packet.offset), At::NORMAL);
        }
        let inverse = f32x16::splat(simd, 1.0) / closing;
        let distance = height * inverse;
        let error = fact(At::DISTANCE_ERROR) * inverse.abs();
        let (low, high) = (distance - error, distance + error);
        let sure = closing.abs().simd_gt(fact(At::LEAST_CLOSING));
        let (least, most) = (
            f32x16::simd_from(simd, found.low.0[row]),
            f32x16::simd_from(simd, found.high.0[row]),
        );
        let zero = f32x16::splat(simd, 0.0);
        let aside = sure & (low.simd_gt(most) | high.simd_lt(zero));
        let nearest = inside & sure & low.simd_gt(zero) & high.simd_lt(least) & most.simd_ge(zero);
        let (may, nearest_bits) = (may.to_bitmask() & !aside.to_bitmask(), nearest.to_bitmask());
        if nearest_bits != 0 {
            nearest.select(low, least).store_slice(&mut found.low.0[row]);
            nearest.select(high, most).store_slice(&mut found.high.0[row]);
            let present = u32x16::simd_from(simd, found.triangle.0[row]);
            let number = u32x16::splat(simd, number);
            nearest
                .select(number, present)
                .store_slice(&mut found.triangle.0[row]);
            changed = true;
        }
        let mut open = may & !nearest_bits;
        while open != 0 {
            let ray = row * LANES + open.trailing_zeros() as usize;
            open &= open - 1;
            if ray < packet.rays.count {
                found.decide(judge, &packet.rays, ray, number);
                changed = true;
            }
        }
    }
    changed
}
