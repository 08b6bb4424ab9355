//! The referee: falsified calibrations of one dataset, with the verdict and the exit code of every verb that judges.
//!
//! They prove that each kind of falsification is found and named, on one calibration of one scene. How small a one can be
//! found is up to the unit tests of the score.

use crate::common::{run, stderr, stdout};
use serde_json::{Value, json};
use std::f64::consts::{PI, TAU};
use std::path::Path;
use std::sync::LazyLock;

/// Two datasets of one scene under different seeds, and a calibration of each.
struct Lab {
    folder: tempfile::TempDir,
    calibration: Value,
    other: Value,
}

static LAB: LazyLock<Lab> = LazyLock::new(|| {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    simulate(at, "data", &["--seed", "1"]);
    simulate(at, "other", &["--seed", "5"]);
    let calibrated = |dataset: &str| {
        let out = format!("{dataset}.json");
        let output = run(at, &["calibrate", dataset, "--out", &out]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        serde_json::from_str(&std::fs::read_to_string(at.join(out)).unwrap()).unwrap()
    };
    let (calibration, other) = (calibrated("data"), calibrated("other"));
    Lab {
        folder,
        calibration,
        other,
    }
});

/// A small dataset of the two-mirror scene.
fn simulate(at: &Path, out: &str, more: &[&str]) {
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/two-mirror.toml");
    let mut arguments = vec!["simulate", scene.to_str().unwrap(), "--out", out];
    for set in [
        "experiment.scans_per_pose=10",
        "experiment.room_scans=10",
        "scanner.sub_rays=1",
    ] {
        arguments.extend(["--set", set]);
    }
    arguments.extend(more);
    let output = run(at, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

fn solved(calibration: &mut Value) -> impl Iterator<Item = &mut Value> {
    let beams = calibration["beams"].as_array_mut().unwrap();
    beams.iter_mut().filter(|b| b["status"] == "solved")
}

/// Changes a number of every solved element.
fn change(calibration: &mut Value, key: &str, new: impl Fn(f64, f64) -> f64) {
    for b in solved(calibration) {
        let beam = b["beam"].as_f64().unwrap();
        b[key] = json!(new(b[key].as_f64().unwrap(), (-135.0 + 0.25 * beam).to_radians()));
    }
}

fn scale_covariance(calibration: &mut Value, factor: f64) {
    for b in solved(calibration) {
        for row in b["covariance_rad2"].as_array_mut().unwrap() {
            for x in row.as_array_mut().unwrap() {
                *x = json!(x.as_f64().unwrap() * factor);
            }
        }
    }
}

fn drop_key(b: &mut Value, key: &str) {
    b.as_object_mut().unwrap().remove(key);
}

/// Judges a falsified calibration by every verb; returns the score.
fn judged(name: &str, falsify: impl FnOnce(&mut Value), verdict: &str, code: i32, valid: i32) -> Value {
    let lab = &*LAB;
    let at = lab.folder.path();
    let mut calibration = lab.calibration.clone();
    falsify(&mut calibration);
    let file = format!("{}.json", name.replace(' ', "-"));
    std::fs::write(at.join(&file), calibration.to_string()).unwrap();
    let junit = format!("{file}.xml");
    let output = run(at, &["score", "data", &file, "--json", "--junit", &junit]);
    let score: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let found = (score["verdict"].as_str().unwrap(), output.status.code());
    assert_eq!(found, (verdict, Some(code)), "{name}: {}", stderr(&output));
    // The terminal, the JUnit file and the JSON say the same.
    let said = run(at, &["score", "data", &file]);
    assert_eq!(said.status.code(), Some(code));
    assert!(
        stdout(&said).starts_with(&format!("{verdict}: ")),
        "{}",
        stdout(&said)
    );
    let xml = std::fs::read_to_string(at.join(&junit)).unwrap();
    assert!(
        xml.contains(&format!("<property name=\"verdict\" value=\"{verdict}\"/>")),
        "{xml}"
    );
    for gate in score["gates"].as_array().unwrap() {
        let outcome = gate["outcome"].as_str().unwrap();
        if !["pass", "not_tested"].contains(&outcome) {
            assert!(
                stderr(&said).contains(gate["message"].as_str().unwrap()),
                "{name}: {}",
                stderr(&said)
            );
        }
    }
    let output = run(at, &["compare", "data", &file, "--json"]);
    let compared: Value = serde_json::from_str(&stdout(&output)).unwrap();
    let found = (compared["verdict"].as_str().unwrap(), output.status.code());
    assert_eq!(found, (verdict, Some(code)), "{name}: {}", stderr(&output));
    assert_eq!(compared["rows"][0]["gates"], score["gates"]);
    let output = run(at, &["validate", &file, "--json"]);
    assert_eq!(output.status.code(), Some(valid), "{name}: {}", stderr(&output));
    let validated: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(validated["verdict"], if valid == 0 { "pass" } else { "invalid" });
    // No cloud is made of what is refused.
    let output = run(at, &["apply", "data", &file, "--out", "cloud.ply", "--replace"]);
    assert_eq!(output.status.code(), Some(valid), "{name}: {}", stderr(&output));
    if valid != 0 {
        let first = &validated["problems"][0]["message"];
        assert!(
            stderr(&output).contains(first.as_str().unwrap()),
            "{}",
            stderr(&output)
        );
    }
    // The page agrees, or is not written.
    let output = run(at, &["report", "data", &file, "--out", "page.html"]);
    assert_eq!(
        output.status.code(),
        Some(if code == 2 { 2 } else { 0 }),
        "{name}: {}",
        stderr(&output)
    );
    if code != 2 {
        let page = std::fs::read_to_string(at.join("page.html")).unwrap();
        assert!(
            page.contains(&format!(
                "<span class=\"badge\">{}</span>",
                verdict.replace('_', " ").to_uppercase()
            )),
            "{name}"
        );
    }
    score
}

/// The gates that are not met.
fn unmet(score: &Value) -> Vec<&str> {
    let gates = score["gates"].as_array().unwrap().iter();
    gates
        .filter(|g| !["pass", "not_tested"].contains(&g["outcome"].as_str().unwrap()))
        .map(|g| g["name"].as_str().unwrap())
        .collect()
}

fn corrections(score: &Value) -> Vec<&str> {
    let mistakes = score["mistakes"].as_array().unwrap().iter();
    mistakes.map(|m| m["correction"].as_str().unwrap()).collect()
}

#[test]
fn as_calibrated_it_passes() {
    let score = judged("unchanged", |_| {}, "pass", 0, 0);
    assert_eq!(
        (&score["honesty"], &score["stated"]),
        (&json!("honest"), &json!(1.0))
    );
    assert_eq!(corrections(&score), [""; 0]);
    assert_eq!(score["knowable"], score["knowable_solved"]);
}

#[test]
fn wrong_distances_fail() {
    for off in [0.02, -0.02, 0.2] {
        let falsify = |c: &mut Value| change(c, "distance_m", |d, _| (d + off).max(0.001));
        let score = judged(&format!("distances {off}"), falsify, "fail", 1, 0);
        assert_eq!(unmet(&score), ["distance", "worst_distance"], "{off}");
    }
    // One in eight is enough.
    let some = |c: &mut Value| {
        for b in solved(c).step_by(8) {
            b["distance_m"] = json!(b["distance_m"].as_f64().unwrap() + 0.05);
        }
    };
    judged("some distances", some, "fail", 1, 0);
}

#[test]
fn a_wrong_mounting_fails() {
    let shift = |c: &mut Value| {
        let x = &mut c["rig_from_sensor"]["translation_m"][0];
        *x = json!(x.as_f64().unwrap() + 0.1);
    };
    assert_eq!(
        unmet(&judged("mounting shifted", shift, "fail", 1, 0)),
        ["mounting"]
    );
    let turn = |c: &mut Value| {
        // q·(0, sin 2.5°, 0, cos 2.5°)
        let q: Vec<f64> = serde_json::from_value(c["rig_from_sensor"]["rotation_xyzw"].clone()).unwrap();
        let (s, k) = 2.5_f64.to_radians().sin_cos();
        c["rig_from_sensor"]["rotation_xyzw"] = json!([
            k * q[0] - s * q[2],
            k * q[1] + s * q[3],
            k * q[2] + s * q[0],
            k * q[3] - s * q[1]
        ]);
    };
    let score = judged("mounting turned", turn, "fail", 1, 0);
    assert_eq!(unmet(&score), ["mounting"]);
    assert!((score["mounting"]["attitude_deg"].as_f64().unwrap() - 5.0).abs() < 0.2);
    // Without its covariance, too.
    let bare = |c: &mut Value| {
        shift(c);
        drop_key(&mut c["rig_from_sensor"], "covariance");
    };
    assert_eq!(
        unmet(&judged("mounting without covariance", bare, "fail", 1, 0)),
        ["mounting"]
    );
}

#[test]
fn another_frame_fails_and_a_stated_one_is_invalid() {
    // x forward, y left, z up taken for x right, y forward.
    let turned = |c: &mut Value| change(c, "azimuth_rad", |a, _| (a + PI / 2.0 + PI).rem_euclid(TAU) - PI);
    let score = judged("frame", turned, "fail", 1, 0);
    assert_eq!(corrections(&score), ["the axes (y, −x, z) taken for (x, y, z)"]);
    judged("stated frame", |c| c["frame"] = json!("room"), "invalid", 2, 2);
}

#[test]
fn a_negated_elevation_fails_and_is_named() {
    let score = judged("phi", |c| change(c, "elevation_rad", |e, _| -e), "fail", 1, 0);
    assert_eq!(corrections(&score), ["φ negated"]);
    let warnings = score["warnings"].to_string();
    assert!(
        warnings.contains("with φ negated, the per-axis error would be 0.0"),
        "{warnings}"
    );
    assert!(!warnings.contains("common mode dominates"), "{warnings}");
}

#[test]
fn an_absolute_azimuth_fails_and_is_named() {
    let absolute = |c: &mut Value| change(c, "azimuth_rad", |a, base| (a + base + PI).rem_euclid(TAU) - PI);
    let score = judged("azimuth", absolute, "fail", 1, 0);
    assert_eq!(
        corrections(&score),
        ["the azimuth read from the sensor's x axis (θ_a is measured from the undeflected beam)"]
    );
}

#[test]
fn a_calibration_of_another_dataset_fails_with_its_identifier_and_without() {
    let other = |c: &mut Value| *c = LAB.other.clone();
    let score = judged("another dataset", other, "fail", 1, 0);
    assert!(unmet(&score).contains(&"dataset"));
    assert!(
        score["warnings"][0].as_str().unwrap().contains("another dataset"),
        "{}",
        score["warnings"]
    );
    let anonymous = |c: &mut Value| {
        *c = LAB.other.clone();
        drop_key(c, "dataset");
    };
    let score = judged("another dataset without identifier", anonymous, "fail", 1, 0);
    assert!(
        corrections(&score)[0].contains("another dataset's"),
        "{:?}",
        corrections(&score)
    );
}

#[test]
fn over_confidence_fails() {
    for factor in [1.0 / 64.0, 0.01, 1e-6] {
        let score = judged(
            &format!("over {factor}"),
            |c| scale_covariance(c, factor),
            "fail",
            1,
            0,
        );
        assert_eq!(score["honesty"], "over_confident");
        let gates = score["gates"].as_array().unwrap();
        let gate = gates.iter().find(|g| g["name"] == "directions").unwrap();
        assert_eq!(gate["false_alarm_rate"], 0.005);
        assert!(gate["at_most"].is_number() && gate["found"].is_number());
    }
}

#[test]
fn omitted_halves_fail() {
    let beams = |c: &mut Value| {
        let all = c["beams"].as_array_mut().unwrap();
        all.truncate(all.len() / 2);
    };
    assert_eq!(
        unmet(&judged("half of the beams", beams, "fail", 1, 0)),
        ["missed", "solved"]
    );
    let rejected = |every: usize| {
        move |c: &mut Value| {
            for b in solved(c).step_by(every) {
                *b = json!({ "beam": b["beam"], "status": "rejected", "reason": "no time" });
            }
        }
    };
    assert_eq!(
        unmet(&judged("half abstained", rejected(2), "fail", 1, 0)),
        ["solved"]
    );
    assert_eq!(
        unmet(&judged("all abstained", rejected(1), "fail", 1, 0)),
        ["solved"]
    );
    judged("a twentieth abstained", rejected(20), "pass", 0, 0);
    for key in ["covariance_rad2", "distance_m"] {
        let without = |c: &mut Value| solved(c).step_by(2).for_each(|b| drop_key(b, key));
        judged(&format!("half without {key}"), without, "fail", 1, 0);
    }
}

#[test]
fn what_validate_refuses_is_invalid() {
    let twice = |c: &mut Value| {
        let beams = c["beams"].as_array_mut().unwrap();
        let one = beams[400].clone();
        beams.push(one);
    };
    judged("duplicates", twice, "invalid", 2, 2);
    let score = judged(
        "times 1000",
        |c| change(c, "distance_m", |d, _| 1e3 * d),
        "invalid",
        2,
        2,
    );
    assert_eq!(corrections(&score), ["d in millimeters"]);
    judged(
        "negative",
        |c| change(c, "distance_m", |d, _| -d),
        "invalid",
        2,
        2,
    );
    let degrees = |c: &mut Value| {
        change(c, "elevation_rad", |e, _| e.to_degrees());
        change(c, "azimuth_rad", |a, _| a.to_degrees());
    };
    assert_eq!(
        corrections(&judged("degrees", degrees, "invalid", 2, 2)),
        ["the angles read as degrees"]
    );
    let asymmetric = |c: &mut Value| {
        for b in solved(c) {
            let x = b["covariance_rad2"][0][0].as_f64().unwrap();
            b["covariance_rad2"][0][1] = json!(0.1 * x);
        }
    };
    judged("asymmetric", asymmetric, "invalid", 2, 2);
}

#[test]
fn without_a_covariance_nothing_is_judged() {
    let without = |c: &mut Value| solved(c).for_each(|b| drop_key(b, "covariance_rad2"));
    let score = judged("no covariance", without, "not_judged", 1, 0);
    assert_eq!(unmet(&score), ["covariance"]);
    assert!(score["honesty"].is_null());
    // However large the error is.
    let worse = |c: &mut Value| {
        without(c);
        change(c, "elevation_rad", |e, _| -e);
    };
    let score = judged("no covariance and phi", worse, "not_judged", 1, 0);
    assert_eq!(corrections(&score), ["φ negated"]);
}

#[test]
fn under_confidence_passes_with_a_warning() {
    let score = judged("under", |c| scale_covariance(c, 100.0), "pass", 0, 0);
    assert_eq!(score["honesty"], "under_confident");
    assert!(
        score["warnings"]
            .to_string()
            .contains("under-confident: errors are 0.0"),
        "{}",
        score["warnings"]
    );
}

#[test]
fn figures_are_gated_by_name() {
    let at = LAB.folder.path();
    for (option, value, code) in [
        ("--max", "per_axis_rms_deg=0.2", 0),
        ("--max", "per_axis_rms_deg=0.0001", 1),
        ("--min", "coverage_95=0.5", 0),
        ("--min", "beams.solved=100000", 1),
        ("--require", "point_mm.at_4m<=100", 0),
        ("--require", "point_mm.at_4m<=0.001", 1),
        ("--min-solved", "0.99", 0),
        ("--max", "per_axis_rms=0.2", 2),
        ("--max", "per_axis_rms_deg<=0.2", 2),
        ("--require", "per_axis_rms_deg", 2),
        ("--min-solved", "1.1", 2),
    ] {
        for verb in ["score", "compare"] {
            let output = run(at, &[verb, "data", "data.json", option, value]);
            assert_eq!(
                output.status.code(),
                Some(code),
                "{verb} {option} {value}: {}",
                stderr(&output)
            );
        }
    }
    let output = run(at, &["score", "data", "data.json", "--max", "per_axis_rms=1"]);
    assert!(
        stderr(&output).contains("did you mean per_axis_rms_deg?"),
        "{}",
        stderr(&output)
    );
    let output = run(
        at,
        &[
            "score",
            "data",
            "data.json",
            "--max",
            "per_axis_rms_deg=0.0001",
            "--json",
        ],
    );
    let score: Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!(unmet(&score), ["per_axis_rms_deg<=0.0001"]);
    assert!(
        stderr(&output).contains("required per_axis_rms_deg<=0.0001"),
        "{}",
        stderr(&output)
    );
    // The worst verdict of several counts.
    std::fs::write(at.join("nothing-states.json"), {
        let mut c = LAB.calibration.clone();
        solved(&mut c).for_each(|b| drop_key(b, "covariance_rad2"));
        c.to_string()
    })
    .unwrap();
    let output = run(at, &["compare", "data", "data.json", "nothing-states.json"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        stderr(&output).contains("nothing-states.json: not judged: "),
        "{}",
        stderr(&output)
    );
}

/// A copy of the dataset with one change.
fn copied(to: &str, change: impl FnOnce(&Path)) -> String {
    let at = LAB.folder.path();
    let copy = at.join(to);
    for entry in [
        "manifest.json",
        "session.toml",
        "observations.mcap",
        "truth/truth.json",
        "truth/scene.toml",
    ] {
        std::fs::create_dir_all(copy.join(entry).parent().unwrap()).unwrap();
        std::fs::copy(at.join("data").join(entry), copy.join(entry)).unwrap();
    }
    change(&copy);
    to.to_owned()
}

#[test]
fn blind_is_said_by_the_manifest_or_asked_for() {
    let at = LAB.folder.path();
    let code = |arguments: &[&str]| {
        let output = run(at, arguments);
        (output.status.code().unwrap(), stdout(&output), stderr(&output))
    };
    let deleted = copied("deleted", |folder| {
        std::fs::remove_dir_all(folder.join("truth")).unwrap()
    });
    for verb in ["score", "compare"] {
        let (exit, _, said) =
            code(&[verb, &deleted, "data.json", "--max-rms-deg=0.1"][..if verb == "score" { 4 } else { 3 }]);
        assert_eq!(exit, 2, "{said}");
        assert!(
            said.contains("is missing, although manifest.json lists it") && said.contains("--blind"),
            "{said}"
        );
        let (exit, ..) = code(&[verb, &deleted, "data.json", "--blind"]);
        assert_eq!(exit, 0);
    }
    let (exit, _, said) = code(&["report", &deleted, "data.json", "--out", "deleted.html"]);
    assert_eq!(exit, 2, "{said}");
    // A calibration needs no truth.
    assert_eq!(
        code(&["calibrate", &deleted, "--method", "beam", "--out", "deleted.json"]).0,
        0
    );
    let unsaid = copied("unsaid", |folder| {
        std::fs::remove_dir_all(folder.join("truth")).unwrap();
        std::fs::remove_file(folder.join("manifest.json")).unwrap();
    });
    assert_eq!(code(&["score", &unsaid, "data.json"]).0, 2);
    assert_eq!(code(&["score", &unsaid, "data.json", "--blind"]).0, 0);
    // With a truth at hand, --blind leaves it aside.
    let (exit, said, _) = code(&["score", "data", "data.json", "--blind", "--json"]);
    let score: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((exit, &score["verdict"]), (0, &json!("blind")));
    assert!(score["per_axis_rms_deg"].is_null() && score["walls_normalized"].is_number());
    // A falsified one fails on blind data too.
    for (name, key, new) in [
        ("blind phi", "elevation_rad", (|x| -x) as fn(f64) -> f64),
        ("blind azimuth", "azimuth_rad", |x| x + 0.05),
        ("blind distance", "distance_m", |x| x + 0.02),
    ] {
        let mut c = LAB.calibration.clone();
        change(&mut c, key, |x, _| new(x));
        std::fs::write(at.join("falsified.json"), c.to_string()).unwrap();
        assert_eq!(
            code(&["score", "data", "falsified.json", "--blind"]).0,
            1,
            "{name}"
        );
    }
    let (exit, ..) = code(&[
        "score",
        "data",
        "data.json",
        "--blind",
        "--max",
        "per_axis_rms_deg=1",
    ]);
    assert_eq!(exit, 1, "a figure that blind data do not have cannot be judged");
}

#[test]
fn a_truth_that_is_not_the_dataset_s_is_refused() {
    let at = LAB.folder.path();
    let refused = |dataset: &str, words: &str| {
        for verb in ["score", "compare"] {
            let output = run(at, &[verb, dataset, "data.json"]);
            assert_eq!(output.status.code(), Some(2), "{dataset}: {}", stderr(&output));
            assert!(stderr(&output).contains(words), "{dataset}: {}", stderr(&output));
        }
        let output = run(at, &["report", dataset, "data.json", "--out", "refused.html"]);
        assert_eq!(output.status.code(), Some(2), "{dataset}: {}", stderr(&output));
    };
    let truth = |folder: &Path| folder.join("truth/truth.json");
    let edit = |folder: &Path, key: &str, change: &dyn Fn(&mut Value)| {
        let mut value: Value =
            serde_json::from_str(&std::fs::read_to_string(truth(folder)).unwrap()).unwrap();
        change(&mut value);
        assert!(!value[key].is_null());
        std::fs::write(truth(folder), value.to_string()).unwrap();
    };
    let edited = copied("edited", |f| edit(f, "seed", &|v| v["seed"] = json!(9)));
    refused(&edited, "changed since it was written");
    let exchanged = copied("exchanged", |f| {
        std::fs::copy(at.join("other/truth/truth.json"), truth(f)).unwrap();
    });
    refused(&exchanged, "changed since it was written");
    // Without a manifest, whatever shows that it cannot be this dataset's.
    let unlisted = |name: &str, key: &str, change: &dyn Fn(&mut Value)| {
        copied(name, |f| {
            std::fs::remove_file(f.join("manifest.json")).unwrap();
            edit(f, key, change);
        })
    };
    refused(
        &unlisted("version", "schema_version", &|v| v["schema_version"] = json!(99)),
        "`schema_version` is 99",
    );
    refused(
        &unlisted("index", "beams", &|v| v["beams"][7]["beam"] = json!(1081)),
        "beams[7].beam is 1081",
    );
    refused(
        &unlisted("twice", "beams", &|v| v["beams"][7]["beam"] = json!(8)),
        "listed more than once",
    );
    refused(
        &unlisted("named", "name", &|v| v["name"] = json!("another scene")),
        "another scene",
    );
    refused(
        &unlisted("facet", "facets", &|v| {
            v["facets"].as_array_mut().unwrap().pop();
        }),
        "no facet",
    );
    // A truth beside a dataset that was written without one.
    simulate(at, "without", &["--seed", "1", "--blind"]);
    std::fs::create_dir_all(at.join("without/truth")).unwrap();
    std::fs::copy(
        at.join("data/truth/truth.json"),
        at.join("without/truth/truth.json"),
    )
    .unwrap();
    refused("without", "was written without its truth");
    // Manifests of the future.
    let future = copied("future", |f| {
        let path = f.join("manifest.json");
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(
            path,
            text.replacen("\"schema_version\": 1", "\"schema_version\": 99", 1),
        )
        .unwrap();
    });
    refused(&future, "`schema_version` is 99");
}

#[test]
fn a_blind_dataset_states_neither_seed_nor_command() {
    let at = LAB.folder.path();
    simulate(at, "hidden", &["--seed", "1234567", "--blind"]);
    let manifest = std::fs::read_to_string(at.join("hidden/manifest.json")).unwrap();
    let value: Value = serde_json::from_str(&manifest).unwrap();
    assert_eq!(value["blind"], true);
    assert!(
        value.get("seed").is_none() && value.get("command_line").is_none(),
        "{manifest}"
    );
    for file in ["manifest.json", "session.toml", "observations.mcap"] {
        let bytes = std::fs::read(at.join("hidden").join(file)).unwrap();
        let shown = bytes.windows(7).any(|w| w == b"1234567");
        assert!(!shown, "{file}");
    }
    let output = run(at, &["score", "hidden", "data.json"]);
    // Of another dataset, which it states.
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
}

#[test]
fn nothing_read_is_invalid_and_nothing_solved_not_good_enough() {
    let at = LAB.folder.path();
    // A recording of which no topic is known.
    let empty = copied("empty", |f| {
        std::fs::remove_file(f.join("manifest.json")).unwrap();
        let mcap = std::fs::read(f.join("observations.mcap")).unwrap();
        // An MCAP file without messages: magic, header, data end, footer, magic.
        let magic = &mcap[..8];
        let mut bytes = magic.to_vec();
        let mut record = |code: u8, body: &[u8]| {
            bytes.push(code);
            bytes.extend((body.len() as u64).to_le_bytes());
            bytes.extend(body);
        };
        record(1, &[0; 8]);
        record(15, &[0; 4]);
        record(2, &[0; 20]);
        bytes.extend(magic);
        std::fs::write(f.join("observations.mcap"), bytes).unwrap();
    });
    let output = run(at, &["calibrate", &empty, "--out", "empty.json"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    // Boards that are too small to hold a spot: nothing can be solved.
    copied("unsolved", |f| {
        std::fs::remove_file(f.join("manifest.json")).unwrap();
        let session = std::fs::read_to_string(f.join("session.toml")).unwrap();
        let small = |line: &str| match line.split_once(" = ") {
            Some((key @ ("width_mm" | "height_mm"), _)) => format!("{key} = 1.0"),
            _ => line.to_owned(),
        };
        let lines: Vec<String> = session.lines().map(small).collect();
        std::fs::write(f.join("session.toml"), lines.join("\n")).unwrap();
    });
    let output = run(
        at,
        &[
            "calibrate",
            "unsolved",
            "--method",
            "beam",
            "--out",
            "unsolved.json",
        ],
    );
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("no element is solved"),
        "{}",
        stderr(&output)
    );
    assert!(at.join("unsolved.json").exists());
}

#[test]
fn a_study_whose_contestant_fails_is_not_good_enough() {
    let at = LAB.folder.path();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/reference-facet.toml");
    let study = |out: &str, more: &[&str]| {
        let mut arguments = vec!["study", scene.to_str().unwrap(), "--seeds", "2", "--out", out];
        arguments.extend(["--set", "experiment.scans_per_pose=2"]);
        arguments.extend(more);
        let output = run(at, &arguments);
        (output.status.code().unwrap(), stderr(&output))
    };
    let (code, said) = study(
        "s1",
        &[
            "--methods",
            "oracle",
            "--program",
            "mine=false",
            "--junit",
            "s1.xml",
        ],
    );
    assert_eq!(code, 1, "{said}");
    assert!(said.contains("mine failed in all 2 runs"), "{said}");
    let xml = std::fs::read_to_string(at.join("s1.xml")).unwrap();
    assert!(xml.contains("tests=\"2\" failures=\"1\""), "{xml}");
    assert_eq!(study("s2", &["--methods", "oracle"]).0, 0);
    assert_eq!(
        study("s3", &["--methods", "oracle", "--max", "per_axis_rms_deg=0.1"]).0,
        0
    );
    assert_eq!(
        study("s4", &["--methods", "beam", "--max", "per_axis_rms_deg=0.00001"]).0,
        1
    );
    assert_eq!(
        study("s5", &["--methods", "oracle", "--max", "per_axis=0.1"]).0,
        2
    );
}

#[test]
fn junit_holds_what_is_not_a_calibration() {
    let at = LAB.folder.path();
    std::fs::write(at.join("no-json.json"), "{ \"beams\": [").unwrap();
    for arguments in [
        &["validate", "no-json.json", "--junit", "no-json.xml"][..],
        &["score", "data", "no-json.json", "--junit", "no-json.xml"],
    ] {
        let _ = std::fs::remove_file(at.join("no-json.xml"));
        let output = run(at, arguments);
        assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
        let xml = std::fs::read_to_string(at.join("no-json.xml")).unwrap();
        assert!(
            xml.contains("errors=\"1\"") && xml.contains("type=\"invalid\""),
            "{xml}"
        );
    }
    let layout = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/two-mirror.toml");
    let layout = layout.to_str().unwrap();
    for (limit, code) in [("field_of_regard=0.0001", 0), ("field_of_regard=0.9", 1)] {
        let output = run(
            at,
            &[
                "layout",
                layout,
                "--coarse",
                "--min",
                limit,
                "--junit",
                "layout.xml",
            ],
        );
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        let xml = std::fs::read_to_string(at.join("layout.xml")).unwrap();
        assert!(xml.contains(&format!("failures=\"{code}\"")), "{xml}");
    }
}
