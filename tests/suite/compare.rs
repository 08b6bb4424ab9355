//! Judging third-party calibrations through the program: `compare`, `score` and `validate` on files as others write them.
//!
//! These prove what the program reports about a file, not that any method is good. Submissions are derived from the
//! truth, so that the expected results are known.

use crate::common::{run, stderr, stdout};
use catoptric::sim::Truth;
use catoptric::sim::truth::BeamClass;
use serde_json::{Value, json};
use std::path::Path;

/// A small dataset of the default scene in the folder.
fn simulate(folder: &Path, scene: &str, out: &str, more: &[&str]) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join(scene);
    let sets = [
        "experiment.scans_per_pose=5",
        "experiment.room_scans=5",
        "experiment.bare_scans=5",
        "scanner.sub_rays=1",
    ];
    let mut arguments = vec!["simulate", scene.to_str().unwrap(), "--out", out];
    for set in sets {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    let output = run(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

fn truth_of(folder: &Path, dataset: &str) -> Truth {
    let text = std::fs::read_to_string(folder.join(dataset).join("truth/truth.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The truth as a third party would submit it: deflected elements only, in reverse order, without optional keys.
/// `lift_rad` is added to every elevation, `sd_rad` is stated for both angles.
fn submission(truth: &Truth, lift_rad: f64, sd_rad: Option<f64>) -> Value {
    let element = |b: &catoptric::sim::truth::TrueBeam| {
        let mut entry = json!({
            "beam": b.beam,
            "status": "solved",
            "azimuth_rad": b.azimuth_rad.unwrap(),
            "elevation_rad": b.elevation_rad.unwrap() + lift_rad,
            "distance_m": b.distance_m.unwrap(),
        });
        if let Some(sd) = sd_rad {
            entry["covariance_rad2"] = json!([[sd * sd, 0.0], [0.0, sd * sd]]);
        }
        entry
    };
    let deflected = truth.beams.iter().filter(|b| b.status == BeamClass::Deflected);
    json!({
        "schema_version": 1,
        "method": "nobody's yet",
        "frame": "sensor",
        "beams": deflected.rev().map(element).collect::<Vec<_>>(),
    })
}

fn write(folder: &Path, name: &str, value: &Value) {
    std::fs::write(folder.join(name), value.to_string()).unwrap();
}

fn json_of(folder: &Path, arguments: &[&str], code: i32) -> Value {
    let output = run(folder, arguments);
    assert_eq!(
        output.status.code(),
        Some(code),
        "{arguments:?}: {}",
        stderr(&output)
    );
    serde_json::from_str(&stdout(&output)).unwrap()
}

#[test]
fn the_truth_as_a_third_party_submission_has_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "scenes/two-mirror.toml", "data", &[]);
    let truth = truth_of(at, "data");
    write(at, "truth.json", &submission(&truth, 0.0, None));
    let output = run(at, &["validate", "truth.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let score = json_of(at, &["score", "data", "truth.json", "--json"], 1);
    // It has no error, but it does not state a covariance either.
    assert_eq!(score["verdict"], "not_judged");
    assert_eq!(
        (&score["per_axis_rms_deg"], &score["point_mm"]["at_10m"]),
        (&json!(0.0), &json!(0.0))
    );
    assert_eq!(score["beams"]["missed"], 0);
    assert!(score["honesty"].is_null());
    assert_eq!(score["nulls"]["honesty"], "no scored element has a covariance");
    // Half of the elements are a valid submission too: the other half is missed, which is not an error of the program.
    let mut half = submission(&truth, 0.0, None);
    let beams = half["beams"].as_array_mut().unwrap();
    let all = beams.len();
    beams.truncate(all / 2);
    write(at, "half.json", &half);
    let score = json_of(at, &["score", "data", "half.json", "--json"], 1);
    assert_eq!(score["beams"]["missed"], all - all / 2);
    assert_eq!(score["per_axis_rms_deg"], 0.0);
}

#[test]
fn over_confidence_and_the_limit_decide_the_exit_code() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "scenes/two-mirror.toml", "data", &[]);
    let truth = truth_of(at, "data");
    // All elevations have an error of 0.1°: per axis 0.1°/√2 = 0.0707°.
    let lift = 0.1_f64.to_radians();
    write(
        at,
        "honest.json",
        &submission(&truth, lift, Some(lift / 2.0_f64.sqrt())),
    );
    write(at, "over.json", &submission(&truth, lift, Some(lift / 10.0)));
    let score = json_of(at, &["score", "data", "honest.json", "--json"], 0);
    assert_eq!(
        (&score["verdict"], &score["honesty"]),
        (&json!("pass"), &json!("honest"))
    );
    json_of(
        at,
        &["score", "data", "honest.json", "--json", "--max-rms-deg", "0.071"],
        0,
    );
    let score = json_of(
        at,
        &["score", "data", "honest.json", "--json", "--max-rms-deg", "0.070"],
        1,
    );
    assert!(
        score["warnings"][0]
            .as_str()
            .unwrap()
            .starts_with("fails: the per-axis error is 0.0707°"),
        "{score}"
    );
    // eᵀP⁻¹e = 100 over two dimensions: errors √50 times the stated ones.
    let score = json_of(at, &["score", "data", "over.json", "--json"], 1);
    assert_eq!(score["honesty"], "over_confident");
    let said = stdout(&run(at, &["score", "data", "over.json"]));
    assert!(
        said.contains("over-confident: errors are 7.1 times what it states"),
        "{said}"
    );
    let output = run(at, &["score", "data", "over.json", "--max-rms-deg", "0"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
}

#[test]
fn compare_sorts_by_the_point_error_and_reports_over_confidence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "scenes/two-mirror.toml", "data", &[]);
    let truth = truth_of(at, "data");
    let lift = 0.1_f64.to_radians();
    write(at, "far.json", &submission(&truth, 2.0 * lift, Some(lift / 10.0)));
    write(at, "near.json", &submission(&truth, lift, Some(lift)));
    write(at, "truth.json", &submission(&truth, 0.0, Some(lift)));
    let arguments = ["compare", "data", "far.json", "near.json", "truth.json"];
    // The verdict on one of them is "fail", and so is that of the comparison.
    let found = json_of(at, &[&arguments[..], &["--json"]].concat(), 1);
    assert_eq!(found["verdict"], "fail");
    let names: Vec<&Value> = found["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| &r["name"])
        .collect();
    assert_eq!(names, ["truth.json", "near.json", "far.json"]);
    assert_eq!(found["rows"][2]["verdict"], "fail");
    assert_eq!(found["rows"][2]["honesty"], "over_confident");
    let pair = &found["pairs"][1];
    assert_eq!(
        (&pair["first"], &pair["second"]),
        (&json!("truth.json"), &json!("far.json"))
    );
    assert!(
        (pair["direction_rms_deg"].as_f64().unwrap() - 0.2).abs() < 1e-9,
        "{pair}"
    );
    assert!(
        (pair["direction_max_deg"].as_f64().unwrap() - 0.2).abs() < 1e-9,
        "{pair}"
    );
    // (2·lift)²/(lift² + lift²/100)/2
    assert!(
        (pair["normalized_square"].as_f64().unwrap() - 2.0 / 1.01).abs() < 1e-9,
        "{pair}"
    );
    let said = stdout(&run(at, &arguments));
    let rows: Vec<&str> = said.lines().map(str::trim_start).collect();
    assert!(
        rows[2].starts_with("truth.json") && rows[4].starts_with("far.json"),
        "{said}"
    );
    assert!(
        rows[4].ends_with("fail, over-confident: errors are 14.1 times what it states"),
        "{said}"
    );

    std::fs::remove_dir_all(at.join("data/truth")).unwrap();
    let arguments = [&arguments[..], &["--blind"]].concat();
    let blind = json_of(at, &[&arguments[..], &["--json"]].concat(), 0);
    assert_eq!(blind["blind"], true);
    assert_eq!(blind["rows"][0]["name"], "truth.json");
    assert!(blind["rows"][0]["point_4m_mm"].is_null() && blind["rows"][0]["walls_rms_mm"].is_number());
    let said = stdout(&run(at, &arguments));
    assert!(
        said.starts_with("3 calibrations, no truth: residuals on boards and walls only"),
        "{said}"
    );
    let output = run(at, &["compare", "data"]);
    assert_eq!(output.status.code(), Some(2));
    let output = run(at, &["compare", "data", "nowhere.json", "--blind"]);
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
}

#[test]
fn a_blind_run_is_the_same_recording_without_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "scenes/two-mirror.toml", "open", &[]);
    simulate(at, "scenes/two-mirror.toml", "blind", &["--blind"]);
    let read = |name: &str| std::fs::read(at.join(name)).unwrap();
    for name in ["observations.mcap", "session.toml"] {
        assert!(
            read(&format!("open/{name}")) == read(&format!("blind/{name}")),
            "{name}"
        );
    }
    let mut files: Vec<_> = std::fs::read_dir(at.join("blind"))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    files.sort();
    assert_eq!(files, ["manifest.json", "observations.mcap", "session.toml"]);
    let manifest: Value = serde_json::from_slice(&read("blind/manifest.json")).unwrap();
    assert!(manifest["scene_sha256"].is_null());
    assert!(manifest["command_line"].is_null() && manifest["seed"].is_null());
    assert_eq!(manifest["blind"], true);
    write(at, "c.json", &submission(&truth_of(at, "open"), 0.0, Some(1e-3)));
    let score = json_of(at, &["score", "blind", "c.json", "--json"], 0);
    assert_eq!(score["verdict"], "blind");
    // A limit is not tested without a truth; that is reported, but is not a failure.
    let score = json_of(
        at,
        &["score", "blind", "c.json", "--json", "--max-rms-deg", "0.001"],
        0,
    );
    let said = score["warnings"].to_string();
    assert!(said.contains("the limit of 0.001° was not tested"), "{said}");
    let output = run(at, &["simulate", "x.toml", "--out", "y", "--blind", "--returns"]);
    assert_eq!(output.status.code(), Some(2));
}

#[test]
fn a_scanner_without_mirrors_does_not_pass() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "scenes/traps/flat-wall.toml", "data", &[]);
    let mut nothing = submission(&truth_of(at, "data"), 0.0, None);
    assert_eq!(nothing["beams"], json!([]));
    write(at, "nothing.json", &nothing);
    // A calibration lists at least one element.
    json_of(at, &["score", "data", "nothing.json", "--json"], 2);
    nothing["beams"] = json!([{ "beam": 540, "status": "direct" }]);
    write(at, "nothing.json", &nothing);
    let score = json_of(at, &["score", "data", "nothing.json", "--json"], 1);
    assert_eq!(
        (&score["verdict"], &score["beams"]["deflected"]),
        (&json!("not_judged"), &json!(0))
    );
    let said = stdout(&run(at, &["score", "data", "nothing.json"]));
    assert!(
        said.starts_with("not_judged: ") && said.contains("there is nothing to judge"),
        "{said}"
    );
    nothing["beams"] = json!([{ "beam": 540, "status": "solved", "azimuth_rad": 0.1, "elevation_rad": 0.5 }]);
    write(at, "false.json", &nothing);
    let score = json_of(at, &["score", "data", "false.json", "--json"], 1);
    assert_eq!(score["beams"]["false"], 1);
}
