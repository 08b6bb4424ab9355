//! An edited layout equals the same layout analyzed from scratch, whatever was known before the edit.

use crate::scenes::{PROTOTYPE, TWO_MIRROR, scene};
use catoptric::layout::{Detail, Layout, analyze};
use catoptric::sim::Scene;
use catoptric::sim::build::Structure;
use catoptric::sim::light::{Edit, Mirrors, Setting};
use catoptric::sim::receive::Sensor;
use catoptric::sim::scene::{FacetShape, PolygonShape};
use catoptric_fixtures::ust20lx;
use nalgebra::{Point3, Rotation3, Vector3};
use proptest::prelude::*;

/// Rotates a facet about its first corner, shifts and scales it; the result is always a mirror.
fn change(scene: &mut Scene, facet: usize, turn: [f64; 3], shift_mm: [f64; 3], scale: f64) {
    let facets = &mut scene.superstructure.facet;
    let facet = facet % facets.len();
    let before = facets[facet].shape.corners(&Default::default()).unwrap();
    let (about, turn) = (before[0], Rotation3::new(Vector3::from(turn)));
    let place = |corner: &Point3<f64>| {
        let placed = about.coords * 1e3 + Vector3::from(shift_mm) + turn * (corner - about) * (1e3 * scale);
        placed.into()
    };
    facets[facet].shape = FacetShape::Polygon(PolygonShape {
        corners_mm: before.iter().map(place).collect(),
    });
}

/// Number of beams whose paths are followed again; all others are asserted to be unchanged.
fn affected(old: &Scene, new: &Scene) -> usize {
    let sensor = Sensor::new(old).unwrap();
    let structures = [old, new].map(|scene| Structure::nominal(scene).unwrap());
    let setting = |i: usize| {
        let scene = [old, new][i];
        Setting::new(scene, &structures[i], Mirrors::Attached, Vec::new()).unwrap()
    };
    let (before, after) = (setting(0), setting(1));
    let edit = Edit::between(&before, &after).unwrap();
    let is_concerned = |beam: &usize| {
        let rays: Vec<_> = sensor.seeking_rays(*beam);
        let (_, trail) = before.trace_with_trail(&rays);
        let affected = edit.may_change(&trail);
        if !affected {
            assert_eq!(trail, after.trace_with_trail(&rays).1, "beam {beam}");
        }
        affected
    };
    (0..ust20lx::COUNT).filter(is_concerned).count()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn an_edited_layout_is_bit_identical_to_the_new_one(
        two_mirror in any::<bool>(),
        edits in prop::collection::vec(
            (0_usize..64, prop::array::uniform3(-0.4..0.4), prop::array::uniform3(-40.0..40.0), 0.4..1.8),
            1..4,
        ),
        diffuse in any::<bool>(),
    ) {
        let mut scene = scene(if two_mirror { TWO_MIRROR } else { PROTOTYPE });
        scene.scanner.sub_rays = 5;
        // Its own seed gives mirrors with slope errors.
        let seed = diffuse.then_some(7);
        let mut layout = Layout::new(&scene, seed, Detail::Full).unwrap();
        for (facet, turn, shift_mm, scale) in edits {
            change(&mut scene, facet, turn, shift_mm, scale);
            layout = layout.edited(&scene).unwrap();
            prop_assert_eq!(layout.analysis().unwrap(), analyze(&scene, seed, Detail::Full).unwrap());
        }
    }

    #[test]
    fn paths_that_no_edit_affects_are_unchanged(
        facet in 0_usize..64,
        turn in prop::array::uniform3(-0.4..0.4),
        shift_mm in prop::array::uniform3(-40.0..40.0),
        scale in 0.4..1.8,
    ) {
        let mut old = scene(PROTOTYPE);
        old.scanner.sub_rays = 5;
        let mut new = old.clone();
        change(&mut new, facet, turn, shift_mm, scale);
        prop_assert!(affected(&old, &new) > 0);
    }
}

#[test]
fn an_edit_affects_its_own_beams_and_few_others() {
    let old = scene(PROTOTYPE);
    let facets = old.superstructure.facet.len();
    for facet in 0..facets {
        let mut new = old.clone();
        change(&mut new, facet, [0.02, -0.01, 0.03], [0.3, -0.2, 0.4], 1.02);
        let beams = affected(&old, &new);
        assert!(
            beams > 20 && beams < ust20lx::COUNT / 4,
            "{beams} beams for facet {facet}"
        );
    }
    assert_eq!(affected(&old, &old), 0);
}

#[test]
fn other_changes_are_analyzed_from_scratch() {
    let first = scene(PROTOTYPE);
    let layout = Layout::new(&first, None, Detail::Coarse).unwrap();
    let mut darker = first.clone();
    darker.superstructure.mirror.reflectivity = 0.4;
    let mut fewer = first.clone();
    fewer.superstructure.facet.pop();
    let mut posts = first.clone();
    posts.superstructure.post.clear();
    for changed in [darker, fewer, posts, scene(TWO_MIRROR)] {
        let edited = layout.edited(&changed).unwrap().analysis().unwrap();
        assert_eq!(edited, analyze(&changed, None, Detail::Coarse).unwrap());
    }
}
