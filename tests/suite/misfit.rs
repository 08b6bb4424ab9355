//! What a calibration says when something is not as the session says: it names what is wrong, and nothing where nothing is.
//! A few seeds of a few cases; `tests/misfit` has all of them over many.

use crate::scenes::TWO_MIRROR;
use catoptric::calib::{self, Method, Options};
use catoptric::files::scene::{load, parse};
use catoptric::model::assessment::{Cause, Doubt};
use catoptric::model::{Calibration, Dataset};
use catoptric::sim::{Laboratory, Scene};
use catoptric::study::{Contestant, Study, merge, run, summarize};
use std::path::Path;

fn with(sets: &[&str]) -> Scene {
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    parse(TWO_MIRROR, "two-mirror.toml", &sets).expect("the case is valid")
}

fn recorded(scene: &Scene, seed: u64) -> Dataset {
    let laboratory = Laboratory::new(scene, seed).expect("the scene is valid");
    laboratory.dataset().expect("it is recorded")
}

fn calibrated(dataset: &Dataset) -> Calibration {
    calib::calibrate(dataset, Method::Joint, &Options::default()).expect("it can be calibrated")
}

/// The doubts of a calibration, each of which is a warning too.
fn doubts(scene: &Scene, seed: u64) -> Vec<Doubt> {
    let calibration = calibrated(&recorded(scene, seed));
    let doubts = calibration.assessment.expect("joint assesses itself").doubts;
    for doubt in &doubts {
        assert!(
            calibration.warnings.iter().any(|w| w.contains(&doubt.message)),
            "{doubt:?}"
        );
    }
    doubts
}

/// The first doubt is about this, in each of some seeds.
fn names(cause: Cause, sets: &[&str]) {
    let scene = with(sets);
    for seed in 1..=3 {
        let found = doubts(&scene, seed);
        let causes = found.first().map(|d| d.causes.clone()).unwrap_or_default();
        assert!(causes.contains(&cause), "seed {seed}: {found:?}");
    }
}

#[test]
fn nothing_is_doubted_where_the_session_is_right() {
    for seed in 1..=4 {
        assert_eq!(doubts(&with(&[]), seed), [], "seed {seed}");
    }
    let glass = with(&[
        "superstructure.mirror.thickness_mm=3",
        "superstructure.mirror.glass={thickness_mm=3}",
    ]);
    assert_eq!(doubts(&glass, 1), []);
}

#[test]
fn a_drift_three_times_as_large_is_named() {
    names(
        Cause::Drift,
        &["errors.drift_sd_mm=2.64", "session.believed.drift_sd_mm=0.88"],
    );
}

#[test]
fn a_scanner_that_warms_up_is_named() {
    names(
        Cause::WarmUp,
        &["errors.warm_up={amplitude_mm=10,time_constant_s=60}"],
    );
}

#[test]
fn correlated_noise_is_named() {
    names(
        Cause::CorrelatedNoise,
        &["errors.correlated={sd_mm=3,time_constant_s=0.25}"],
    );
}

#[test]
fn a_scanner_that_smooths_its_readings_is_named() {
    for beams in [3, 5] {
        names(
            Cause::NeighborNoise,
            &[&format!("detection.median_of_beams={beams}")],
        );
    }
}

#[test]
fn boards_that_are_thicker_are_named() {
    let sets = [
        "board.0.thickness_mm=2",
        "session.boards=[{name=\"board\",thickness_mm=0}]",
    ];
    names(Cause::BoardThickness, &sets);
}

/// Glass of known thickness is part of the model: the same accuracy as without it, and distances to its front.
#[test]
fn glass_is_estimated_through() {
    let glass = [
        "superstructure.mirror.thickness_mm=3",
        "superstructure.mirror.glass={thickness_mm=3}",
    ];
    for method in [Method::Joint, Method::BeamGls] {
        let error = |sets: &[&str]| {
            let scene = with(sets);
            let laboratory = Laboratory::new(&scene, 1).expect("the scene is valid");
            let (dataset, truth) = (
                laboratory.dataset().expect("recorded"),
                laboratory.truth().expect("known"),
            );
            let found =
                calib::calibrate(&dataset, method, &Options::default()).expect("it can be calibrated");
            let score = catoptric::score(&dataset, &found, Some(&truth)).expect("in memory");
            let blind = catoptric::score(&dataset, &found, None).expect("in memory");
            (
                score.per_axis_rms_deg,
                score.distance_mm.rms,
                [blind.boards_mm.mean, blind.walls_mm.mean],
            )
        };
        let (plain, behind) = (error(&["superstructure.mirror.thickness_mm=3"]), error(&glass));
        assert!(
            (behind.0 / plain.0 - 1.0).abs() < 0.1,
            "{method:?}: {behind:?} against {plain:?}"
        );
        assert!(
            (behind.1 - plain.1).abs() < 0.3,
            "{method:?}: {behind:?} against {plain:?}"
        );
        // Judged by boards and walls alone, the longer path is no error of the calibration.
        for (behind, plain) in behind.2.into_iter().zip(plain.2) {
            assert!(
                (behind - plain).abs() < 0.5,
                "{method:?}: {behind} mm against {plain} mm"
            );
        }
        let ignored = error(&[&glass[..], &["session.glass.thickness_mm=0"]].concat());
        assert!(ignored.0 > 1.5 * behind.0, "{method:?}: {ignored:?}");
    }
}

/// Chapter 8's table: without corrections `joint` finds the biases from the boards.
#[test]
fn joint_hardly_needs_step_1() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scene = load(&folder.join("scenes/figure-10.toml"), &[]).expect("the scene is valid");
    let contestants = vec![
        Contestant::Method(Method::Joint),
        Contestant::Uncorrected(Method::Joint),
    ];
    let study = Study::of_scene(scene, 10, contestants);
    let mut runs = Vec::new();
    for job in study.jobs() {
        runs.extend(run(&study, job).expect("it runs"));
    }
    let summary = summarize(&study, &merge(&study, runs).expect("all are there"));
    for method in &summary.methods {
        let [low, high] = method.anees_bounds;
        assert!(
            (low..=high).contains(&method.anees),
            "{}: ANEES {}",
            method.method,
            method.anees
        );
        assert!(
            method.per_axis_rms_deg < 0.06,
            "{}: {}°",
            method.method,
            method.per_axis_rms_deg
        );
    }
}
