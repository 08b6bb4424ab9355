//! Mishaps and outliers: what a recording shows of them, and what a calibration makes of that. Of the estimator's blind
//! detection this proves that it finds what was put in and stays silent where nothing was; how often a smaller mishap
//! escapes it, it does not say.

use crate::scenes::{PROTOTYPE, TWO_MIRROR, scene};
use catoptric::calib::{self, Method, Options};
use catoptric::model::{Calibration, PoseKind};
use catoptric::score;
use catoptric::sim::scene::{Interference, MocapProfile};
use catoptric::sim::{Laboratory, Scene};

/// The first pose with a board before a facet.
fn first_facet_pose(laboratory: &Laboratory) -> u32 {
    let of_facet = |n: &usize| laboratory.truth().expect("known").poses[*n].kind == PoseKind::Facet;
    let first = (0..laboratory.stretches()).find(of_facet).expect("there is one");
    u32::try_from(first).expect("few poses")
}

/// The scene with a mishap in its first pose before a facet.
fn with_mishap(mut scene: Scene, what: &str) -> (Scene, u32) {
    let laboratory = Laboratory::new(&scene, scene.seed).expect("the scene is good");
    let pose = first_facet_pose(&laboratory);
    let mishap = format!("pose = {pose}\n{what}");
    scene.experiment.mishap = vec![toml::from_str(&mishap).expect("the test's own mishap parses")];
    (scene, pose)
}

fn calibrated(scene: &Scene, seed: u64, method: Method) -> (Calibration, catoptric::score::Score) {
    let laboratory = Laboratory::new(scene, seed).expect("the scene is good");
    let dataset = laboratory.dataset().expect("recorded");
    let calibration = calib::calibrate(&dataset, method, &Options::default()).expect("it calibrates");
    let scored = score(&dataset, &calibration, Some(&laboratory.truth().expect("known")));
    (calibration, scored)
}

#[test]
fn nothing_is_said_where_nothing_went_wrong() {
    for text in [PROTOTYPE, TWO_MIRROR] {
        for profile in [MocapProfile::Modern, MocapProfile::Cooper, MocapProfile::Ideal] {
            for seed in 1..=4 {
                let mut scene = scene(text);
                scene.mocap.profile = profile;
                let laboratory = Laboratory::new(&scene, seed).expect("the scene is good");
                let dataset = laboratory.dataset().expect("recorded");
                let (right, warnings) = calib::tracking::put_right(&dataset);
                assert!(matches!(right, std::borrow::Cow::Borrowed(_)));
                assert_eq!(warnings, Vec::<String>::new(), "{profile:?}, seed {seed}");
            }
        }
    }
}

#[test]
fn exchanged_labels_are_named_and_put_back() {
    let names = ["P_p1", "P_p2", "P_p3", "P_p4", "P_p5"];
    let clean = calibrated(&scene(TWO_MIRROR), 1, Method::BeamGls).1;
    for a in 0..names.len() {
        for b in a + 1..names.len() {
            let (first, second) = (names[a], names[b]);
            let what = format!("swapped_markers = [{first:?}, {second:?}]");
            let (scene, pose) = with_mishap(scene(TWO_MIRROR), &what);
            let (calibration, scored) = calibrated(&scene, 1, Method::BeamGls);
            assert_eq!(calibration.warnings.len(), 1, "{:?}", calibration.warnings);
            let warning = &calibration.warnings[0];
            let named = warning.contains(&format!("{first:?} and {second:?}"));
            assert!(
                warning.starts_with(&format!("pose {pose}: ")) && named,
                "{warning}"
            );
            assert!(
                warning.ends_with("its pose was solved anew with the labels put right"),
                "{warning}"
            );
            // The pose is solved from mean markers then, not averaged over the frames' poses: the same to the third digit.
            let ratio = scored.per_axis_rms_deg / clean.per_axis_rms_deg;
            assert!((ratio - 1.0).abs() < 0.02, "{first} and {second}: {ratio}");
        }
    }
}

#[test]
fn a_stray_label_and_a_board_that_moved_are_named_and_left_out() {
    let cases = [
        (
            "mislabelled = { marker = \"P_p3\", off_mm = [20, 0, 15] }",
            "\"P_p3\"",
        ),
        ("moved_mm = [0, 0, 4]", "moved by 4.0 mm"),
        ("moved_mm = [6, 0, 0]\nmoved_deg = [0, 1.5, 0]", "turned by 1.5°"),
    ];
    let clean = calibrated(&scene(TWO_MIRROR), 1, Method::BeamGls).1;
    for (what, said) in cases {
        let (with, pose) = with_mishap(scene(TWO_MIRROR), what);
        let (calibration, scored) = calibrated(&with, 1, Method::BeamGls);
        assert_eq!(calibration.warnings.len(), 1, "{:?}", calibration.warnings);
        let warning = &calibration.warnings[0];
        assert!(warning.starts_with(&format!("pose {pose}: ")), "{warning}");
        assert!(
            warning.contains(said) && warning.ends_with("the pose is left out"),
            "{warning}"
        );
        // One board fewer of its facet's; what is left is as honest.
        let ratio = scored.per_axis_rms_deg / clean.per_axis_rms_deg;
        assert!(
            ratio < 1.5 && scored.nees_mean < 2.0,
            "{what}: {ratio}, {}",
            scored.nees_mean
        );
    }
}

/// The same mishaps with nobody to find them cost far more: that is what the detection is worth.
#[test]
fn a_board_that_moved_spoils_a_calibration_that_believes_it() {
    let (with, _) = with_mishap(scene(TWO_MIRROR), "swapped_markers = [\"P_p1\", \"P_p2\"]");
    let laboratory = Laboratory::new(&with, 1).expect("the scene is good");
    let mut dataset = laboratory.dataset().expect("recorded");
    let truth = laboratory.truth().expect("known");
    let rms = |dataset: &_| {
        let calibration =
            calib::calibrate(dataset, Method::Beam, &Options::default()).expect("it calibrates");
        let scored = score(dataset, &calibration, Some(&truth));
        (scored.per_axis_rms_deg, scored.beams.solved)
    };
    let (found, solved) = rms(&dataset);
    for pose in &mut dataset.poses {
        pose.watched.clear();
    }
    let (believed, left) = rms(&dataset);
    assert!(
        believed > 1.5 * found || left < solved,
        "{believed}° with {left}, {found}° with {solved}"
    );
}

#[test]
fn outliers_cost_little() {
    let seeds = 1..=6_u64;
    let rms = |probability: f64, method| {
        let mut with = scene(TWO_MIRROR);
        if probability > 0.0 {
            with.errors.interference = Some(Interference {
                step_mm: 300.0,
                probability,
            });
        }
        let squares: f64 = seeds
            .clone()
            .map(|seed| calibrated(&with, seed, method).1.per_axis_rms_deg.powi(2))
            .sum();
        (squares / seeds.clone().count() as f64).sqrt()
    };
    for method in [Method::Joint, Method::BeamGls, Method::Beam] {
        let clean = rms(0.0, method);
        for probability in [0.01, 0.05, 0.15] {
            let ratio = rms(probability, method) / clean;
            assert!(ratio < 1.1, "{} with {probability}: {ratio}", method.name());
        }
    }
}
