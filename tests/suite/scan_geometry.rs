//! Scanners with other beams than the presets': fewer and wider ones, a clockwise scan, one all around.
//!
//! It proves that the scan's geometry goes from the scene through the files into calibration and score, that a clockwise
//! scan is the mirror image of a counter-clockwise one, that the seam of a scan all around is nowhere special, and that
//! calibrations say what they are of. It does not prove that any scanner on sale scans like this.

use crate::common::{run, stderr, stdout};
use crate::scenes::{TWO_MIRROR, scene, without_errors};
use catoptric::files::{DatasetWriter, Provenance, read_dataset, scene as scene_file};
use catoptric::model::{Calibration, Dataset, ScanDirection, ScanGeometry, Status};
use catoptric::sim::build::pattern;
use catoptric::sim::scene::{Exchange, Limits, Preset};
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene, Truth};
use catoptric::testing::closure_of;
use catoptric::{calibrate, layout};
use std::path::Path;
use std::process::Output;

const ALL_AROUND: &str = include_str!("../../scenes/all-around.toml");

/// A scene, its beams, the azimuth of the first and their step in degrees, negative for a clockwise scan.
const OTHERS: [(&str, &str, usize, f64, f64); 3] = [
    (
        "beams-of-682",
        include_str!("../../scenes/beams-of-682.toml"),
        682,
        -119.53125,
        0.3515625,
    ),
    (
        "clockwise",
        include_str!("../../scenes/clockwise.toml"),
        541,
        135.0,
        -0.5,
    ),
    ("all-around", ALL_AROUND, 1440, 0.0, 0.25),
];

/// Few scans and thin beams: what is quick.
const QUICK: [&str; 4] = [
    "--set",
    "experiment.scans_per_pose=20",
    "--set",
    "scanner.sub_rays=7",
];

/// How far off a calibration may be without errors, in radians.
const ALLOWED: f64 = 1e-9;

/// Every preset from its scene to a score: two mirrors, without the housing, which may be larger than they allow.
#[test]
fn every_preset_is_simulated_calibrated_and_scored() {
    for preset in Preset::ALL {
        let mut scene = scene(TWO_MIRROR);
        scene.scanner.preset = preset;
        scene.scanner.housing = false;
        scene.scanner.sub_rays = 7;
        scene.experiment.scans_per_pose = 10;
        let limits = preset.limits();
        let laboratory = Laboratory::new(&scene, 1).unwrap_or_else(|e| panic!("{preset:?}: {e}"));
        let (dataset, truth) = (laboratory.dataset().unwrap(), laboratory.truth().unwrap());
        assert_eq!(dataset.session.scanner.scan.beams(), limits.beams as usize);
        let found = calibrate(&dataset).unwrap();
        let score = catoptric::score(&dataset, &found, Some(&truth)).unwrap();
        let beams = &score.beams;
        let deflected = truth
            .beams
            .iter()
            .filter(|b| b.status == BeamClass::Deflected)
            .count();
        let least = deflected * 9 / 10;
        assert!(
            deflected > 100 && beams.solved >= least && score.per_axis_rms_deg < 0.2,
            "{preset:?}: {} of {deflected} solved, {}°",
            beams.solved,
            score.per_axis_rms_deg
        );
    }
}

fn succeeds(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    stdout(output)
}

fn simulate(folder: &Path, text: &str, out: &str, more: &[&str]) {
    std::fs::write(folder.join("scene.toml"), text).unwrap();
    let arguments = [&["simulate", "scene.toml", "--out", out][..], &QUICK, more].concat();
    succeeds(&run(folder, &arguments));
}

fn json(path: &Path) -> serde_json::Value {
    serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap()
}

/// What is recorded in a scene, free of errors, and what is true.
fn recorded(scene: &Scene) -> (Dataset, Truth) {
    let laboratory = Laboratory::new(scene, scene.seed).unwrap();
    (laboratory.dataset().unwrap(), laboratory.truth().unwrap())
}

#[test]
fn other_scanners_are_simulated_calibrated_and_scored() {
    for (name, text, beams, first_deg, step_deg) in OTHERS {
        let folder = tempfile::tempdir().unwrap();
        let at = |arguments: &[&str]| run(folder.path(), arguments);
        simulate(folder.path(), text, "data", &[]);
        succeeds(&at(&["calibrate", "data", "--out", "c.json"]));
        succeeds(&at(&["validate", "c.json"]));
        let score = succeeds(&at(&["score", "data", "c.json", "--json"]));
        let score: serde_json::Value = serde_json::from_str(&score).unwrap();
        assert_eq!(score["verdict"], "pass", "{name}: {score}");
        assert_eq!(score["beams"]["missed"], 0, "{name}");
        assert!(score["beams"]["solved"].as_u64().unwrap() > 60, "{name}");
        succeeds(&at(&["apply", "data", "c.json", "--out", "cloud.ply"]));
        succeeds(&at(&["report", "data", "c.json", "--out", "report.html"]));

        let dataset = read_dataset(&folder.path().join("data")).unwrap();
        let scan = dataset.session.scanner.scan;
        assert_eq!((scan.beams(), scan.azimuth_deg(0)), (beams, first_deg));
        assert!((scan.increment().to_degrees() - step_deg).abs() < 1e-12, "{name}");
        let calibration = json(&folder.path().join("c.json"));
        assert_eq!(calibration["schema_version"], 2);
        assert_eq!(calibration["scanner"]["beams"], beams);
        assert_eq!(calibration["scanner"]["first_deg"], first_deg);
        assert_eq!(calibration["scanner"]["step_deg"], step_deg.abs());
        let word = if step_deg > 0.0 { "ccw" } else { "cw" };
        assert_eq!(calibration["scanner"]["direction"], word);
        let manifest = json(&folder.path().join("data/manifest.json"));
        assert_eq!(calibration["dataset"], manifest["files"]["observations.mcap"]);
        assert_eq!(
            dataset.id.as_deref(),
            manifest["files"]["observations.mcap"].as_str()
        );
    }
}

/// A scene seen in a mirror that exchanges left and right, its scan turning the other way.
fn mirrored(scene: &Scene) -> Scene {
    let scan = scene.scanner.scan().unwrap();
    let mut image = scene.clone();
    image.scanner.preset = Preset::Custom;
    image.scanner.beam = Some(scene.scanner.beam_shape());
    image.scanner.custom = Some(Limits {
        first_deg: -scan.azimuth_deg(0),
        direction: ScanDirection::Cw,
        ..scene.scanner.limits()
    });
    for facet in &mut image.superstructure.facet {
        *facet = pattern::mirrored(facet, facet.name.clone(), &[Exchange::LeftRight], &scan);
    }
    for marker in &mut image.superstructure.marker {
        marker.position_mm[1] *= -1.0;
    }
    image.scanner.mount.yaw_tolerance_deg = 0.0;
    image
}

/// A scene whose mirrors and sensor are where they are drawn.
fn as_drawn(mut scene: Scene) -> Scene {
    let mount = &mut scene.scanner.mount;
    (
        mount.yaw_tolerance_deg,
        mount.tilt_tolerance_deg,
        mount.shift_tolerance_mm,
    ) = (0.0, 0.0, 0.0);
    let built = &mut scene.superstructure.as_built;
    (built.tilt_sd_deg, built.shift_sd_mm) = (0.0, 0.0);
    without_errors(scene)
}

#[test]
fn a_clockwise_scan_is_the_mirror_image_of_a_counter_clockwise_one() {
    let scene = as_drawn(scene(TWO_MIRROR));
    let image = mirrored(&scene);
    let [one, other] = [&scene, &image].map(|scene| {
        let (dataset, truth) = recorded(scene);
        let calibration = calibrate(&dataset).unwrap();
        closure_of(&truth, &calibration, ALLOWED).unwrap();
        (truth, calibration)
    });
    let mut compared = 0;
    for (a, b) in one.0.beams.iter().zip(&other.0.beams) {
        assert_eq!(a.status, b.status, "beam {}", a.beam);
        let (Some(a), Some(b)) = (a.deflection(), b.deflection()) else {
            continue;
        };
        assert!((a.azimuth + b.azimuth).abs() < 1e-12 && (a.elevation - b.elevation).abs() < 1e-12);
        assert!((a.distance - b.distance).abs() < 1e-12);
    }
    for (a, b) in one.1.beams.iter().zip(&other.1.beams) {
        let (Some(a), Some(b)) = (a.deflection(), b.deflection()) else {
            continue;
        };
        assert!((a.azimuth + b.azimuth).abs() < 2.0 * ALLOWED);
        assert!((a.elevation - b.elevation).abs() < 2.0 * ALLOWED);
        compared += 1;
    }
    assert!(compared > 300, "{compared}");
}

/// The scene all around with its first beam at an azimuth in degrees.
fn beginning_at(first_deg: f64) -> Scene {
    let mut scene = as_drawn(scene(ALL_AROUND));
    if let Some(custom) = &mut scene.scanner.custom {
        custom.first_deg = first_deg;
    }
    scene
}

#[test]
fn the_seam_of_a_scan_all_around_is_nowhere_special() {
    // In the middle of a mirror, in a free sector, behind.
    let firsts = [0.0, 30.0, -180.0];
    let found = firsts.map(|first_deg| {
        let (dataset, truth) = recorded(&beginning_at(first_deg));
        let calibration = calibrate(&dataset).unwrap();
        closure_of(&truth, &calibration, ALLOWED).unwrap_or_else(|e| panic!("from {first_deg}°: {e}"));
        (dataset, truth, calibration)
    });
    let (dataset, truth, calibration) = &found[0];
    let front = dataset.session.facets.iter().find(|f| f.name == "front").unwrap();
    let [first, last] = front.beams;
    assert!(
        first > last,
        "the mirror in front has beams {first} to {last}, over the seam"
    );
    for beam in [1439, 0] {
        let estimate = calibration.beam(beam).unwrap();
        assert_eq!(
            (estimate.status, estimate.facet.as_deref()),
            (Status::Solved, Some("front"))
        );
        assert_eq!(truth.beams[beam].status, BeamClass::Deflected);
    }
    // Every beam of one scan is the beam at its azimuth of the others.
    for (dataset, other, _) in &found[1..] {
        let scans = [&found[0].0, dataset].map(|d| d.session.scanner.scan);
        for beam in &truth.beams {
            let there = scans[1].nearest(scans[0].azimuth(beam.beam)).unwrap();
            assert_eq!(beam.status, other.beams[there].status, "beam {}", beam.beam);
            if let (Some(a), Some(b)) = (beam.deflection(), other.beams[there].deflection()) {
                assert!((a.azimuth - b.azimuth).abs() < 1e-9 && (a.elevation - b.elevation).abs() < 1e-9);
            }
        }
        assert_eq!(dataset.session.facets.len(), 6);
    }
    // Boards in front of undeflected beams stand in six sectors, wherever the seam is.
    let direct = |dataset: &Dataset| {
        let labels = dataset.poses.iter().map(|p| &p.label);
        labels.filter(|l| l.facet.is_none() && l.board.is_some()).count()
    };
    assert_eq!(found.each_ref().map(|f| direct(&f.0)), [9; 3]);
}

#[test]
fn a_gap_goes_over_the_seam() {
    let gap = |first_deg| {
        let mut scene = beginning_at(first_deg);
        let post = "name = \"post\"\ncenter_mm = [60, 0, 0]\nsize_mm = [4, 40, 20]";
        scene.superstructure.facet.clear();
        scene.superstructure.post = vec![toml::from_str(post).unwrap()];
        let analysis = layout::analyze(&scene, None, layout::Detail::Coarse).unwrap();
        (
            analysis.largest_gap_deg,
            analysis.field_of_regard,
            analysis.share_within_5_deg,
        )
    };
    let [at_seam, aside] = [0.0, 90.0].map(gap);
    assert!(at_seam.0 > 35.0, "{at_seam:?}");
    assert_eq!(at_seam.0, aside.0);
    assert!((at_seam.1 / aside.1 - 1.0).abs() < 1e-9 && (at_seam.2 - aside.2).abs() < 1e-3);
}

#[test]
fn what_no_scanner_can_is_refused_with_its_key() {
    let check = |change: [&str; 2]| {
        let text = ALL_AROUND.replace(change[0], change[1]);
        assert_ne!(text, ALL_AROUND, "{change:?}");
        scene_file::parse(&text, "scene.toml", &[])
            .expect_err(change[1])
            .to_string()
    };
    for (change, words) in [
        (["beams = 1440", "beams = 1500"], "scanner.custom.step_deg"),
        (["beams = 1440", "beams = 0"], "scanner.custom.beams"),
        (
            ["scan_rate_hz = 10", "scan_rate_hz = 10\nbeam_time_us = 90"],
            "scanner.custom.beam_time_us",
        ),
        (
            ["scan_rate_hz = 10", "scan_rate_hz = 10\ndirection = \"left\""],
            "ccw",
        ),
        (
            ["beams = 1440", "beams = 720"],
            "the scan reaches from 0° to 179.75°",
        ),
    ] {
        let error = check(change);
        assert!(error.contains(words), "{words}: {error}");
    }
}

/// A dataset as version 1 wrote it.
fn aged(folder: &Path) {
    let path = folder.join("session.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let new = ["first_deg", "direction", "beam_time_us"];
    let old = text
        .lines()
        .filter(|line| !new.iter().any(|key| line.starts_with(key)));
    let old = old.map(|line| {
        if line == "schema_version = 2" {
            "schema_version = 1"
        } else {
            line
        }
    });
    let old = old.collect::<Vec<_>>().join("\n");
    assert_eq!(text.lines().count(), old.lines().count() + new.len());
    std::fs::write(&path, old).unwrap();
    std::fs::remove_file(folder.join("manifest.json")).unwrap();
}

#[test]
fn files_of_version_1_are_read() {
    let folder = tempfile::tempdir().unwrap();
    let at = |arguments: &[&str]| run(folder.path(), arguments);
    simulate(folder.path(), TWO_MIRROR, "data", &[]);
    let data = folder.path().join("data");
    let new = read_dataset(&data).unwrap();
    succeeds(&at(&["calibrate", "data", "--out", "new.json"]));
    aged(&data);
    assert_eq!(read_dataset(&data).unwrap(), new);
    assert_eq!(new.session.scanner.scan, ScanGeometry::default());

    let mut calibration: Calibration =
        serde_json::from_slice(&std::fs::read(folder.path().join("new.json")).unwrap()).unwrap();
    (
        calibration.schema_version,
        calibration.scanner,
        calibration.dataset,
    ) = (1, None, None);
    let text = serde_json::to_string(&calibration).unwrap();
    assert!(!text.contains("\"scanner\"") && !text.contains("\"dataset\""));
    std::fs::write(folder.path().join("old.json"), text).unwrap();
    succeeds(&at(&["validate", "old.json"]));
    let scores = ["new.json", "old.json"].map(|file| {
        let said = succeeds(&at(&["score", "data", file, "--json"]));
        let mut score: serde_json::Value = serde_json::from_str(&said).unwrap();
        // Whether it is of this dataset is all that an old file does not state.
        let gates = score["gates"].as_array_mut().unwrap();
        gates.retain(|g| g["name"] != "dataset");
        score
    });
    assert_eq!(scores[0], scores[1]);
}

#[test]
fn calibrations_of_other_datasets_and_scanners_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let at = |arguments: &[&str]| run(folder.path(), arguments);
    simulate(folder.path(), TWO_MIRROR, "own", &[]);
    simulate(folder.path(), TWO_MIRROR, "again", &["--seed", "2"]);
    simulate(folder.path(), OTHERS[1].1, "clockwise", &[]);
    for data in ["own", "again", "clockwise"] {
        succeeds(&at(&[
            "calibrate",
            data,
            "--method",
            "beam",
            "--out",
            &format!("{data}.json"),
        ]));
    }
    let ids = ["own", "again"].map(|data| {
        let manifest = json(&folder.path().join(data).join("manifest.json"));
        manifest["files"]["observations.mcap"]
            .as_str()
            .unwrap()
            .to_owned()
    });
    // Another dataset of the same scanner is what `apply` and a page are for, and nothing to be scored against.
    let score = at(&["score", "own", "again.json", "--json"]);
    assert_eq!(score.status.code(), Some(1));
    let json: serde_json::Value = serde_json::from_str(&stdout(&score)).unwrap();
    assert_eq!(json["verdict"], "fail");
    let first = json["warnings"][0].as_str().unwrap();
    assert!(first.contains("another dataset"), "{first}");
    assert!(first.contains(&ids[0]) && first.contains(&ids[1]), "{first}");
    assert!(stderr(&score).contains("another dataset"));
    let compared = at(&["compare", "own", "own.json", "again.json"]);
    assert_eq!(compared.status.code(), Some(1));
    assert!(stderr(&compared).contains("again.json: fails: the calibration was made from another dataset"));
    succeeds(&at(&["compare", "own", "own.json"]));
    succeeds(&at(&["apply", "own", "again.json", "--out", "cloud.ply"]));
    succeeds(&at(&["report", "own", "again.json", "--out", "report.html"]));
    // Another scanner is an error everywhere.
    for verb in [
        &["score", "own", "clockwise.json"][..],
        &["compare", "own", "own.json", "clockwise.json"],
        &["apply", "own", "clockwise.json", "--out", "other.ply"],
        &["report", "own", "clockwise.json", "--out", "other.html"],
    ] {
        let output = at(verb);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{verb:?}: {said}");
        assert!(
            said.contains("the calibration is of a scanner with 541 beams of 0.5° from 135°"),
            "{said}"
        );
        assert!(
            said.contains("the dataset's has 1081 beams of 0.25° from -135°"),
            "{said}"
        );
    }
    assert!(!folder.path().join("other.ply").exists());
}

#[test]
fn a_session_of_any_geometry_survives_its_file() {
    for (name, text, ..) in OTHERS {
        let laboratory = Laboratory::new(&scene(text), 1).unwrap();
        let session = laboratory.session().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("data");
        let writer = DatasetWriter::create(&out, false, &session).unwrap();
        let provenance = Provenance {
            seed: 1,
            command_line: "a session".to_owned(),
            rng_rule: String::new(),
        };
        writer.finish(provenance).unwrap();
        assert_eq!(catoptric::files::read_session(&out).unwrap(), session, "{name}");
    }
}
