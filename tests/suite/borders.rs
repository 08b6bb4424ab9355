//! What comes from outside is refused with its place, or used and named: claims of calibrations, names of mirrors, truths that
//! nothing verifies, meshes and hits at 10 km, bytes that editors add.
//!
//! The limits themselves are up to the unit tests of score, validation and files.

use crate::common::{run, stderr, stdout};
use catoptric::{LayoutOptions, Scene, distinct_names, layout};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::LazyLock;

/// A dataset of two mirrors, and a calibration of it.
struct Lab {
    folder: tempfile::TempDir,
    calibration: Value,
}

static LAB: LazyLock<Lab> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/two-mirror.toml");
    let sets = [
        "experiment.scans_per_pose=10",
        "experiment.room_scans=10",
        "scanner.sub_rays=1",
    ];
    let mut arguments = vec!["simulate", scene.to_str().unwrap(), "--out", "data", "-q"];
    sets.iter().for_each(|set| arguments.extend(["--set", set]));
    succeed(at, &arguments);
    succeed(
        at,
        &["calibrate", "data", "--cross-validate", "--out", "c.json", "-q"],
    );
    let text = std::fs::read_to_string(at.join("c.json")).unwrap();
    Lab {
        folder,
        calibration: serde_json::from_str(&text).unwrap(),
    }
});

fn succeed(at: &Path, arguments: &[&str]) -> String {
    let output = run(at, arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    stdout(&output)
}

/// The score of a changed calibration, and its exit code.
fn judged(name: &str, more: &[&str], change: impl FnOnce(&mut Value)) -> (Value, Option<i32>) {
    let at = LAB.folder.path();
    let mut calibration = LAB.calibration.clone();
    change(&mut calibration);
    std::fs::write(at.join(name), calibration.to_string()).unwrap();
    let output = run(at, &[&["score", "data", name, "--json"], more].concat());
    (
        serde_json::from_str(&stdout(&output)).unwrap(),
        output.status.code(),
    )
}

fn unmet(score: &Value) -> Vec<&str> {
    let gates = score["gates"].as_array().unwrap().iter();
    gates
        .filter(|g| !["pass", "not_tested"].contains(&g["outcome"].as_str().unwrap()))
        .map(|g| g["name"].as_str().unwrap())
        .collect()
}

#[test]
fn wrong_range_biases_and_held_out_boards_fail() {
    let (score, code) = judged("right.json", &[], |_| {});
    assert_eq!((unmet(&score), code), (vec![], Some(0)));
    assert!(score["range_bias_mm"].as_f64().unwrap().abs() < 3.0);
    for off in [20.0, 900.0] {
        let (score, code) = judged("offset.json", &[], |c| {
            let offset = &mut c["bias"]["angle"]["offset_mm"];
            *offset = json!(offset.as_f64().unwrap() + off);
        });
        assert_eq!((unmet(&score), code), (vec!["range_bias"], Some(1)), "{off}");
    }
    for more in [&[][..], &["--blind"]] {
        let (score, code) = judged("held-out.json", more, |c| {
            c["assessment"]["held_out"]["rms_mm"] = json!(80.0);
        });
        assert_eq!((unmet(&score), code), (vec!["held_out"], Some(1)));
    }
    let (blind, _) = judged("blind.json", &["--blind"], |_| {});
    assert_eq!(blind["range_bias_mm"], Value::Null);
    assert_eq!(blind["nulls"]["range_bias_mm"], "there is no truth");
}

#[test]
fn a_mirror_that_the_session_does_not_have_is_refused_with_the_nearest() {
    let at = LAB.folder.path();
    let known = LAB.calibration["facets"][0]["facet"].as_str().unwrap();
    let (score, code) = judged("facet.json", &[], |c| {
        let mut beams = c["beams"].as_array_mut().unwrap().iter_mut();
        let b = beams.find(|b| b["facet"] == known).unwrap();
        b["facet"] = json!(format!("{known}z"));
    });
    assert_eq!((unmet(&score), code), (vec!["valid"], Some(2)));
    let words = format!("a mirror that the session does not have; did you mean {known:?}?");
    assert!(score["warnings"][0].as_str().unwrap().contains(&words));
    // Without its dataset a file does not show which mirrors there are.
    succeed(at, &["validate", "facet.json"]);
    succeed(at, &["validate", "c.json", "--dataset", "data"]);
    let output = run(at, &["validate", "facet.json", "--dataset", "data"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains(&words), "{}", stderr(&output));
    let output = run(at, &["apply", "data", "facet.json", "--out", "cloud.ply"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_truth_that_nothing_verifies_is_named() {
    let at = LAB.folder.path();
    let warned = |dataset: &str| {
        let output = run(at, &["score", dataset, "c.json"]);
        stderr(&output).contains("is not verified: there is no manifest.json")
    };
    assert!(!warned("data"));
    let copy = at.join("unverified");
    std::fs::create_dir_all(copy.join("truth")).unwrap();
    for file in ["session.toml", "observations.mcap", "truth/truth.json"] {
        std::fs::copy(at.join("data").join(file), copy.join(file)).unwrap();
    }
    assert!(warned("unverified"));
}

#[test]
fn a_recording_without_known_topics_cannot_be_scored() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::create_dir(at.join("other")).unwrap();
    let session = LAB.folder.path().join("data/session.toml");
    std::fs::copy(session, at.join("other/session.toml")).unwrap();
    std::fs::write(at.join("c.json"), LAB.calibration.to_string()).unwrap();
    let magic = b"\x89MCAP0\r\n";
    let mut bytes = magic.to_vec();
    for (code, body) in [(1_u8, &[0_u8; 8][..]), (15, &[0; 4]), (2, &[0; 20])] {
        bytes.push(code);
        bytes.extend((body.len() as u64).to_le_bytes());
        bytes.extend(body);
    }
    bytes.extend(magic);
    std::fs::write(at.join("other/observations.mcap"), bytes).unwrap();
    let output = run(at, &["score", "other", "c.json", "--blind"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("there is no message in it"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_negative_statistic_is_refused_with_its_place() {
    let at = LAB.folder.path();
    let mut calibration = LAB.calibration.clone();
    calibration["assessment"]["tests"][0]["statistic"] = json!(-1.5);
    std::fs::write(
        at.join("negative.json"),
        serde_json::to_string_pretty(&calibration).unwrap(),
    )
    .unwrap();
    let output = run(at, &["validate", "negative.json"]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("`assessment.tests[0].statistic` is -1.5; 0 to ") && said.contains("negative.json:"),
        "{said}"
    );
}

/// A scene with one surface, a square at a given distance.
fn wall(at: &Path, distance: &str) {
    let corners = ["-5 -5", "5 -5", "5 5", "-5 5"]
        .map(|c| format!("v {distance} {c}\n"))
        .concat();
    std::fs::write(at.join("wall.obj"), format!("{corners}f 1 2 3 4\n")).unwrap();
    succeed(at, &["new", "scene.toml", "--layout", "blank", "-q", "--replace"]);
    let mut text = std::fs::read_to_string(at.join("scene.toml")).unwrap();
    text += "\n[[room.surface]]\nname = \"wall\"\nshape.mesh = { file = \"wall.obj\", units = \"m\" }\n";
    std::fs::write(at.join("scene.toml"), text).unwrap();
}

#[test]
fn a_hit_beyond_10_km_is_found_and_a_mesh_beyond_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    wall(at, "9000");
    // With the byte order mark that spreadsheets write.
    let rays = "\u{feff}x_m,y_m,z_m,dx,dy,dz\n-9000,1,1,1,0,0\n-9000,7,1,1,0,0\n";
    std::fs::write(at.join("rays.csv"), rays).unwrap();
    let said = succeed(
        at,
        &["trace", "scene.toml", "--rays", "rays.csv", "--out", "paths.csv"],
    );
    assert!(said.contains("2 rays, 1 on a surface"), "{said}");
    let paths = std::fs::read_to_string(at.join("paths.csv")).unwrap();
    let row = paths.lines().nth(1).unwrap();
    let path: f64 = row.rsplit(',').next().unwrap().parse().unwrap();
    // Sums of coordinates of 9 km are rounded to picometers.
    assert!(
        row.starts_with("0,0,wall,") && (path - 18_000.0).abs() < 1e-10,
        "{row}"
    );
    wall(at, "10001");
    let output = run(at, &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let words = "`room.surface[0].shape.mesh.file`";
    assert!(
        stderr(&output).contains(words) && stderr(&output).contains("1.0001e4 m; up to 1e4 m is allowed"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn a_byte_order_mark_changes_no_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(at, &["new", "scene.toml", "--layout", "two-mirror", "-q"]);
    let expected = succeed(at, &["layout", "scene.toml", "--coarse", "--json"]);
    let text = std::fs::read_to_string(at.join("scene.toml")).unwrap();
    std::fs::write(at.join("scene.toml"), format!("\u{feff}{text}")).unwrap();
    assert_eq!(
        succeed(at, &["layout", "scene.toml", "--coarse", "--json"]),
        expected
    );
}

#[test]
fn a_study_is_no_file_and_its_programs_are_shown_what_they_get() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeed(at, &["new", "scene.toml", "--layout", "two-mirror", "-q"]);
    std::fs::write(at.join("taken"), "mine").unwrap();
    let output = run(at, &["study", "scene.toml", "--seeds", "1", "--out", "taken"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("taken is a file, and a study is a folder"),
        "{}",
        stderr(&output)
    );
    assert_eq!(std::fs::read_to_string(at.join("taken")).unwrap(), "mine");
    // A command whose quotes do not end, with the example that has both places.
    let arguments = ["study", "scene.toml", "--seeds", "1", "--out", "s", "--program"];
    let output = run(at, &[&arguments[..], &["mine"]].concat());
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("--program 'mine=python3 mine.py {dataset} {out}'"),
        "{}",
        stderr(&output)
    );
}

#[test]
fn layouts_of_one_name_are_told_apart() {
    let scenes = ["a.toml", "b.toml", "a.toml", "c.toml"].map(|file| {
        let name = if file == "c.toml" { "other" } else { "same" };
        let text = include_str!("../../scenes/two-mirror.toml")
            .replace("name = \"two-mirror\"", &format!("name = {name:?}"));
        Scene::parse_in(&text, file, Path::new("."), &[] as &[&str]).unwrap()
    });
    let options = LayoutOptions {
        coarse: true,
        ..LayoutOptions::default()
    };
    let analyses = scenes.each_ref().map(|scene| layout(scene, &options).unwrap());
    let pairs: Vec<_> = scenes.iter().zip(&analyses).collect();
    assert_eq!(
        distinct_names(&pairs),
        [
            "same (a.toml), no. 1",
            "same (b.toml)",
            "same (a.toml), no. 3",
            "other"
        ]
    );
}

#[test]
fn the_guide_lists_all_of_its_chapters_in_order() {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/guide");
    let mut chapters: Vec<(usize, String)> = std::fs::read_dir(&guide)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name != "README.md")
        .map(|name| (name.split('-').next().unwrap().parse().unwrap(), name))
        .collect();
    chapters.sort();
    let index = std::fs::read_to_string(guide.join("README.md")).unwrap();
    let listed: Vec<(usize, String)> = index
        .lines()
        .filter_map(|line| line.strip_prefix("| ")?.split_once(" ["))
        .map(|(number, rest)| {
            let (_, link) = rest.split_once("](").unwrap();
            (
                number.parse().unwrap(),
                link.split(')').next().unwrap().to_owned(),
            )
        })
        .collect();
    assert_eq!(listed, chapters);
}
