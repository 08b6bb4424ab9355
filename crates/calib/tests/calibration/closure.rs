//! Noise-free data return the truth: to 1e-9 rad with every method that measures, from a mounting and facets 1° off the
//! drawing.

use crate::synthetic::World;
use catoptric_calib::{JacobianForm, Method, Options, calibrate, pose};
use catoptric_model::{Status, beam};

#[test]
fn every_method_returns_every_direction_and_the_mounting() {
    let world = World::exact();
    let made = world.make();
    for method in Method::ALL.into_iter().filter(|m| *m != Method::Prior) {
        let calibration = calibrate(&made.dataset, method, &Options::default()).expect("a sound dataset");
        assert_eq!(calibration.method, method.name());
        assert_eq!(calibration.beams.len(), world.beams);
        let mount = calibration
            .rig_from_sensor
            .expect("the mounting is always estimated");
        let off = pose::motion_between(&made.rig_from_sensor, &mount.pose());
        assert!(off.norm() < 1e-9, "{method:?}: mounting off by {off}");
        for (index, estimate) in calibration.beams.iter().enumerate() {
            assert_eq!(estimate.beam, index);
            let Some(truth) = made.deflections.get(&index) else {
                assert_eq!(
                    estimate.status,
                    Status::Direct,
                    "beam {index}: {:?}",
                    estimate.reason
                );
                continue;
            };
            assert_eq!(
                estimate.status,
                Status::Solved,
                "beam {index}: {:?}",
                estimate.reason
            );
            let found = estimate.deflection().expect("the element is solved");
            let azimuth = world.azimuth(index);
            let angle = beam::angle_between(&found.exit_direction(azimuth), &truth.exit_direction(azimuth));
            assert!(angle < 1e-9, "{method:?}, beam {index}: off by {angle:e} rad");
            assert!((found.distance - truth.distance).abs() < 1e-10);
        }
    }
}

#[test]
fn the_paper_s_differences_reach_the_estimate_of_the_derivatives() {
    let made = World::noisy(5).make();
    let solve = |jacobian| {
        let options = Options {
            jacobian,
            ..Options::default()
        };
        calibrate(&made.dataset, Method::Beam, &options).expect("a sound dataset")
    };
    let (exact, difference) = (
        solve(JacobianForm::Analytic),
        solve(JacobianForm::CentralDifference),
    );
    let mut largest: f64 = 0.0;
    for (a, b) in exact.beams.iter().zip(&difference.beams) {
        assert_eq!(a.status, b.status);
        if let (Some(x), Some(y)) = (a.deflection(), b.deflection()) {
            largest = largest
                .max((x.azimuth - y.azimuth).abs())
                .max((x.elevation - y.elevation).abs());
        }
    }
    assert!(
        largest > 0.0 && largest.to_degrees() < 4.4e-7,
        "{:e}°",
        largest.to_degrees()
    );
}

#[test]
fn the_recursion_reaches_the_batch_estimate() {
    let made = World::noisy(6).make();
    let solve = |method| calibrate(&made.dataset, method, &Options::default()).expect("a sound dataset");
    let (batch, recursive) = (solve(Method::Beam), solve(Method::Recursive));
    let mut compared = 0;
    for (a, b) in batch.beams.iter().zip(&recursive.beams) {
        assert_eq!(a.status, b.status);
        if let (Some(x), Some(y)) = (a.deflection(), b.deflection()) {
            assert!((x.azimuth - y.azimuth).abs() < 1e-9 && (x.elevation - y.elevation).abs() < 1e-9);
            compared += 1;
        }
    }
    assert_eq!(compared, made.deflections.len());
}

#[test]
fn a_wide_facet_is_solved_group_by_group_on_the_boards_that_are_hit() {
    // Boards of half a meter, each seen by a third of the fan: most beams miss most boards and read the wall there.
    let world = World {
        served: vec![[480, 600]],
        groups: 3,
        board_mm: 400.0,
        ..World::exact()
    };
    let made = world.make();
    let calibration = calibrate(&made.dataset, Method::Beam, &Options::default()).expect("a sound dataset");
    let mut solved = 0;
    for (index, truth) in &made.deflections {
        let estimate = &calibration.beams[*index];
        let Some(found) = estimate.deflection() else {
            assert_eq!(
                estimate.status,
                Status::TooFewPoses,
                "beam {index}: {:?}",
                estimate.reason
            );
            continue;
        };
        let azimuth = world.azimuth(*index);
        let angle = beam::angle_between(&found.exit_direction(azimuth), &truth.exit_direction(azimuth));
        assert!(
            angle < 1e-9,
            "beam {index}: off by {angle:e} rad on {:?} boards",
            estimate.poses
        );
        solved += 1;
    }
    assert!(solved >= 80, "{solved} of {}", made.deflections.len());
}
