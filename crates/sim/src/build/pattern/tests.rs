//! Patterns are expanded in order, and refused if they cannot be.

use super::*;
use crate::scene::facet::tests::samples;
use crate::scene::{CopyList, FacetCopy, FacetShape, MirrorImage, Ring};

fn facet(name: &str, shape: FacetShape) -> Facet {
    Facet {
        name: name.to_owned(),
        shape,
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
    }
}

fn scene_with(patterns: Vec<Pattern>) -> Scene {
    let mut scene: Scene = toml::from_str(
        "schema_version = 1
name = \"copies\"",
    )
    .expect("it is a scene");
    scene.superstructure.facet = vec![facet("petal", samples().swap_remove(0))];
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
    let of_last = KeyPath::of("superstructure").key("facet").index(4).key("shape");
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
