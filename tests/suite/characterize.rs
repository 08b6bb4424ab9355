//! Step 1: Tables 1 to 4 and the parameters of Eqs. (3)–(5) are recovered from the virtual laboratory.
//!
//! This proves that simulator and estimator agree with each other and with the numbers of the paper; the estimator uses
//! the model of the simulator here (the inverse crime), except for the finite beam, drift, motion capture and
//! placement. It does not prove that a real sensor behaves like this. The consistency test proves that the stated
//! uncertainties match the errors.

use crate::common::{run, stderr, stdout};
use crate::scenes::{BARE, scene, set_board_ahead};
use catoptric::model::characterization::{Characterization, Parameter};
use catoptric::model::{ColorBias, RangeBias, paper};
use catoptric::sim::{Laboratory, Scene};
use catoptric::{calib, score};
use rayon::prelude::*;

const COOPER: &str = include_str!("../../scenes/ust-20lx-cooper.toml");
const GUIDE: &str = include_str!("../../docs/guide/7-characterizing.md");
const TABLE_3: &str = include_str!("../../scenes/table-3.toml");

fn characterized(scene: &Scene, seed: u64) -> (Characterization, RangeBias) {
    let laboratory = Laboratory::new(scene, seed).unwrap();
    let found = calib::characterize(&laboratory.dataset().unwrap()).unwrap();
    (found, laboratory.truth().unwrap().bias)
}

#[test]
fn tables_1_to_4_are_recovered_next_to_those_of_the_paper() {
    let scene = scene(COOPER);
    let (found, _) = characterized(&scene, scene.seed);
    // Table 1: within 5 % or 1 mm, all heights, and widths except at 2 m, which fits no straight beam (see paper.rs).
    assert_eq!(found.spots.len(), paper::TABLE_1.len());
    for (row, (distance, height, width)) in found.spots.iter().zip(paper::TABLE_1) {
        let within = |found: f64, printed: f64| (found - printed).abs() <= f64::max(1.0, 0.05 * printed);
        assert!((row.distance_m / distance - 1.0).abs() < 0.02);
        assert!(within(row.spot.height_mm, height), "{row:?}");
        if distance == 2.0 {
            // 33.6 mrad · 2 m is 67.2 mm; each edge is found to 0.25 mm.
            assert!((row.spot.width_mm - 67.2).abs() < 1.5, "{row:?}");
        } else {
            assert!(within(row.spot.width_mm, width), "{row:?}");
        }
    }
    let width = |i: usize| format!("{:.1}", found.spots[i].spot.width_mm);
    let widths = [0, 1, 3, 4].map(width).join(", ");
    let shown = [
        format!("| width of the spot | 0.5, 1, 3, 4 m | {widths} | 15.9, 33.3, 98.4, 136.5 |"),
        format!("| | 2 m | {} | 55.6 |", width(2)),
    ];
    let fitted = found.parameters.iter().filter(|p| p.symbol == "E_r");
    let fitted = fitted.map(|p| format!("m | {:.1} ± {:.1} |", p.value, p.sd).replace('-', "−"));
    for row in shown.into_iter().chain(fitted) {
        assert!(GUIDE.contains(&row), "the guide does not show {row:?}");
    }
    // Table 2: means within 1 mm, spreads within 10 %.
    for (distance, means, sds) in paper::TABLE_2 {
        let mean = |v: [f64; 3]| v.iter().sum::<f64>() / 3.0;
        let fitted = found.bias.distance.error(distance) * 1e3;
        assert!((fitted - mean(means)).abs() < 1.0, "{distance} m: {fitted} mm");
        let noise = found
            .noise
            .iter()
            .find(|n| n.color == "white" && (n.distance_m / distance - 1.0).abs() < 0.05);
        let noise = noise.unwrap_or_else(|| panic!("no spread at {distance} m"));
        assert!((noise.sd_mm / mean(sds) - 1.0).abs() < 0.1, "{noise:?}");
    }
    // Table 4: every color and distance within 10 %.
    for (color, sds) in paper::TABLE_4 {
        for (range, sd) in paper::TABLE_4_RANGE_M.into_iter().zip(sds) {
            let of_color = found.noise.iter().filter(|n| n.color == color);
            let at = of_color.min_by(|a, b| {
                (a.distance_m - range)
                    .abs()
                    .total_cmp(&(b.distance_m - range).abs())
            });
            let at = at.unwrap();
            assert!(
                (at.distance_m / range - 1.0).abs() < 0.03 && (at.sd_mm / sd - 1.0).abs() < 0.1,
                "{at:?}"
            );
        }
    }
    assert!(
        !found.fit.is_rejected() && found.fit.reduced() > 0.8,
        "{:?}",
        found.fit
    );
    // As for the data of the paper, see calibration.md, no straight line describes Table 2.
    assert!(found.distance_line.unwrap().fit.is_rejected());
    assert!(!found.angle_law.unwrap().is_rejected());
}

/// The scene of step 1 with few scans, pencil beams and color errors, for a test over many seeds.
fn quick(text: &str) -> Scene {
    let mut scene = scene(text);
    scene.scanner.sub_rays = 1;
    scene.experiment.scans_per_pose = 10;
    if text == COOPER {
        for (color, slope, offset) in [("jet_black", -1.5, 6.0), ("pencil_grey", 0.8, -2.0)] {
            scene.errors.color.insert(
                color.to_owned(),
                ColorBias {
                    slope_mm_per_m: slope,
                    offset_mm: offset,
                },
            );
        }
    }
    scene
}

/// The injected value of a fitted parameter.
fn injected(p: &Parameter, bias: &RangeBias) -> f64 {
    let color = p
        .color
        .as_deref()
        .and_then(|c| bias.color.get(c))
        .copied()
        .unwrap_or_default();
    match p.symbol.as_str() {
        "E_r" => bias.distance.error(p.distance_m.unwrap()) * 1e3,
        "A_a" => bias.angle.gain_mm,
        "B_a" => bias.angle.offset_mm,
        "A_c" => color.slope_mm_per_m,
        _ => color.offset_mm,
    }
}

/// χ² over its degrees of freedom at z standard deviations (Wilson and Hilferty).
fn bound(freedom: f64, z: f64) -> f64 {
    (1.0 - 2.0 / (9.0 * freedom) + z * (2.0 / (9.0 * freedom)).sqrt()).powi(3)
}

/// The fitted parameters equal the injected ones within their stated covariance: χ² over independent seeds is inside the
/// 99.9 % bounds of a correct covariance, for all parameters together and for each one individually.
#[test]
fn fitted_parameters_are_the_injected_ones_within_their_uncertainty() {
    for (text, count, seeds) in [(COOPER, 12, 200_u32), (TABLE_3, 2, 100)] {
        let scene = quick(text);
        let errors: Vec<(f64, Vec<f64>, f64)> = (1..=seeds)
            .into_par_iter()
            .map(|seed| {
                let (found, bias) = characterized(&scene, seed.into());
                assert_eq!(found.parameters.len(), count, "{:?}", found.not_observed);
                let error: Vec<f64> = found
                    .parameters
                    .iter()
                    .map(|p| p.value - injected(p, &bias))
                    .collect();
                let covariance = nalgebra::DMatrix::from_fn(count, count, |i, j| found.covariance[i][j]);
                let error = nalgebra::DVector::from_vec(error);
                let squared = error.dot(&covariance.clone().cholesky().unwrap().solve(&error));
                let each = (0..count)
                    .map(|i| error[i] * error[i] / covariance[(i, i)])
                    .collect();
                (squared, each, found.fit.reduced())
            })
            .collect();
        let n = f64::from(seeds);
        let all = errors.iter().map(|e| e.0).sum::<f64>() / (n * count as f64);
        let freedom = n * count as f64;
        assert!(
            (bound(freedom, -3.29)..bound(freedom, 3.29)).contains(&all),
            "all numbers: {all}"
        );
        for i in 0..count {
            let one = errors.iter().map(|e| e.1[i]).sum::<f64>() / n;
            // 99.9 % for all of them together: Bonferroni over twelve, 3.93 standard deviations.
            assert!(
                (bound(n, -3.93)..bound(n, 3.93)).contains(&one),
                "number {i}: {one}"
            );
        }
        let fit = errors.iter().map(|e| e.2).sum::<f64>() / n;
        assert!((fit - 1.0).abs() < 0.03, "residuals: {fit}");
    }
}

#[test]
fn a_recorded_dataset_gives_the_same_with_and_without_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), COOPER).unwrap();
    let quick = ["--set", "experiment.scans_per_pose=10"];
    let from = |arguments: &[&str]| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        stdout(&output)
    };
    let simulated = from(&["simulate", "scene.toml", "--out", "data", quick[0], quick[1]]);
    assert!(
        simulated.ends_with("next: catoptric characterize data --out characterization.json\n"),
        "{simulated}"
    );
    let shown = from(&["characterize", "data", "--out", "known.json"]);
    for word in [
        "Table 1",
        "Table 2",
        "Table 3",
        "Table 4",
        "A_a",
        "injected",
        "next: catoptric calibrate",
    ] {
        assert!(shown.contains(word), "{word} in {shown}");
    }
    std::fs::remove_dir_all(folder.path().join("data/truth")).unwrap();
    let blind = from(&["characterize", "data", "--out", "blind.json"]);
    assert!(!blind.contains("injected"));
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(read("known.json"), read("blind.json"));
    let page = String::from_utf8(read("known.html")).unwrap();
    assert_eq!(page.matches("<svg").count(), 4);
    // A scene is simulated first; only the rounding of readings to 32 bits in the file differs.
    from(&[
        "characterize",
        "scene.toml",
        "--out",
        "direct.json",
        quick[0],
        quick[1],
    ]);
    let found = |name: &str| -> Characterization { serde_json::from_slice(&read(name)).unwrap() };
    let (direct, recorded) = (found("direct.json"), found("known.json"));
    for (a, b) in direct.parameters.iter().zip(&recorded.parameters) {
        assert_eq!((&a.symbol, &a.color), (&b.symbol, &b.color));
        assert!((a.value - b.value).abs() < 1e-3, "{a:?} {b:?}");
    }
}

#[test]
fn what_the_boards_do_not_determine_is_reported() {
    // Face-on boards of one color at one distance: they do not determine A_a, and only one node of E_r.
    let mut narrow = quick(TABLE_3);
    narrow.board[0].width_mm = 300.0;
    narrow.experiment.test.truncate(1);
    narrow.experiment.test[0].incidence_deg = vec![0.0];
    narrow.experiment.test[0].kind = catoptric::model::TestKind::Distance;
    let (found, _) = characterized(&narrow, 1);
    assert_eq!(found.parameters.len(), 1);
    assert!(
        found
            .not_observed
            .iter()
            .any(|n| n.symbol == "A_a" && n.reason.contains("incidence"))
    );
    assert!(found.angle_law.is_none() && found.distance_line.is_none());
    // A color at a single distance has no slope.
    let mut one = quick(COOPER);
    one.experiment.test.last_mut().unwrap().range_m = vec![1.0];
    let (found, _) = characterized(&one, 1);
    assert!(found.parameter("A_c", Some("jet_black")).is_none());
    let open = found
        .not_observed
        .iter()
        .find(|n| n.color.as_deref() == Some("jet_black"));
    assert_eq!(open.map(|n| n.symbol.as_str()), Some("A_c"));
    // No board at all is an error, not an empty table.
    let mut empty = scene(BARE);
    set_board_ahead(&mut empty, 2.0);
    empty.experiment.pose.clear();
    empty.experiment.direct_poses = 0;
    let laboratory = Laboratory::new(&empty, 1).unwrap();
    let error = calib::characterize(&laboratory.dataset().unwrap())
        .unwrap_err()
        .to_string();
    assert!(error.contains("no board is read"), "{error}");
}

/// Boards that were recorded to find the mounting also determine E_r and E_a, and just as honestly: any correlation
/// between their distances and incidences is accounted for by the fit.
#[test]
fn boards_without_a_test_label_separate_distance_and_angle() {
    let mut scene = scene(crate::scenes::TWO_MIRROR);
    scene.scanner.sub_rays = 1;
    scene.scanner.mount.shift_tolerance_mm = 0.0;
    scene.experiment.scans_per_pose = 20;
    scene.experiment.poses_per_group = 1;
    let seeds = 60_u32;
    let squares: Vec<f64> = (1..=seeds)
        .into_par_iter()
        .map(|seed| {
            let (found, bias) = characterized(&scene, seed.into());
            assert_eq!(found.parameters.len(), 3, "{:?}", found.parameters);
            let gain = found.parameter("A_a", None).unwrap();
            ((gain.value - bias.angle.gain_mm) / gain.sd).powi(2)
        })
        .collect();
    let n = f64::from(seeds);
    let mean = squares.iter().sum::<f64>() / n;
    assert!((bound(n, -3.29)..bound(n, 3.29)).contains(&mean), "{mean}");
}

#[test]
fn a_law_that_does_not_fit_is_replaced_by_a_table() {
    let mut scene = quick(COOPER);
    scene.errors.angle.table = Some(catoptric::model::AngleTable {
        incidence_deg: vec![0.0, 18.5, 44.7, 80.0],
        error_mm: vec![0.0, 12.0, -4.0, 0.0],
    });
    let (found, truth) = characterized(&scene, 1);
    let law = found.angle_law.unwrap();
    assert!(law.is_rejected(), "{law:?}");
    let at = |bias: &RangeBias, degrees: f64| bias.angle.error(libm::cos(f64::to_radians(degrees))) * 1e3;
    for degrees in [0.0, 18.5, 44.7, 80.0] {
        let (fitted, wanted) = (at(&found.bias, degrees), at(&truth, degrees));
        assert!(
            (fitted - wanted).abs() < 1.5,
            "{degrees}: {fitted} against {wanted}"
        );
    }
}

/// A fixed threshold makes ranges depend on the received power. The session does not know this; step 1 learns it as far
/// as Eqs. (3)–(5) can: error and dishonesty of the calibration decrease, though not to zero, since the effect of the
/// detector is not a sum of terms in distance, angle and color, and mirrors absorb light that the bare sensor receives.
#[test]
fn step_1_teaches_a_calibration_the_walk_error_of_a_threshold() {
    let physical = |text: &str| {
        let mut scene = scene(text);
        scene.errors.model = catoptric::sim::scene::ErrorModel::Physical;
        scene
    };
    let mut bare = physical(COOPER);
    bare.scanner.preset = catoptric::sim::scene::Preset::Ust20lx;
    bare.experiment.scans_per_pose = 50;
    bare.experiment.test[1].range_m = vec![0.5, 0.6, 0.75, 0.9, 1.1, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0];
    let (found, _) = characterized(&bare, 1);
    assert!(found.angle_law.unwrap().is_rejected() && found.fit.is_rejected());
    let laboratory = Laboratory::new(&physical(crate::scenes::PROTOTYPE), 1).unwrap();
    let (mut dataset, truth) = (laboratory.dataset().unwrap(), laboratory.truth().unwrap());
    let options = calib::Options::default();
    let accuracy = |dataset: &catoptric::model::Dataset| {
        let calibration = calib::calibrate(dataset, calib::Method::Beam, &options).unwrap();
        score(dataset, &calibration, Some(&truth)).expect("in memory")
    };
    let before = accuracy(&dataset);
    dataset.session.believed = dataset.session.believed.after(&found);
    let after = accuracy(&dataset);
    assert!(
        after.per_axis_rms_deg < 0.1 * before.per_axis_rms_deg && after.nees_mean < 0.01 * before.nees_mean,
        "{} to {} degrees, {} to {}",
        before.per_axis_rms_deg,
        after.per_axis_rms_deg,
        before.nees_mean,
        after.nees_mean
    );
}

#[test]
fn a_bad_request_is_refused_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.toml"), COOPER).unwrap();
    let refused = |arguments: &[&str], said: &[&str]| {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        let text = stderr(&output);
        for word in said {
            assert!(text.contains(word), "{word} in {text}");
        }
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    };
    refused(
        &["characterize", "scene.toml", "--out", "page.html"],
        &["page.json"],
    );
    let changed: [(&str, &[&str]); 4] = [
        (
            "experiment.test.0.board=[\"whit\"]",
            &["experiment.test[0].board[0]", "did you mean `white`?"],
        ),
        (
            "experiment.test.1.range_m=[9.0]",
            &["experiment.test[1].range_m[0]", "wall"],
        ),
        ("experiment.test.1.kind=distanc", &["distance"]),
        ("experiment.test.2.incidence_deg=[85]", &["85", "80"]),
    ];
    for (set, said) in changed {
        let arguments = ["characterize", "scene.toml", "--out", "c.json", "--set", set];
        refused(&arguments, said);
    }
    std::fs::remove_file(folder.path().join("scene.toml")).unwrap();
    std::fs::create_dir(folder.path().join("data")).unwrap();
    refused(
        &["characterize", "data", "--out", "c.json", "--seed", "3"],
        &["--seed"],
    );
}
