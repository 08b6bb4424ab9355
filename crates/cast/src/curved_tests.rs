//! Curved mirrors against independent roots: each shape in its own textbook form, solved another way.

use crate::packet::Rays;
use crate::random::Draws;
use crate::ray::Ray;
use crate::shape::Shape;
use crate::solid::{Curved, Polygon};
use crate::world::World;
use catoptric_model::Curve;
use catoptric_model::curve::{ConeCurve, CylinderCurve, RoundCurve};
use nalgebra::{Point3, Unit, Vector3};
use std::sync::Arc;

const RADIUS: f64 = 0.05;
const HALF_ANGLE: f64 = 0.5;
/// Direction of the axis of cylinder and cone in the plane.
const AXIS: f64 = 0.4;
const HALF: [f64; 2] = [0.03, 0.02];

/// The shapes by their implicit equations about their own centers and axes, in the frame whose plane z = 0 they touch at
/// the origin; `side` is 1 for a concave mirror.
fn implicit(kind: usize, side: f64, p: &Vector3<f64>) -> f64 {
    let (sin, cos) = libm::sincos(AXIS);
    let center = Vector3::new(0.0, 0.0, side * RADIUS);
    match kind {
        // Distance from the axis, from the apex along the axis, from the center, and from focus and directrix.
        0 => {
            let axis = Vector3::new(cos, sin, 0.0);
            (p - center).cross(&axis).norm() - RADIUS
        }
        1 => {
            let line = Vector3::new(cos, sin, 0.0);
            let apex = -line * (RADIUS / libm::tan(HALF_ANGLE));
            let axis = line * libm::cos(HALF_ANGLE) + Vector3::z() * (side * libm::sin(HALF_ANGLE));
            let from = p - apex;
            from.cross(&axis).norm() * libm::cos(HALF_ANGLE) - from.dot(&axis) * libm::sin(HALF_ANGLE)
        }
        2 => (p - center).norm() - RADIUS,
        _ => {
            let focus = Vector3::new(0.0, 0.0, side * 0.5 * RADIUS);
            (p - focus).norm() - (p.z * side + 0.5 * RADIUS)
        }
    }
}

/// Whether a point of a shape is on the sheet that touches the plane, by its normal, and within the outline.
fn belongs(kind: usize, side: f64, p: &Vector3<f64>) -> bool {
    let slope = slope(kind, side, p);
    slope.z * side < 0.0 && p.x.abs() <= HALF[0] && p.y.abs() <= HALF[1]
}

/// Gradient of the implicit function, by central differences.
fn slope(kind: usize, side: f64, p: &Vector3<f64>) -> Vector3<f64> {
    const STEP: f64 = 1e-6;
    Vector3::from_fn(|k, _| {
        let mut step = Vector3::zeros();
        step[k] = STEP;
        (implicit(kind, side, &(p + step)) - implicit(kind, side, &(p - step))) / (2.0 * STEP)
    })
}

/// First distance at which a ray crosses the shape where it belongs to the mirror: by steps that no crossing in the
/// mirror's surroundings escapes, then by bisection. Both crossings of a step that touches the surface are missed.
fn bisected(kind: usize, side: f64, ray: &Ray) -> Option<f64> {
    const STEP: f64 = 2e-4;
    let at = |t: f64| ray.origin.coords + ray.direction.into_inner() * t;
    let value = |t: f64| implicit(kind, side, &at(t));
    // Nothing is farther than this from the origin, where the mirror is.
    let near = -ray.origin.coords.dot(&ray.direction);
    let from = (near - 0.06).max(0.0);
    let mut low = from;
    while low < near + 0.06 {
        let high = low + STEP;
        if (value(low) < 0.0) != (value(high) < 0.0) {
            let (mut a, mut b) = (low, high);
            for _ in 0..60 {
                let middle = 0.5 * (a + b);
                if (value(a) < 0.0) == (value(middle) < 0.0) {
                    a = middle;
                } else {
                    b = middle;
                }
            }
            if belongs(kind, side, &at(a)) {
                return Some(a);
            }
        }
        low = high;
    }
    None
}

fn mirror(kind: usize, side: f64) -> Curved {
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| Point3::new(x * HALF[0], y * HALF[1], 0.0));
    let outline = Polygon::new(corners.to_vec()).expect("it has an area");
    let radius_mm = 1e3 * side * RADIUS;
    let (axis_deg, touches_mm) = (AXIS.to_degrees(), [0.0; 2]);
    let round = RoundCurve {
        radius_mm,
        touches_mm,
    };
    let curve = match kind {
        0 => Curve::Cylinder(CylinderCurve {
            radius_mm,
            axis_deg,
            touches_mm,
        }),
        1 => Curve::Cone(ConeCurve {
            radius_mm,
            half_angle_deg: HALF_ANGLE.to_degrees(),
            axis_deg,
            touches_mm,
        }),
        2 => Curve::Sphere(round),
        _ => Curve::Paraboloid(round),
    };
    let surface = curve.over(&outline.corners, &outline.normal, 0.0);
    Curved::new(outline, surface.expect("it has a radius")).expect("it reaches over the outline")
}

/// Rays from all around toward the mirror and past it, from either side.
fn rays(row: u64, count: usize) -> Vec<Ray> {
    let mut draws = Draws::new(7, row);
    let mut ray = || {
        let origin = Point3::from(draws.normal3() * 0.1);
        let towards = draws.normal3().component_mul(&Vector3::new(0.02, 0.015, 0.004));
        Ray {
            origin,
            direction: Unit::new_normalize(towards - origin.coords),
        }
    };
    (0..count).map(|_| ray()).collect()
}

fn each() -> impl Iterator<Item = (usize, f64)> {
    (0..4).flat_map(|kind| [(kind, 1.0), (kind, -1.0)])
}

#[test]
fn rays_hit_where_independent_roots_are() {
    for (kind, side) in each() {
        let curved = mirror(kind, side);
        let (mut hits, mut misses, mut behind, mut grazing) = (0, 0, 0, 0);
        for ray in rays(kind as u64, 3000) {
            let found = curved.cast(&ray);
            if let Some(t) = found {
                let point = ray.origin + ray.direction.into_inner() * t;
                // On the surface, whatever else is near.
                assert!(
                    implicit(kind, side, &point.coords).abs() < 1e-15,
                    "{kind} {side} {ray:?}"
                );
                let gradient = slope(kind, side, &point.coords) * -side;
                let normal = curved.normal(&ray, t);
                assert!((normal.into_inner() - gradient.normalize()).norm() < 1e-9);
                behind += usize::from(normal.dot(&ray.direction) > 0.0);
                let slant = normal.dot(&ray.direction).abs();
                if slant < 0.1 {
                    // Bisection is as ill-conditioned as the root itself, and steps miss two crossings that are near.
                    grazing += 1;
                    continue;
                }
            }
            let expected = bisected(kind, side, &ray);
            match (found, expected) {
                (Some(t), Some(s)) => {
                    hits += 1;
                    assert!((t - s).abs() < 1e-12 * s.max(0.1), "{kind} {side} {t} {s}");
                }
                (None, None) => misses += 1,
                _ => panic!("{kind} {side} {found:?} {expected:?} {ray:?}"),
            }
        }
        assert!(
            hits > 1000 && misses > 300 && behind > 300 && grazing > 10,
            "{kind} {side}: {hits} {misses} {behind} {grazing}"
        );
    }
}

#[test]
fn of_two_roots_within_the_outline_the_first_counts_from_either_side() {
    let curved = mirror(2, 1.0);
    let z = 0.004;
    let across = (RADIUS * RADIUS - (RADIUS - z) * (RADIUS - z)).sqrt();
    for (start, first) in [(-0.2, 0.2 - across), (0.0, across)] {
        let ray = Ray {
            origin: Point3::new(start, 0.0, z),
            direction: Vector3::x_axis(),
        };
        let found = curved.cast(&ray).expect("it is hit");
        assert!((found / first - 1.0).abs() < 1e-14, "{found} {first}");
    }
    // Beyond the sphere there is nothing, and the far side of it is no part of the mirror.
    let above = Ray {
        origin: Point3::new(0.0, 0.0, 1.0),
        direction: -Vector3::z_axis(),
    };
    assert!((curved.cast(&above).expect("it is hit") - 1.0).abs() < 1e-15);
    let away = Ray {
        origin: Point3::new(0.0, 0.0, 0.03),
        direction: Vector3::z_axis(),
    };
    assert_eq!(curved.cast(&away), None);
}

#[test]
fn a_tangent_ray_touches_and_one_beside_it_misses() {
    let curved = mirror(2, -1.0);
    let at = |z: f64| Ray {
        origin: Point3::new(-0.1, 0.0, z),
        direction: Vector3::x_axis(),
    };
    assert_eq!(curved.cast(&at(1e-12)), None);
    let touched = curved.cast(&at(0.0)).expect("it is touched");
    assert!((touched - 0.1).abs() < 1e-9, "{touched}");
    let cut = curved.cast(&at(-1e-6)).expect("it is cut");
    let chord = (RADIUS * RADIUS - (RADIUS - 1e-6) * (RADIUS - 1e-6)).sqrt();
    assert!((cut - (0.1 - chord)).abs() < 1e-12, "{cut}");
}

/// Along a circle every chord turns by the same angle: light that enters a concave mirror flat follows its wall.
#[test]
fn light_follows_a_concave_wall_in_equal_chords() {
    let curved = mirror(2, 1.0);
    let world = World::new(vec![Shape::Curved(Arc::new(curved.clone()))]);
    // At 30° up the wall, leaving 10° above it.
    let (up, leave) = (30.0_f64.to_radians(), 10.0_f64.to_radians());
    let at = |angle: f64| {
        let (sin, cos) = libm::sincos(angle);
        (
            Point3::new(RADIUS * sin, 0.0, RADIUS * (1.0 - cos)),
            Vector3::new(cos, 0.0, sin),
            Vector3::new(-sin, 0.0, cos),
        )
    };
    let (mut angle, mut chords) = (-up, 0);
    loop {
        let (origin, along, inward) = at(angle);
        let direction = Unit::new_normalize(along * libm::cos(leave) + inward * libm::sin(leave));
        let ray = Ray { origin, direction };
        let Some(hit) = world.cast(&ray, Some(0)) else {
            break;
        };
        let mut packed = vec![None; 20];
        let rays: Rays = std::iter::repeat_n(ray, 20).collect();
        world.cast_packets(&rays, Some(0), &mut packed);
        assert!(packed.iter().all(|h| *h == Some(hit)));
        assert!((hit.distance - 2.0 * RADIUS * libm::sin(leave)).abs() < 1e-15);
        assert!((hit.closing + libm::sin(leave)).abs() < 1e-12 && hit.front());
        angle += 2.0 * leave;
        chords += 1;
        let expected = at(angle).0;
        assert!((world.surface_point(&hit, &ray).point - expected).norm() < 1e-15);
    }
    // The outline ends 36.9° up the wall.
    assert_eq!(chords, 3);
}

#[test]
fn packets_find_what_single_rays_find() {
    let shapes = each().map(|(kind, side)| Shape::Curved(Arc::new(mirror(kind, side))));
    let world = World::new(shapes.collect());
    let mut draws = Draws::new(7, 99);
    let origin = Point3::new(0.02, -0.1, 0.12);
    let ray = |draws: &mut Draws| {
        let towards = draws.normal3() * 0.004;
        Ray {
            origin,
            direction: Unit::new_normalize(towards - origin.coords),
        }
    };
    let single: Vec<Ray> = (0..400).map(|_| ray(&mut draws)).collect();
    let rays: Rays = single.iter().copied().collect();
    for except in [None, Some(3)] {
        let mut hits = vec![None; rays.len()];
        world.cast_packets(&rays, except, &mut hits);
        for (ray, hit) in single.iter().zip(&hits) {
            assert_eq!(*hit, world.cast(ray, except));
        }
        assert!(hits.iter().flatten().count() > 300);
    }
}

#[test]
fn triangles_are_as_near_as_stated_and_rims_are_theirs() {
    for (kind, side) in each() {
        let curved = mirror(kind, side);
        let triangles = curved.triangles();
        let (mut worst, mut area) = (0.0_f64, 0.0);
        for [a, b, c] in &triangles {
            for corner in [a, b, c] {
                assert!(implicit(kind, side, &corner.coords).abs() < 1e-15);
            }
            let flat = (b - a).cross(&(c - a));
            assert!(flat.z > 0.0, "counter-clockwise seen from the front");
            area += 0.5 * flat.z;
            for share in [[1.0, 1.0, 1.0], [1.0, 1.0, 0.0], [0.0, 1.0, 1.0], [1.0, 0.0, 1.0]] {
                let sum: f64 = share.iter().sum();
                let middle = (a.coords * share[0] + b.coords * share[1] + c.coords * share[2]) / sum;
                worst = worst.max(implicit(kind, side, &middle).abs());
            }
        }
        assert!((area / (4.0 * HALF[0] * HALF[1]) - 1.0).abs() < 1e-12);
        assert!(
            worst <= curved.chord_error() && worst > 0.03 * curved.chord_error(),
            "{kind} {side}: {worst}"
        );
        let rim = curved.rim();
        let is_corner = |p: &Point3<f64>| triangles.iter().flatten().any(|c| (c - p).norm() < 1e-15);
        assert!(rim.iter().all(is_corner));
    }
}

#[test]
fn its_box_holds_it() {
    for (kind, side) in each() {
        let shape = Shape::Curved(Arc::new(mirror(kind, side)));
        let (low, high) = shape.corners_of_box();
        for corner in shape.triangles().into_iter().flatten() {
            assert!((0..3).all(|k| low[k] <= corner[k] && corner[k] <= high[k]));
        }
    }
}
