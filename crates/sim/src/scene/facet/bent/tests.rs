//! Copies of curved mirrors, and refused radii.

use super::*;
use crate::build::pattern::{mirrored, turned};
use crate::scene::facet::tests::samples;
use catoptric_model::curve::{ConeCurve, RoundCurve};

fn facets() -> impl Iterator<Item = Facet> {
    let cone = Curve::Cone(ConeCurve {
        radius_mm: -300.0,
        half_angle_deg: 15.0,
        axis_deg: 25.0,
        touches_mm: [2.0, -1.5],
    });
    samples().into_iter().map(move |shape| Facet {
        name: String::new(),
        shape,
        curve: Some(cone),
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
    })
}

fn surface(facet: &Facet) -> (Vec<Point3<f64>>, CurvedSurface) {
    let corners = facet
        .shape
        .corners(&ScanGeometry::default())
        .expect("it is a mirror");
    let normal = Unit::new_normalize(area_vector(&corners));
    let curve = facet.bent(&corners).expect("it is bent");
    let surface = curve.over(&corners, &normal, 0.0).expect("it has a radius");
    (corners, surface)
}

/// Whether the copy of every point of a surface is on the copy of the surface.
fn is_carried(original: &Facet, copy: &Facet, by: &Matrix3<f64>) {
    let ((corners, was), (_, is)) = (surface(original), surface(copy));
    for share in [[0.7, 0.2, 0.1], [0.1, 0.3, 0.6], [0.0, 1.0, 0.0]] {
        let sum = corners[0].coords * share[0] + corners[1].coords * share[1] + corners[2].coords * share[2];
        let on_it = was.over(&Point3::from(sum)).expect("it is there");
        let expected = by * on_it;
        let normal = by * was.normal_at(&on_it).into_inner();
        let found = is.over(&expected).expect("it is there");
        assert!((found - expected).norm() < 1e-12, "{copy:?}: {found} {expected}");
        assert!(
            (is.normal_at(&found).into_inner() - normal).norm() < 1e-10,
            "{copy:?}"
        );
    }
}

#[test]
fn copies_of_a_curved_mirror_are_curved_alike() {
    let scan = ScanGeometry::default();
    for facet in facets() {
        for angle in [-97.0, 30.0, 300.0] {
            is_carried(&facet, &turned(&facet, String::new(), angle, &scan), &turn(angle));
        }
        for exchange in [Exchange::LeftRight, Exchange::UpDown] {
            let copy = mirrored(&facet, String::new(), &[exchange], &scan);
            is_carried(&facet, &copy, &image(exchange));
        }
        let twice = [Exchange::LeftRight, Exchange::UpDown];
        let back = mirrored(
            &mirrored(&facet, String::new(), &twice, &scan),
            String::new(),
            &twice,
            &scan,
        );
        let near = |a: f64, b: f64| (a - b).abs() < 1e-8;
        let (Some(Curve::Cone(a)), Some(Curve::Cone(b))) = (facet.curve, back.curve) else {
            panic!("it stays a cone");
        };
        assert!(near(a.axis_deg, b.axis_deg) && near(a.touches_mm[0], b.touches_mm[0]));
    }
}

fn complaints(facet: &Facet, mirror: &Mirror) -> Vec<String> {
    let mut found = Findings(Vec::new());
    let path = KeyPath::of("superstructure").key("facet").index(0);
    facet.check_bend(mirror, &ScanGeometry::default(), &path, &mut found);
    found.0.into_iter().map(|p| p.message).collect()
}

#[test]
fn a_radius_that_would_do_is_named_and_does() {
    let facet = facets().nth(3).expect("a rectangle");
    for sign in [1.0, -1.0] {
        let sphere = |radius_mm: f64| Facet {
            curve: Some(Curve::Sphere(RoundCurve {
                radius_mm,
                touches_mm: [0.0; 2],
            })),
            ..facet.clone()
        };
        let found = complaints(&sphere(sign * 20.0), &Mirror::default());
        assert_eq!(found.len(), 1, "{found:?}");
        let words: Vec<&str> = found[0].split_whitespace().collect();
        let at = words.iter().position(|w| *w == "or").expect("it names one");
        let least: f64 = words[at - 1].parse().expect("a number");
        assert!(
            complaints(&sphere(least), &Mirror::default()).is_empty(),
            "{found:?}"
        );
        // 70.2 × 30 mm: the corners are 38.17 mm away, and at 60° that is R·sin 60°; the body of a convex mirror has the
        // smaller radius.
        let exact = 38.17 / libm::sin(60.0_f64.to_radians()) + if sign < 0.0 { 1.0 } else { 0.0 };
        assert!((least.abs() - exact).abs() < 0.01, "{least} {exact}");
    }
}
