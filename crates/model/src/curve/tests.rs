//! Curves against finite differences, circles and each other.

use super::*;
use crate::beam;

/// A tilted rectangle of 60 × 40 mm.
fn outline() -> (Vec<Point3<f64>>, Unit<Vector3<f64>>) {
    let normal = Unit::new_normalize(Vector3::new(-0.7, 0.2, 0.5));
    let [across, up] = axes(&normal);
    let center = Point3::new(0.07, 0.01, 0.0);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corner = |(x, y): (f64, f64)| center + across * (0.03 * x) + up * (0.02 * y);
    (corners.map(corner).to_vec(), normal)
}

fn curves() -> Vec<Curve> {
    let touches_mm = [4.0, -3.0];
    let round = |radius_mm| RoundCurve {
        radius_mm,
        touches_mm,
    };
    [90.0, -90.0]
        .into_iter()
        .flat_map(|radius_mm| {
            [
                Curve::Cylinder(CylinderCurve {
                    radius_mm,
                    axis_deg: 25.0,
                    touches_mm,
                }),
                Curve::Cone(ConeCurve {
                    radius_mm,
                    half_angle_deg: 20.0,
                    axis_deg: -70.0,
                    touches_mm,
                }),
                Curve::Sphere(round(radius_mm)),
                Curve::Paraboloid(round(radius_mm)),
            ]
        })
        .collect()
}

/// Points of an outline, over all of it.
fn points(corners: &[Point3<f64>]) -> impl Iterator<Item = Point3<f64>> {
    let step = |i: u32| f64::from(i) / 8.0;
    (0..=8).flat_map(move |i| {
        (0..=8).map(move |j| {
            corners[0] + (corners[1] - corners[0]) * step(i) + (corners[3] - corners[0]) * step(j)
        })
    })
}

/// First distance ahead at which a ray meets a surface.
fn ahead(surface: &CurvedSurface, from: &Point3<f64>, along: &Unit<Vector3<f64>>) -> f64 {
    let roots = surface.roots(from, along);
    roots.into_iter().flatten().find(|t| *t > 0.0).expect("it is met")
}

#[test]
fn a_bow_turns_the_edge_of_a_mirror_by_four_sagittae_over_its_length() {
    // 17 mm long: the beams at its ends turn by 0.135° and 0.539°, twice as far as the normal.
    let (normal, half) = (Vector3::z_axis(), [8.5e-3, 5e-3]);
    let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let corners = corners.map(|(x, y)| Point3::new(x * half[0], y * half[1], 0.0));
    for (bow_um, beam_deg) in [(5.0, 0.1348), (20.0, 0.5393), (-20.0, 0.5393)] {
        let curve = bow(bow_um, &corners, &normal).expect("it is bent");
        let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        let end = surface
            .over(&Point3::new(half[0], 1e-3, 0.0))
            .expect("it is there");
        assert!((end.z - bow_um * 1e-6).abs() < 1e-15, "{end}");
        let turned = surface.normal_at(&end).angle(&normal);
        let exact = 2.0 * libm::atan(end.z.abs() / half[0]);
        assert!((turned - exact).abs() < 1e-11, "{turned} {exact}");
        assert!((2.0 * turned.to_degrees() - beam_deg).abs() < 1e-4, "{turned}");
    }
    assert_eq!(bow(0.0, &corners, &normal), None);
    assert_eq!(bow(4251.0, &corners, &normal), None);
}

#[test]
fn a_surface_touches_its_plane_and_concave_ones_rise_above_it() {
    let (corners, normal) = outline();
    for curve in curves() {
        let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        let [x, y] = [4e-3, -3e-3];
        let [across, up] = axes(&normal);
        let touch = middle(&corners, &normal).expect("corners") + across * x + up * y;
        assert!((surface.over(&touch).expect("it is there") - touch).norm() < 1e-15);
        assert!(surface.normal_at(&touch).angle(&normal) < 1e-7);
        for point in points(&corners) {
            let on_it = surface.over(&point).expect("it reaches over the outline");
            let height = normal.dot(&(on_it - point));
            assert!(height * curve.radius_mm().0 >= -1e-15, "{curve:?} {height}");
            assert!(((on_it - point).norm() - height.abs()).abs() < 1e-15);
        }
    }
}

#[test]
fn the_curvature_of_a_surface_is_how_its_normal_turns() {
    let (corners, normal) = outline();
    const STEP: f64 = 1e-6;
    for curve in curves() {
        let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        for point in points(&corners).step_by(7) {
            let here = surface.over(&point).expect("it is there");
            let shape = surface.shape_at(&here);
            assert!((shape - shape.transpose()).norm() < 1e-12);
            for axis in axes(&normal) {
                let [before, after] = [-STEP, STEP].map(|s| surface.over(&(point + axis * s)).expect("near"));
                let turned = surface.normal_at(&after).into_inner() - surface.normal_at(&before).into_inner();
                let off = (turned + shape * (after - before)).norm() / (2.0 * STEP);
                assert!(off < 1e-6, "{curve:?} {off}");
            }
        }
    }
    // Principal curvatures: 1/R along both or one direction, and none along the line of a cone.
    for (curve, sum) in curves().into_iter().zip([1.0, 1.0, 2.0, 2.0]) {
        let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        let touch = surface.touches;
        let trace = surface.shape_at(&touch).trace() * 1e-3 * curve.radius_mm().0;
        assert!((trace - sum).abs() < 1e-12, "{curve:?} {trace}");
    }
}

#[test]
fn surfaces_of_different_depths_are_parallel() {
    let (corners, normal) = outline();
    const THICKNESS: f64 = 2e-3;
    for curve in curves() {
        let face = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        let behind = curve
            .over(&corners, &normal, -THICKNESS)
            .expect("it has a radius");
        for point in points(&corners) {
            let here = face.over(&point).expect("it is there");
            let along = face.normal_at(&here);
            let found = ahead(&behind, &here, &-along);
            // A surface parallel to a paraboloid is none: to fourth order in the distance from its vertex.
            let off = match curve {
                Curve::Paraboloid(_) => 2e-5,
                Curve::Cylinder(_) | Curve::Cone(_) | Curve::Sphere(_) => 1e-15,
            };
            assert!((found - THICKNESS).abs() < off, "{curve:?} {found}");
        }
    }
}

#[test]
fn a_beam_meets_the_plane_that_touches_where_it_hits() {
    let (corners, normal) = outline();
    for curve in curves() {
        let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
        let u = beam::direction(0.17);
        let plane = surface.plane_along(&u).expect("it is met");
        let point = Point3::from(u.into_inner() * plane.deflect(u).expect("it faces the beam").distance);
        assert!((ahead(&surface, &Point3::origin(), &u) - point.coords.norm()).abs() < 1e-15);
        assert!((surface.normal_at(&point).into_inner() - plane.normal.into_inner()).norm() < 1e-14);
    }
}

#[test]
fn a_radius_of_zero_is_no_surface() {
    let (corners, normal) = outline();
    let of = |radius_mm, ahead| {
        let touches_mm = [0.0; 2];
        Curve::Sphere(RoundCurve {
            radius_mm,
            touches_mm,
        })
        .over(&corners, &normal, ahead)
    };
    assert_eq!(of(0.0, 0.0), None);
    assert_eq!(of(-1.0, -2e-3), None);
    assert!(of(1.0, -2e-3).is_some());
}
