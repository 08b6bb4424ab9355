//! The tiers are as described in their comments: our methods give the expected results, through the files.
//!
//! One seed, few scans: this proves that the tiers are as described and that no method fails on one. It does not prove
//! how good a method is on average.

use catoptric::calib::{Calibrator, Method};
use catoptric::files::scene;
use catoptric::files::{DatasetWriter, Provenance, read_dataset};
use catoptric::sim::{Laboratory, Truth, noise};
use catoptric::{Score, Verdict, score};
use std::path::Path;

/// A tier's dataset, written and read back, its truth, and the folder that its readings stay in.
fn tier(name: &str, sets: &[&str]) -> (catoptric::model::Dataset, Truth, tempfile::TempDir) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/tiers/{name}.toml"));
    let sets: Vec<String> = sets.iter().map(|s| (*s).to_owned()).collect();
    let scene = scene::load(&path, &sets).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("data");
    let mut writer = DatasetWriter::create(&out, false, &laboratory.session().unwrap()).unwrap();
    for number in 0..laboratory.stretches() {
        writer
            .write_stretch(&laboratory.stretch(number).unwrap())
            .unwrap();
    }
    writer
        .finish(Provenance {
            seed: scene.seed,
            command_line: name.to_owned(),
            rng_rule: noise::RULE.to_owned(),
        })
        .unwrap();
    (read_dataset(&out).unwrap(), laboratory.truth().unwrap(), folder)
}

const FEW_SCANS: [&str; 3] = [
    "experiment.scans_per_pose=10",
    "experiment.room_scans=10",
    "experiment.bare_scans=10",
];

fn scored(name: &str, sets: &[&str], method: Method) -> Score {
    let (dataset, truth, _folder) = tier(name, sets);
    let calibration = method.calibrate(&dataset).unwrap();
    score(&dataset, &calibration, Some(&truth)).expect("in memory")
}

#[test]
fn tier_0_is_recovered_to_a_millionth_of_a_radian() {
    for method in [Method::Beam, Method::Joint] {
        let found = scored("t0-noise-free", &[], method);
        assert_eq!(found.verdict, Verdict::Pass, "{:?}", found.warnings);
        assert_eq!(Some(found.beams.solved), found.beams.deflected);
        let worst = found.direction_deg.max.to_radians();
        // The errors are not zero either: files store ranges as 32-bit floats.
        assert!(worst < 1e-6 && worst > 1e-12, "{}: {worst:e} rad", method.name());
    }
}

#[test]
fn tiers_1_to_4_are_increasingly_hard_and_outliers_spoil_no_direction() {
    let of = |name| scored(name, &FEW_SCANS, Method::Beam);
    let tiers = [
        "t1-noise",
        "t2-motion-capture",
        "t3-bias-and-divergence",
        "t4-outliers",
    ]
    .map(of);
    let [noise, markers, biases, outliers] = &tiers;
    for found in [noise, markers, biases] {
        assert_eq!(found.verdict, Verdict::Pass, "{:?}", found.warnings);
        assert_eq!(found.beams.abstained, 0);
        assert_eq!(found.open.map(|o| o.elements), Some(0));
    }
    // The bound shows what a tier makes possible, independent of a single draw.
    assert!(noise.alone_crlb_per_axis_deg < markers.alone_crlb_per_axis_deg);
    assert!(markers.alone_crlb_per_axis_deg < 0.7 * biases.alone_crlb_per_axis_deg);
    assert_eq!(outliers.verdict, Verdict::Pass, "{:?}", outliers.warnings);
    assert!(
        2 * outliers.beams.solved > biases.beams.solved,
        "{:?}",
        outliers.beams
    );
    assert!(outliers.per_axis_rms_deg < 3.0 * biases.alone_crlb_per_axis_deg);
}

#[test]
fn tier_5_is_not_answered_with_a_guess() {
    let (dataset, truth, _folder) = tier("t5-degenerate", &FEW_SCANS);
    for method in [Method::Beam, Method::BeamGls, Method::Joint] {
        let calibration = method.calibrate(&dataset).unwrap();
        let found = score(&dataset, &calibration, Some(&truth)).expect("in memory");
        let open = found.open.unwrap();
        assert_eq!(
            found.verdict,
            Verdict::Pass,
            "{}: {:?}",
            method.name(),
            found.warnings
        );
        assert!(open.elements > 100, "{open:?}");
        assert_eq!((open.abstained + open.solved, open.wrong), (open.elements, 0));
        let solved_before = |facet: &str| {
            let beams = calibration.beams.iter();
            beams
                .filter(|b| b.facet.as_deref() == Some(facet) && b.deflection().is_some())
                .count()
        };
        // Their ranges determine the open direction only by their curvature along it, which no covariance states
        // correctly.
        assert_eq!((solved_before("hinge"), solved_before("face-on")), (0, 0));
        if method != Method::Joint {
            assert_eq!(open.solved, 0, "a single element cannot know");
        }
        assert!(solved_before("sound") > 50);
    }
}
