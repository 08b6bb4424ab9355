//! Studies: the same bytes whatever the way there, and verdicts that are right about contestants known to be right or wrong.
//!
//! That the statistics' formulas are right is the business of their unit tests.

use crate::common::{run, stderr, stdout};
use std::path::{Path, PathBuf};

fn scene() -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.join("scenes/reference-facet.toml").display().to_string()
}

/// Runs a small study; extra arguments come last.
fn study(folder: &Path, out: &str, extra: &[&str]) -> std::process::Output {
    let scene = scene();
    let mut arguments = vec![
        "study",
        &scene,
        "--seeds",
        "6",
        "--methods",
        "joint,beam",
        "--axis",
        "experiment.poses_per_group=4,6",
        "--set",
        "experiment.scans_per_pose=10",
        "--out",
        out,
        "--quiet",
    ];
    arguments.extend(extra);
    run(folder, &arguments)
}

fn results(folder: &Path, out: &str) -> Vec<Vec<u8>> {
    ["study.json", "runs.csv", "report.html", "elements.csv"]
        .iter()
        .map(|f| std::fs::read(folder.join(out).join(f)).unwrap_or_default())
        .collect()
}

#[test]
fn threads_shards_and_interruptions_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(study(at, "whole", &["--elements"]).status.success());
    let whole = results(at, "whole");
    assert!(whole.iter().all(|f| !f.is_empty()));
    assert!(
        study(at, "one", &["--elements", "--threads", "1"])
            .status
            .success()
    );
    assert_eq!(results(at, "one"), whole);
    for part in ["1/3", "2/3", "3/3"] {
        let out = format!("part-{}", &part[..1]);
        assert!(study(at, &out, &["--elements", "--shard", part]).status.success());
    }
    let merged = run(
        at,
        &["study", "merge", "part-3", "part-1", "part-2", "--out", "merged"],
    );
    assert!(merged.status.success(), "{}", stderr(&merged));
    assert_eq!(results(at, "merged"), whole);
    // What an interruption leaves: the plan, and nothing of what was not finished.
    std::fs::create_dir(at.join("resumed")).unwrap();
    std::fs::copy(at.join("whole/plan.json"), at.join("resumed/plan.json")).unwrap();
    assert!(study(at, "resumed", &["--elements"]).status.success());
    assert_eq!(results(at, "resumed"), whole);
}

#[test]
fn foreign_folders_and_shards_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(study(at, "a", &["--shard", "1/2"]).status.success());
    let other = study(at, "a", &["--shard", "2/2"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(
        stderr(&other).contains("shard 1/2, 2/2 asked for"),
        "{}",
        stderr(&other)
    );
    let twice = run(at, &["study", "merge", "a", "a", "--out", "m"]);
    assert_eq!(twice.status.code(), Some(2));
    assert!(stderr(&twice).contains("given twice"), "{}", stderr(&twice));
    let alone = run(at, &["study", "merge", "a", "--out", "m"]);
    assert_eq!(alone.status.code(), Some(2));
    for (bad, word) in [
        (["--methods", "jont"], "jont"),
        (["--axis", "errors.drift_sd_mm"], "--axis"),
        (["--axis", "errors.drift_sd=1,2"], "drift_sd_mm"),
        (["--shard", "3/2"], "3/2"),
        (["--program", "mine"], "NAME=COMMAND"),
    ] {
        let scene = scene();
        let mut arguments = vec!["study", &scene, "--out", "bad"];
        arguments.extend(bad);
        let refused = run(at, &arguments);
        assert_eq!(refused.status.code(), Some(2), "{bad:?}");
        assert!(stderr(&refused).contains(word), "{bad:?}: {}", stderr(&refused));
    }
    assert!(!at.join("bad").exists());
}

#[test]
fn right_wrong_and_broken_contestants_are_called_so() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let program = env!("CARGO_BIN_EXE_catoptric");
    let scene = scene();
    let output = run(
        at,
        &[
            "study",
            &scene,
            "--seeds",
            "24",
            "--methods",
            "joint,oracle",
            "--program",
            &format!("ours={program} calibrate --quiet {{dataset}} --method beam --out {{out}}"),
            "--program",
            "silent=true",
            "--program",
            "missing=no-such-program-here",
            "--set",
            "experiment.scans_per_pose=10",
            "--out",
            "s",
            "--quiet",
            "--json",
        ],
    );
    assert!(output.status.success(), "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let of = |name: &str| {
        found["methods"]
            .as_array()
            .unwrap()
            .iter()
            .find(|m| m["method"] == name)
            .unwrap_or_else(|| panic!("{name} is in the table"))
    };
    assert_eq!(of("joint")["verdict"], "consistent");
    assert_eq!(of("oracle")["per_axis_rms_deg"], 0.0);
    assert_eq!(of("ours")["verdict"], "consistent");
    assert_eq!(of("ours")["failed"], 0);
    assert_eq!(of("silent")["failure"], "it wrote no calibration");
    assert!(
        of("missing")["failure"]
            .as_str()
            .unwrap()
            .contains("cannot be started")
    );
    assert_eq!(of("missing")["verdict"], "failed");
}
