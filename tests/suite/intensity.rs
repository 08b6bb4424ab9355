//! Intensities: in proportion to the power of Eq. (1), rounded and clipped, and the same in the recording.

use crate::common::{VALID, folder_with, run, stderr};
use crate::scenes::{BARE, scene, set_board_ahead};
use catoptric::files::read_dataset;
use catoptric::model::Stretch;
use catoptric::sim::Scene;
use catoptric::sim::build::color;
use catoptric::sim::laboratory::Laboratory;
use catoptric::sim::scene::{ErrorModel, Intensity};
use catoptric_fixtures::ust20lx;

/// A stretch in front of a white board, face-on at a distance.
fn ahead(distance: f64, change: impl Fn(&mut Scene)) -> (Stretch, Scene) {
    let mut scene = scene(BARE);
    set_board_ahead(&mut scene, distance);
    scene.detection.intensity = Some(Intensity::default());
    scene.experiment.scans_per_pose = 400;
    change(&mut scene);
    let laboratory = Laboratory::new(&scene, 1).unwrap();
    let number =
        (0..laboratory.stretches()).find(|n| laboratory.truth().unwrap().poses[*n].room_from_board.is_some());
    let number = number.unwrap();
    let returns = laboratory.returns(number).unwrap();
    (laboratory.record(number, &returns), scene)
}

/// Intensities of the beam straight ahead, scan by scan.
fn forward(stretch: &Stretch) -> Vec<f64> {
    let counts = stretch.intensities.as_ref().unwrap();
    assert_eq!(counts.len(), stretch.ranges.len());
    counts
        .iter()
        .skip(ust20lx::FORWARD)
        .step_by(ust20lx::COUNT)
        .copied()
        .collect()
}

#[test]
fn intensities_follow_equation_1() {
    for distance in [0.7, 1.5, 3.0, 4.5] {
        let (stretch, scene) = ahead(distance, |_| {});
        let white = color::paint(&scene, "white").unwrap().reflectivity;
        let d = &scene.detection;
        // A target of the threshold's reflectivity at the threshold's range makes 10 counts.
        let exact = 10.0 * white / d.threshold_reflectivity * (d.threshold_range_m / distance).powi(2);
        for counts in forward(&stretch) {
            assert_eq!(counts, counts.round());
            // The spot, 16 mrad wide, is on average farther away than its center by less than a ten-thousandth.
            assert!(
                (counts - exact).abs() < 0.5 + 2e-4 * exact,
                "{distance} m: {counts}, {exact}"
            );
        }
        // A code has no power.
        let all = stretch.ranges.iter().zip(stretch.intensities.as_ref().unwrap());
        assert!(
            all.clone()
                .all(|(range, counts)| range.is_finite() == (*counts > 0.0))
        );
    }
}

#[test]
fn intensities_are_clipped_and_as_noisy_as_the_scene_says() {
    let clipped = |scene: &mut Scene| {
        scene.detection.intensity = Some(Intensity {
            largest: 900.0,
            ..Intensity::default()
        })
    };
    assert!(
        forward(&ahead(1.0, clipped).0)
            .iter()
            .all(|counts| *counts == 900.0)
    );
    let saturated = |scene: &mut Scene| scene.detection.saturation_over_threshold = 5.0;
    assert!(
        forward(&ahead(1.0, saturated).0)
            .iter()
            .all(|counts| *counts == 50.0)
    );
    let noisy = |scene: &mut Scene| {
        scene.errors.model = ErrorModel::Empirical;
        scene.detection.intensity = Some(Intensity {
            noise_share: 0.05,
            ..Intensity::default()
        });
    };
    let counts = forward(&ahead(2.0, noisy).0);
    let n = counts.len() as f64;
    let mean = counts.iter().sum::<f64>() / n;
    let sd = (counts.iter().map(|c| (c - mean).powi(2)).sum::<f64>() / (n - 1.0)).sqrt();
    // The sample's standard deviation has a relative error of 1/√(2n): four of these.
    assert!(
        (sd / mean / 0.05 - 1.0).abs() < 4.0 / (2.0 * n).sqrt(),
        "{sd}, {mean}"
    );
}

#[test]
fn intensities_are_in_the_recording_and_their_means_in_the_dataset() {
    let (folder, _) = folder_with(VALID);
    let record = |out: &str, sets: &[&str]| {
        let mut arguments = vec![
            "simulate",
            "scene.toml",
            "--out",
            out,
            "--set",
            "experiment.scans_per_pose=3",
        ];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        read_dataset(&folder.path().join(out)).unwrap()
    };
    let without = record("without", &[]);
    assert!((0..ust20lx::COUNT).all(|beam| without.poses[0].readings.intensity(beam).is_none()));
    let one = record("one", &["detection.intensity={}"]);
    let several = [
        "detection.intensity={}",
        "scanner.preset=utm-30lx-ew",
        "detection.echo=all",
    ];
    let several = record("several", &several);
    for dataset in [&one, &several] {
        let mut found = 0;
        for pose in &dataset.poses {
            for (beam, of) in pose.readings.statistics().iter().enumerate() {
                let mean = pose.readings.intensity(beam);
                assert_eq!(mean.is_some(), of.all.count > 0, "beam {beam}");
                // Just detected is 10, and nothing weaker is.
                assert!(mean.is_none_or(|mean| mean >= 9.5), "beam {beam}: {mean:?}");
                found += usize::from(mean.is_some());
            }
        }
        assert!(found > 4000, "{found}");
    }
    // Ranges do not depend on whether intensities are reported.
    for (a, b) in without.poses.iter().zip(&one.poses) {
        assert_eq!(a.readings.statistics(), b.readings.statistics());
    }
}

#[test]
fn intensities_need_a_threshold() {
    let (folder, _) = folder_with(VALID);
    let sets = [
        "--set",
        "detection.intensity={}",
        "--set",
        "detection.threshold_reflectivity=0",
    ];
    let output = run(folder.path(), &[&["check", "scene.toml"][..], &sets].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("threshold_reflectivity"),
        "{}",
        stderr(&output)
    );
}
