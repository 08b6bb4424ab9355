//! `catoptric::testing`: all generated scenes are valid, and its gates detect what they are for, with few false alarms.
//!
//! The quantiles are covered by the unit tests of `study`.

use crate::scenes::scene;
use catoptric::calib::{CalibError, Calibrator, Method};
use catoptric::model::{Calibration, Dataset};
use catoptric::sim::noise::{Draws, Purpose};
use catoptric::sim::{Laboratory, Scene, check};
use catoptric::testing::{
    Anees, Bias, Coverage, Drawn, Efficiency, Failure, Significance, Trial, closure, deterministic, layouts,
    scenes, trials, without_errors,
};
use proptest::prelude::*;
use proptest::strategy::ValueTree;
use proptest::test_runner::{RngSeed, TestRunner};
use std::sync::atomic::{AtomicU32, Ordering};

/// A method whose calibration is modified afterwards.
struct Changed<F>(Method, F);

impl<F: Fn(&mut Calibration)> Calibrator for Changed<F> {
    fn name(&self) -> &str {
        "changed"
    }

    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError> {
        let mut calibration = Calibrator::calibrate(&self.0, dataset)?;
        (self.1)(&mut calibration);
        Ok(calibration)
    }
}

fn reference() -> Scene {
    let mut scene = scene(include_str!("../../scenes/reference-facet.toml"));
    scene.experiment.scans_per_pose = 10;
    scene
}

fn runner(cases: u32) -> TestRunner {
    TestRunner::new(ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(7),
        ..ProptestConfig::default()
    })
}

#[test]
fn every_scene_passes_check_and_can_be_set_up() {
    runner(200)
        .run(&scenes(), |scene| {
            prop_assert_eq!(check::problems(&scene), Vec::new());
            let laboratory = Laboratory::new(&scene, scene.seed);
            prop_assert!(laboratory.is_ok(), "{:?}", laboratory.err());
            Ok(())
        })
        .unwrap();
    // Layouts are not filtered at all.
    runner(300)
        .run(&layouts(), |scene| {
            prop_assert_eq!(check::problems(&scene), Vec::new());
            Ok(())
        })
        .unwrap();
}

#[test]
fn a_failed_property_is_shown_in_a_few_lines() {
    let tree = scenes().new_tree(&mut runner(1)).unwrap();
    let scene = tree.current();
    for shown in [format!("{scene:?}"), format!("{scene:#?}")] {
        assert!(
            shown.lines().count() <= 1 + scene.superstructure.facet.len(),
            "{shown}"
        );
        assert!(
            shown.contains(&format!("seed {}", scene.seed)) && shown.contains("left-1: Wedge(Wedge {"),
            "{shown}"
        );
    }
}

#[test]
fn scenes_shrink_to_the_simplest() {
    let mut runner = runner(1);
    for _ in 0..3 {
        let mut tree = scenes().new_tree(&mut runner).unwrap();
        while tree.simplify() {}
        let simplest = tree.current();
        let simple = &simplest.superstructure.facet;
        assert_eq!(simple.len(), 1, "{simple:?}");
        assert_eq!(simple[0].name, "left-1");
        assert_eq!(simplest.scanner.preset, catoptric::sim::scene::Preset::Ust20lx);
        assert_eq!(simplest.scanner.sub_rays, 1);
        assert_eq!(
            (simplest.room.size_m, simplest.room.rig_yaw_deg),
            ([7.0, 7.0, 4.4], 0.0)
        );
        assert_eq!((simplest.seed, simplest.board.len()), (1, 1));
    }
}

#[test]
fn a_bias_of_a_twentieth_of_a_degree_fails_closure() {
    let scene = without_errors(reference());
    closure(&scene, 3, &Method::Beam, 1e-9).unwrap();
    let biased = Changed(Method::Beam, |c: &mut Calibration| {
        for elevation in c.beams.iter_mut().filter_map(|b| b.elevation_rad.as_mut()) {
            *elevation += 0.05_f64.to_radians();
        }
    });
    match closure(&scene, 3, &biased, 1e-4) {
        Err(failure @ Failure::Off { .. }) => {
            let text = failure.to_string();
            assert!(
                text.starts_with("seed 3: beam ") && text.contains("8.7266"),
                "{text}"
            );
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn honest_methods_pass_and_a_covariance_four_times_too_small_fails() {
    let significance = Significance::PER_MILLE.among(3);
    let honest = trials(&reference(), 1..=40, &Method::BeamGls).unwrap();
    Anees::over(&honest).gate(significance).unwrap();
    Coverage::over(&honest, 0.95).gate(significance).unwrap();
    // It does not use facets, so its efficiency is a fourth of the optimum.
    assert!(matches!(
        Efficiency::over(&honest).gate(0.9, significance),
        Err(Failure::Gate { .. })
    ));
    let proud = Changed(Method::BeamGls, |c: &mut Calibration| {
        for p in c.beams.iter_mut().filter_map(|b| b.covariance_rad2.as_mut()) {
            *p = p.map(|row| row.map(|v| 0.25 * v));
        }
    });
    let proud = trials(&reference(), 1..=40, &proud).unwrap();
    for failure in [
        Anees::over(&proud).gate(significance).unwrap_err(),
        Coverage::over(&proud, 0.95).gate(significance).unwrap_err(),
    ] {
        let text = failure.to_string();
        assert!(
            text.contains("over-confident") && text.contains("the worst is seed "),
            "{text}"
        );
        assert!(text.contains("significance 3.33"), "{text}");
    }
}

#[test]
fn a_global_counter_fails_determinism() {
    let scene = without_errors(reference());
    deterministic(&scene, 1, &Method::Beam, &[1, 2, 7]).unwrap();
    let counter = AtomicU32::new(0);
    let counting = Changed(Method::Beam, |c: &mut Calibration| {
        let count = f64::from(counter.fetch_add(1, Ordering::Relaxed));
        for d in c.beams.iter_mut().filter_map(|b| b.distance_m.as_mut()) {
            *d += 1e-15 * count;
        }
    });
    let failure = deterministic(&scene, 1, &counting, &[1, 2]).unwrap_err();
    assert!(
        failure.to_string().contains("second run on 1 threads"),
        "{failure}"
    );
}

/// 4000 jobs of 50 honest, efficient trials each: at 1 %, 40 false alarms are expected, 18 to 62 within 3.5 standard
/// deviations. A share of 50 is discrete, so the coverage gate may fail less often, never more.
#[test]
fn false_alarms_are_as_rare_as_the_significance_states() {
    const JOBS: u64 = 4000;
    let mut alarms = [0; 3];
    for job in 0..JOBS {
        let mut draws = Draws::new(job, Purpose::Reading, 0);
        let trials: Vec<Trial> = (0..50)
            .map(|seed| {
                draws.seek(seed);
                // χ² with two degrees of freedom.
                let mut square = || Some(-2.0 * (1.0 - draws.uniform()).ln());
                let (stated, bound) = (square(), square());
                let drawn = Some(Drawn {
                    beam: 1,
                    stated,
                    bound,
                });
                Trial {
                    seed,
                    drawn,
                    mean_error: None,
                }
            })
            .collect();
        let gates = [
            Anees::over(&trials).gate(Significance::PER_CENT),
            Efficiency::over(&trials).gate(1.0, Significance::PER_CENT),
            Coverage::over(&trials, 0.95).gate(Significance::PER_CENT),
        ];
        for (alarm, gate) in alarms.iter_mut().zip(gates) {
            *alarm += i32::from(gate.is_err());
        }
    }
    assert!(alarms[..2].iter().all(|a| (18..=62).contains(a)), "{alarms:?}");
    assert!((1..=62).contains(&alarms[2]), "{alarms:?}");
}

#[test]
fn what_cannot_be_judged_does_not_pass() {
    let abstaining = [Trial {
        seed: 1,
        drawn: None,
        mean_error: None,
    }];
    assert!(matches!(
        Anees::over(&abstaining).gate(Significance::PER_MILLE),
        Err(Failure::Nothing(_))
    ));
    let silent = Drawn {
        beam: 9,
        stated: None,
        bound: None,
    };
    let silent = [Trial {
        seed: 4,
        drawn: Some(silent),
        mean_error: None,
    }];
    let failure = Coverage::over(&silent, 0.95)
        .gate(Significance::PER_MILLE)
        .unwrap_err();
    assert!(failure.to_string().starts_with("seed 4: beam 9"), "{failure}");
}

/// Within what is stated, a constant error passes every gate on a covariance.
#[test]
fn a_constant_error_of_one_angle_is_a_bias() {
    let scene = scene(include_str!("../../scenes/two-mirror.toml"));
    let scene = Scene {
        experiment: catoptric::sim::scene::Experiment {
            scans_per_pose: 10,
            ..scene.experiment.clone()
        },
        scanner: catoptric::sim::scene::Scanner {
            sub_rays: 1,
            ..scene.scanner.clone()
        },
        ..scene
    };
    let significance = Significance::PER_MILLE;
    let off = 0.05_f64.to_radians();
    let shifted = Changed(Method::BeamGls, |c: &mut Calibration| {
        for azimuth in c.beams.iter_mut().filter_map(|b| b.azimuth_rad.as_mut()) {
            *azimuth += off;
        }
    });
    let found = trials(&scene, 1..=40, &shifted).unwrap();
    Anees::over(&found).gate(significance).unwrap();
    Coverage::over(&found, 0.95).gate(significance).unwrap();
    let failure = Bias::over(&found).gate(0.0, significance).unwrap_err();
    assert!(
        failure.to_string().starts_with("the mean error of θ_a"),
        "{failure}"
    );
    let honest = trials(&scene, 1..=40, &Method::BeamGls).unwrap();
    Bias::over(&honest).gate(0.0, significance).unwrap();
}
