//! Mirrors that touch, meet, cover each other, or stand in the housing.

use crate::check::problems;
use crate::scene::{Facet, FacetShape, PolygonShape, Scene};
use nalgebra::Point3;

/// A scene of a scanner and facets, each with its corners in millimeters.
fn drawn(corners_mm: &[&[[f64; 3]]]) -> Scene {
    let mut scene: Scene = toml::from_str("schema_version = 1\nname = \"drawn\"").expect("a scene");
    let facet = |(i, corners): (usize, &&[[f64; 3]])| {
        let mut corners_mm = corners.to_vec();
        // Their order says which side reflects: the one toward the scanner.
        let points: Vec<Point3<f64>> = corners_mm.iter().map(|c| Point3::from(*c)).collect();
        if catoptric_cast::area_vector(&points).dot(&points[0].coords) > 0.0 {
            corners_mm.reverse();
        }
        Facet {
            name: format!("m{i}"),
            curve: None,
            bow_um: 0.0,
            two_sided: true,
            reflectivity: None,
            coating: None,
            shape: FacetShape::Polygon(PolygonShape { corners_mm }),
        }
    };
    scene.superstructure.facet = corners_mm.iter().enumerate().map(facet).collect();
    scene
}

fn messages(scene: &Scene) -> Vec<String> {
    problems(scene).into_iter().map(|p| p.message).collect()
}

/// A square of 20 mm on edge, 60 mm in front of the scanner.
const FRONT: [[f64; 3]; 4] = [
    [60.0, -10.0, -10.0],
    [60.0, 10.0, -10.0],
    [60.0, 10.0, 10.0],
    [60.0, -10.0, 10.0],
];

/// A square across it, from x = `from` to x = `to`, at y = `y`.
fn across(from: f64, to: f64, y: f64) -> [[f64; 3]; 4] {
    [[from, y, -8.0], [to, y, -8.0], [to, y, 8.0], [from, y, 8.0]]
}

#[test]
fn mirrors_that_pass_through_each_other_are_found_where_they_do() {
    let found = messages(&drawn(&[&FRONT, &across(50.0, 70.0, 3.0)]));
    assert_eq!(
        found,
        [
            "`superstructure.facet[1]` (\"m1\") passes through facet \"m0\" at (60, 3, 0) mm in the sensor frame"
        ]
    );
    let found = messages(&drawn(&[&across(50.0, 70.0, 3.0), &FRONT]));
    assert!(
        found.len() == 1 && found[0].contains("(60, 3, 0) mm"),
        "{found:?}"
    );
    // A pole that goes through the middle of a large mirror, without reaching its edge.
    let pole = [
        [50.0, -1.0, 2.0],
        [70.0, -1.0, 2.0],
        [70.0, 1.0, 2.0],
        [50.0, 1.0, 2.0],
    ];
    assert!(
        messages(&drawn(&[&FRONT, &pole]))
            .iter()
            .any(|m| m.contains("(60, 0, 2) mm"))
    );
}

#[test]
fn mirrors_in_one_plane_may_not_cover_each_other() {
    let shifted = FRONT.map(|[x, y, z]| [x, y + 15.0, z]);
    let found = messages(&drawn(&[&FRONT, &shifted]));
    assert!(
        found.len() == 1 && found[0].contains("(60, 7.45, 0) mm"),
        "{found:?}"
    );
    let beside = FRONT.map(|[x, y, z]| [x, y + 20.0, z]);
    assert_eq!(messages(&drawn(&[&FRONT, &beside])), [""; 0]);
}

#[test]
fn mirrors_may_touch() {
    // Along an edge, as in a row of facets; with an edge on the face; at a corner; by what drawings round.
    let edge = [
        [60.0, 10.0, -10.0],
        [80.0, 10.0, -10.0],
        [80.0, 10.0, 10.0],
        [60.0, 10.0, 10.0],
    ];
    let corner = [
        [60.0, 10.0, 10.0],
        [75.0, 25.0, 10.0],
        [75.0, 25.0, 30.0],
        [60.0, 10.0, 30.0],
    ];
    for other in [edge, across(60.0, 80.0, 3.0), corner, across(59.95, 80.0, 3.0)] {
        let found = messages(&drawn(&[&FRONT, &other]));
        assert!(!found.iter().any(|m| m.contains("passes through")), "{found:?}");
    }
    assert!(
        messages(&drawn(&[&FRONT, &across(59.85, 80.0, 3.0)]))
            .iter()
            .any(|m| m.contains("passes"))
    );
    // Planes that cross far outside one of the mirrors.
    let far = [
        [55.0, 30.0, -5.0],
        [65.0, 30.0, -5.0],
        [65.0, 30.0, 5.0],
        [55.0, 30.0, 5.0],
    ];
    assert_eq!(messages(&drawn(&[&FRONT, &far])), [""; 0]);
}

#[test]
fn a_mirror_may_not_stand_in_the_housing_or_in_its_window() {
    let at = |x: f64, half: f64| FRONT.map(|[_, y, z]| [x, 0.1 * half * y, 0.1 * half * z]);
    for (x, half) in [(22.0, 10.0), (22.0, 2.0), (24.8, 10.0)] {
        let found = messages(&drawn(&[&at(x, half)]));
        assert!(
            found
                .iter()
                .any(|m| m.contains("(\"m0\") passes through the scanner's housing")),
            "{x}: {found:?}"
        );
    }
    // Half the width of its 50 mm, and a touch.
    assert_eq!(messages(&drawn(&[&at(25.0, 10.0)])), [""; 0]);
    let mut without = drawn(&[&at(22.0, 10.0)]);
    without.scanner.housing = false;
    assert_eq!(messages(&without), [""; 0]);
}

#[test]
fn a_post_may_carry_a_mirror() {
    let mut scene = drawn(&[&FRONT]);
    let post = "name = \"holder\"\ncenter_mm = [60, 12, 0]\nsize_mm = [6, 6, 40]";
    scene.superstructure.post = vec![toml::from_str(post).expect("a post")];
    assert_eq!(messages(&scene), [""; 0]);
}
