//! No element disappears: every fault is reported.

use crate::synthetic::World;
use catoptric_calib::{CalibError, Method, Options, calibrate, pose};
use catoptric_model::{BeamEstimate, Calibration, Dataset, PoseKind, Status, beam};
use nalgebra::Matrix6;

fn solve(dataset: &Dataset) -> Calibration {
    calibrate(dataset, Method::Beam, &Options::default()).expect("a sound dataset")
}

/// Rewrites every reading of a beam in every stretch.
fn rewrite(dataset: &mut Dataset, beam: usize, with: impl Fn(PoseKind, usize, f64) -> f64) {
    for pose in &mut dataset.poses {
        let (kind, beams) = (pose.label.kind, pose.beams());
        let ranges = pose.readings.held_mut().expect("in memory");
        for (scan, r) in ranges.iter_mut().skip(beam).step_by(beams).enumerate() {
            *r = with(kind, scan, *r);
        }
    }
}

fn assert_rejected(estimate: &BeamEstimate, word: &str) {
    assert_eq!(estimate.status, Status::Rejected, "{:?}", estimate.reason);
    let reason = estimate.reason.as_deref().expect("a rejection has a reason");
    assert!(reason.contains(word), "{reason:?} does not contain {word:?}");
}

#[test]
fn every_fault_has_its_reason() {
    let mut made = World::noisy(11).make();
    let data = &mut made.dataset;
    rewrite(data, 20, |_, _, _| 0.09);
    rewrite(data, 21, |_, _, _| f64::INFINITY);
    rewrite(data, 22, |_, _, _| f64::NEG_INFINITY);
    rewrite(data, 65, |_, scan, r| if scan % 2 == 0 { r } else { r + 0.3 });
    rewrite(data, 23, |_, _, r| r - 0.4);
    rewrite(
        data,
        66,
        |kind, _, r| if kind == PoseKind::Room { r + 0.5 } else { r },
    );
    let calibration = solve(data);
    assert_rejected(&calibration.beams[20], "structure");
    assert_rejected(&calibration.beams[21], "no return");
    assert_rejected(&calibration.beams[22], "too close");
    assert_rejected(&calibration.beams[65], "spread");
    assert_rejected(&calibration.beams[23], "expected");
    assert_rejected(&calibration.beams[66], "contradicts the known room");
    for estimate in &calibration.beams {
        assert!(estimate.status == Status::Solved || estimate.reason.is_some());
    }
}

#[test]
fn one_reading_of_the_wall_does_not_lose_the_element() {
    let mut made = World::noisy(12).make();
    let clean = solve(&made.dataset).beams[66].clone();
    let beams = made.dataset.session.scanner.scan.beams();
    let pose = made
        .dataset
        .poses
        .iter_mut()
        .find(|p| p.label.kind == PoseKind::Facet)
        .expect("there are boards for facets");
    let ranges = pose.readings.held_mut().expect("in memory");
    for r in ranges.iter_mut().skip(66).step_by(beams) {
        *r += 0.12;
    }
    let found = &solve(&made.dataset).beams[66];
    assert_eq!(found.status, Status::Solved, "{:?}", found.reason);
    assert_eq!(found.poses, clean.poses.map(|p| p - 1));
}

#[test]
fn good_elements_survive_honest_noise() {
    let mut lost = 0;
    for seed in 0..20 {
        let made = World::noisy(500 + seed).make();
        let calibration = solve(&made.dataset);
        lost += calibration
            .beams
            .iter()
            .filter(|b| {
                let expected = if made.deflections.contains_key(&b.beam) {
                    Status::Solved
                } else {
                    Status::Direct
                };
                b.status != expected
            })
            .count();
    }
    // 5420 elements: 0.1 % would be five.
    assert!(lost <= 5, "{lost} of 5420");
}

#[test]
fn without_boards_for_it_the_mounting_and_its_covariance_are_the_drawing_s() {
    let mut made = World::noisy(13).make();
    made.dataset.poses.retain(|p| p.label.kind != PoseKind::Direct);
    let mount = solve(&made.dataset)
        .rig_from_sensor
        .expect("the mounting is always estimated");
    let covariance = Matrix6::from(mount.covariance.expect("its covariance is always given"));
    let nominal = catoptric_model::Pose::from(&made.dataset.session.nominal_rig_from_sensor);
    assert!(pose::motion_between(&nominal, &mount.pose()).norm() < 1e-14);
    assert!((covariance[(5, 5)].sqrt().to_degrees() - 1.0).abs() < 1e-9);
    assert!((covariance[(0, 0)].sqrt() - 5e-3).abs() < 1e-12);
}

#[test]
fn one_board_determines_some_motions_and_the_tolerance_covers_the_rest() {
    let mut made = World::noisy(15).make();
    made.dataset.session.mount_tolerance.rotation_sd_deg = [3.0; 3];
    let mut boards = 0;
    made.dataset.poses.retain(|p| {
        boards += usize::from(p.label.kind == PoseKind::Direct);
        p.label.kind != PoseKind::Direct || boards == 1
    });
    let calibration = solve(&made.dataset);
    let mount = calibration
        .rig_from_sensor
        .expect("the mounting is always estimated");
    let covariance = Matrix6::from(mount.covariance.expect("its covariance is always given"));
    let scale = Matrix6::from_diagonal(
        &[
            5e-3,
            5e-3,
            5e-3,
            3.0_f64.to_radians(),
            3.0_f64.to_radians(),
            3.0_f64.to_radians(),
        ]
        .map(|sd| 1.0 / sd)
        .into(),
    );
    let values = (scale * covariance * scale).symmetric_eigenvalues();
    assert!(
        values.max() > 0.99 && values.max() < 2.0,
        "as unknown as the tolerance: {values}"
    );
    assert!(
        values.min() > 0.0 && values.min() < 0.1,
        "one board determines something: {values}"
    );
    // A poorly known mounting is not the boards' fault: elements are solved, with a matching covariance.
    let estimate = &calibration.beams[66];
    assert_eq!(estimate.status, Status::Solved, "{:?}", estimate.reason);
    let variance = estimate.covariance_rad2.expect("the element is solved")[1][1];
    assert!(variance.sqrt().to_degrees() > 0.3);
}

#[test]
fn an_impossible_dataset_is_refused() {
    let mut made = World::noisy(14).make();
    made.dataset.session.facets[0].corners_mm.truncate(2);
    let refused = calibrate(&made.dataset, Method::Beam, &Options::default());
    assert!(matches!(refused, Err(CalibError::Facet { corners: 2, .. })));
    made.dataset.session.believed.drift_sd_mm = -1.0;
    let refused = calibrate(&made.dataset, Method::Beam, &Options::default());
    assert!(matches!(refused, Err(CalibError::Session { found, .. }) if found == -1.0));
    let ranges = made.dataset.poses[0].readings.held_mut().expect("in memory");
    ranges.pop();
    let refused = calibrate(&made.dataset, Method::Beam, &Options::default());
    assert!(matches!(refused, Err(CalibError::Dataset(_))));
}

#[test]
fn a_wide_beam_and_edges_off_the_drawing_lose_only_edge_beams() {
    // Richer than the estimator's model: 9 mrad of width, facets that end two beams early or late.
    for (seed, edges) in [(21, [2, 2]), (22, [-2, -2]), (23, [2, -2]), (24, [-2, 2])] {
        let world = World {
            width: 9e-3,
            edges,
            beams: 1081,
            step_deg: 0.25,
            served: vec![[240, 300], [510, 570], [780, 840]],
            ..World::noisy(seed)
        };
        let made = world.make();
        let calibration = solve(&made.dataset);
        for (facet, [first, last]) in world.served.iter().copied().enumerate() {
            let range = (first as i64 + edges[0], last as i64 + edges[1]);
            for index in first - 6..=last + 6 {
                let estimate = &calibration.beams[index];
                let inside = (index as i64 - range.0).min(range.1 - index as i64);
                let context = format!(
                    "seed {seed}, beam {index}, {inside} inside: {:?}",
                    estimate.reason
                );
                // Half a beam's width is 1.03 steps: two steps inside an edge all of its light is reflected.
                if inside >= 2 {
                    assert_eq!(estimate.status, Status::Solved, "{context}");
                }
                if inside <= -3 {
                    assert_eq!(estimate.status, Status::Direct, "{context}");
                }
                if let Some(found) = estimate.deflection() {
                    let azimuth = world.azimuth(index);
                    let truth = world.mirror(facet, true).deflect(beam::direction(azimuth));
                    let truth = truth.expect("the facet's plane faces it").exit_direction(azimuth);
                    let off = beam::angle_between(&found.exit_direction(azimuth), &truth);
                    assert!(off.to_degrees() < 0.35, "off by {}°: {context}", off.to_degrees());
                }
            }
        }
    }
}
