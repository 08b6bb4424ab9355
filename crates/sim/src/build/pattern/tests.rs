//! Compares copies with closed forms: reflected and rotated corners.

use super::*;
use crate::build::layout;
use crate::scene::Plate;
use crate::scene::{CopyList, FacetCopy, MirrorImage, PolygonShape, RectangleShape, Ring, Wedge};
use catoptric_cast::area_vector;
use catoptric_model::beam;
use nalgebra::{Point3, Rotation3, Vector3};

fn facet(name: &str, shape: FacetShape) -> Facet {
    Facet {
        name: name.to_owned(),
        shape,
        two_sided: false,
    }
}

fn corners(shape: &FacetShape) -> Option<Vec<Point3<f64>>> {
    layout::corners(shape, &ScanGeometry::default())
}

fn plate() -> Plate {
    Plate {
        azimuth_deg: None,
        beam: Some(800),
        distance_mm: 64.0,
        exit_azimuth_deg: Some(48.0),
        exit_elevation_deg: Some(35.0),
        normal_azimuth_deg: None,
        normal_elevation_deg: None,
        width_mm: 17.0,
        height_mm: 12.0,
    }
}

/// One shape of each kind, without symmetry.
fn shapes() -> Vec<FacetShape> {
    let wedge = FacetShape::Wedge(Wedge {
        azimuth_deg: [62.0, 77.0],
        distance_mm: 64.0,
        exit_azimuth_deg: 60.0,
        exit_elevation_deg: 50.0,
        height_mm: 12.0,
    });
    let by_normal = FacetShape::Plate(Plate {
        azimuth_deg: Some(70.0),
        beam: None,
        exit_azimuth_deg: None,
        exit_elevation_deg: None,
        normal_azimuth_deg: Some(-121.0),
        normal_elevation_deg: Some(-37.0),
        ..plate()
    });
    let rectangle = FacetShape::Rectangle(RectangleShape {
        center_mm: [-19.89, 66.89, 1.5],
        normal: [0.45, -0.33, -0.4036],
        width_mm: 70.2,
        height_mm: 30.0,
    });
    let polygon = FacetShape::Polygon(PolygonShape {
        corners_mm: vec![[30.0, 60.0, -6.0], [40.0, 50.0, -6.0], [35.0, 55.0, 9.0]],
    });
    vec![wedge, FacetShape::Plate(plate()), by_normal, rectangle, polygon]
}

/// Whether two outlines have the same corners in the same cyclic order, wherever the lists begin.
fn same_outline(found: &[Point3<f64>], wanted: &[Point3<f64>]) -> bool {
    let near = |start: usize| {
        (0..wanted.len()).all(|i| (found[(start + i) % found.len()] - wanted[i]).norm() < 1e-15)
    };
    found.len() == wanted.len() && (0..found.len()).any(near)
}

#[test]
fn a_mirror_image_has_the_reflected_corners() {
    for (exchange, sign) in [
        (Exchange::LeftRight, Vector3::new(1.0, -1.0, 1.0)),
        (Exchange::UpDown, Vector3::new(1.0, 1.0, -1.0)),
    ] {
        for shape in shapes() {
            let own = corners(&shape).expect("it is a mirror");
            let image = mirrored(
                &facet("a", shape.clone()),
                "b".to_owned(),
                &[exchange],
                &ScanGeometry::default(),
            );
            let found = corners(&image.shape).expect("so is its image");
            // A reflection turns counter-clockwise order into clockwise order.
            let reflected = own
                .iter()
                .rev()
                .map(|c| Point3::from(c.coords.component_mul(&sign)));
            let wanted: Vec<Point3<f64>> = reflected.collect();
            assert!(
                same_outline(&found, &wanted),
                "{exchange:?} {shape:?}: {found:?} {wanted:?}"
            );
        }
    }
}

#[test]
fn a_turned_facet_has_the_turned_corners() {
    for turn in [-97.0_f64, 30.0, 145.0, 300.0] {
        let rotation = Rotation3::from_axis_angle(&Vector3::z_axis(), turn.to_radians());
        for shape in shapes() {
            let own = corners(&shape).expect("it is a mirror");
            let copy = turned(&facet("a", shape), "b".to_owned(), turn, &ScanGeometry::default());
            let found = corners(&copy.shape).expect("so is its copy");
            for (found, own) in found.iter().zip(&own) {
                assert!((found - rotation * own).norm() < 1e-14, "{turn} {found} {own}");
            }
        }
    }
}

#[test]
fn a_plate_sends_its_beam_in_the_requested_direction() {
    let corners = corners(&FacetShape::Plate(plate())).expect("it is a mirror");
    let normal = nalgebra::Unit::new_normalize(area_vector(&corners));
    let plane = catoptric_model::MirrorPlane::through(corners[0], normal);
    let azimuth = ScanGeometry::default().azimuth(800);
    let deflection = plane
        .deflect(beam::direction(azimuth))
        .expect("it faces the scanner");
    let wanted = beam::spherical(48.0_f64.to_radians(), 35.0_f64.to_radians());
    assert!(beam::angle_between(&deflection.exit_direction(azimuth), &wanted) < 1e-14);
    assert!((deflection.distance - 0.064).abs() < 1e-15);
    let center = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / 4.0;
    assert!((center - beam::direction(azimuth).into_inner() * 0.064).norm() < 1e-15);
    assert!(((corners[1] - corners[0]).norm() - 0.017).abs() < 1e-15);
}

fn scene_with(patterns: Vec<Pattern>) -> Scene {
    let mut scene: Scene = toml::from_str(
        "schema_version = 1
name = \"copies\"",
    )
    .expect("it is a scene");
    scene.superstructure.facet = vec![facet("petal", shapes().remove(0))];
    scene.superstructure.pattern = patterns;
    scene
}

#[test]
fn patterns_make_facets_in_order_and_may_build_on_one_another() {
    let expanded = expand(&scene_with(vec![
        Pattern::Ring(Ring {
            of: "petal".to_owned(),
            count: 3,
            step_deg: Some(20.0),
        }),
        Pattern::MirrorImage(MirrorImage {
            of: vec!["petal-2".to_owned()],
            across: vec![Exchange::LeftRight, Exchange::UpDown],
            names: Some(vec!["other".to_owned()]),
        }),
        Pattern::List(CopyList {
            of: "other".to_owned(),
            copy: vec![FacetCopy {
                name: "last".to_owned(),
                turn_deg: -20.0,
                across: vec![Exchange::UpDown],
            }],
        }),
    ]))
    .expect("all names are known");
    let facets = &expanded.scene.superstructure.facet;
    let names: Vec<&str> = facets.iter().map(|f| f.name.as_str()).collect();
    assert_eq!(names, ["petal", "petal-2", "petal-3", "other", "last"]);
    assert_eq!(
        (expanded.drawn, expanded.made_by.as_slice()),
        (1, &[0, 0, 1, 2][..])
    );
    assert!(expanded.scene.superstructure.pattern.is_empty());
    let wedge = |i: usize| match &facets[i].shape {
        FacetShape::Wedge(w) => (w.azimuth_deg, w.exit_azimuth_deg, w.exit_elevation_deg),
        other => panic!("{other:?}"),
    };
    assert_eq!(wedge(2), ([102.0, 117.0], 100.0, 50.0));
    assert_eq!(wedge(3), ([-97.0, -82.0], -80.0, -50.0));
    assert_eq!(wedge(4), ([-117.0, -102.0], -100.0, 50.0));
    let of_last = Path::of("superstructure").key("facet").index(4).key("shape");
    let (pattern, name) = expanded.origin(&of_last).expect("a pattern made it");
    assert_eq!(
        (pattern.to_string().as_str(), name),
        ("superstructure.pattern[2]", "last")
    );
}

#[test]
fn patterns_that_cannot_be_expanded_are_reported() {
    let problems = expand(&scene_with(vec![
        Pattern::Ring(Ring {
            of: "pedal".to_owned(),
            count: 3,
            step_deg: None,
        }),
        Pattern::MirrorImage(MirrorImage {
            of: vec!["petal".to_owned()],
            across: vec![Exchange::UpDown],
            names: Some(vec![]),
        }),
    ]))
    .expect_err("one is misspelled, one has no name");
    assert_eq!(problems[0].path.to_string(), "superstructure.pattern[0].ring.of");
    assert_eq!(problems[0].help.as_deref(), Some("did you mean \"petal\"?"));
    assert!(
        problems[1].message.contains("0 names for 1 images"),
        "{problems:?}"
    );
}
