//! From scene to report through the program, on an experiment small enough to run in a second.

use crate::common::{heeding_signals, run, stderr, stdout};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// The default scene with few scans and pencil beams.
const SMALL: [&str; 8] = [
    "--set",
    "experiment.scans_per_pose=5",
    "--set",
    "experiment.room_scans=5",
    "--set",
    "experiment.bare_scans=5",
    "--set",
    "scanner.sub_rays=1",
];

fn simulate(folder: &Path, out: &str, more: &[&str]) -> Output {
    if !folder.join("scene.toml").exists() {
        let output = run(folder, &["new", "scene.toml"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
    let arguments = [&["simulate", "scene.toml", "--out", out][..], &SMALL, more].concat();
    run(folder, &arguments)
}

#[track_caller]
fn succeeds(output: &Output) -> String {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
    stdout(output)
}

#[test]
fn from_scene_to_report() {
    let folder = tempfile::tempdir().unwrap();
    let at = |arguments: &[&str]| run(folder.path(), arguments);
    let said = succeeds(&simulate(folder.path(), "data", &[]));
    assert!(
        said.contains("next: catoptric calibrate data --out calibration.json"),
        "{said}"
    );
    let read = |name: &str| std::fs::read(folder.path().join(name)).unwrap();

    succeeds(&at(&["calibrate", "data", "--out", "beam.json"]));
    succeeds(&at(&[
        "calibrate",
        "data",
        "--method",
        "recursive",
        "--jacobian",
        "central",
        "--out",
        "r.json",
    ]));
    assert!(succeeds(&at(&["validate", "beam.json"])).starts_with("ok: beam.json: "));

    let score = succeeds(&at(&["score", "data", "beam.json", "--json"]));
    let score: serde_json::Value = serde_json::from_str(&score).unwrap();
    assert_eq!(score["verdict"], "pass");
    assert_eq!(score["beams"]["missed"], 0);
    // No calibration from noisy data is that accurate.
    let output = at(&["score", "data", "beam.json", "--max-rms-deg", "1e-9"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(stdout(&output).starts_with("fail") && stderr(&output).starts_with("not good enough"));

    succeeds(&at(&["apply", "data", "beam.json", "--out", "cloud.ply"]));
    succeeds(&at(&[
        "apply",
        "data",
        "beam.json",
        "--out",
        "cloud.pcd",
        "--frame",
        "rig",
        "--pose",
        "3",
    ]));
    assert!(read("cloud.ply").starts_with(b"ply\n"));
    let output = at(&["apply", "data", "beam.json", "--out", "cloud.las"]);
    assert_eq!(output.status.code(), Some(2));
    let output = at(&["apply", "data", "beam.json", "--out", "x.ply", "--pose", "999"]);
    assert_eq!(output.status.code(), Some(2));
    succeeds(&at(&[
        "report",
        "data",
        "beam.json",
        "r.json",
        "--out",
        "report.html",
    ]));
    assert!(
        String::from_utf8(read("report.html"))
            .unwrap()
            .contains("</html>")
    );

    // Without the truth, the calibration is the same, byte for byte, and the score is blind.
    std::fs::remove_dir_all(folder.path().join("data/truth")).unwrap();
    succeeds(&at(&["calibrate", "data", "--out", "blind.json"]));
    assert_eq!(read("blind.json"), read("beam.json"));
    assert!(succeeds(&at(&["score", "data", "blind.json", "--blind"])).starts_with("blind"));
}

#[test]
fn threads_and_a_second_run_change_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let hashes = |out: &str| {
        let manifest = std::fs::read(folder.path().join(out).join("manifest.json")).unwrap();
        String::from_utf8(manifest).unwrap()
    };
    succeeds(&simulate(folder.path(), "a", &["--threads", "1", "--returns"]));
    for (out, threads) in [("b", "2"), ("c", "7"), ("d", "1")] {
        succeeds(&simulate(
            folder.path(),
            out,
            &["--threads", threads, "--returns"],
        ));
        assert_eq!(hashes(out), hashes("a"), "{threads} threads");
    }
    succeeds(&simulate(folder.path(), "e", &["--seed", "2", "--returns"]));
    assert_ne!(hashes("e"), hashes("a"));
}

#[test]
fn simulate_keeps_existing_files_and_prints_figures() {
    let folder = tempfile::tempdir().unwrap();
    let figures = succeeds(&simulate(folder.path(), "data", &["--json"]));
    let figures: serde_json::Value = serde_json::from_str(&figures).unwrap();
    for key in "scans beams sub_rays segments build_s trace_s sample_s write_s bytes threads".split(' ') {
        assert!(figures[key].is_number(), "{key}: {figures}");
    }
    let output = simulate(folder.path(), "data", &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--replace"), "{}", stderr(&output));
    succeeds(&simulate(folder.path(), "data", &["--replace"]));
    // Anything that is not a dataset is never replaced.
    let mine = folder.path().join("mine");
    std::fs::create_dir(&mine).unwrap();
    std::fs::write(mine.join("thesis.tex"), "years of work").unwrap();
    let output = simulate(folder.path(), "mine", &["--replace"]);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(std::fs::read_dir(mine).unwrap().count(), 1);
}

#[test]
fn missing_and_broken_files() {
    let folder = tempfile::tempdir().unwrap();
    let code = |arguments: &[&str]| {
        let output = run(folder.path(), arguments);
        assert!(
            stderr(&output).starts_with("error: ") && output.stdout.is_empty(),
            "{arguments:?}"
        );
        output.status.code()
    };
    assert_eq!(code(&["calibrate", "nowhere", "--out", "c.json"]), Some(3));
    assert_eq!(code(&["validate", "nowhere.json"]), Some(3));
    std::fs::write(folder.path().join("broken.json"), "{\n  \"beams\": [,]\n}").unwrap();
    assert_eq!(code(&["validate", "broken.json"]), Some(2));
    let output = run(folder.path(), &["validate", "broken.json"]);
    assert!(
        stderr(&output).contains("broken.json:2:13"),
        "{}",
        stderr(&output)
    );
    assert!(!folder.path().join("c.json").exists());
}

#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_behind() {
    let folder = tempfile::tempdir().unwrap();
    succeeds(&run(folder.path(), &["new", "scene.toml"]));
    let child = heeding_signals()
        .args([
            "simulate",
            "scene.toml",
            "--out",
            "data",
            "--set",
            "experiment.scans_per_pose=2000",
        ])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn();
    let mut child = child.unwrap();
    // The staging folder next to the scene shows that writing has begun.
    let begin = Instant::now();
    while std::fs::read_dir(folder.path()).unwrap().count() < 2 {
        assert!(begin.elapsed() < Duration::from_secs(60) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    assert!(
        Command::new("kill")
            .args(["-INT", &pid])
            .status()
            .unwrap()
            .success()
    );
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(
        stderr(&output),
        "interrupted; no incomplete files were left behind\n"
    );
    let left: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|e| e.unwrap().file_name())
        .collect();
    assert_eq!(left, ["scene.toml"]);
}

#[test]
fn demo_runs_all_steps_twice() {
    let folder = tempfile::tempdir().unwrap();
    for _ in 0..2 {
        let output = run(folder.path(), &["demo", "--out", "d", "-q"]);
        let said = succeeds(&output);
        assert!(
            said.contains("verdict     pass") && said.contains("0 missed, 0 false"),
            "{said}"
        );
        assert!(
            said.lines().last().unwrap().starts_with("next: catoptric new "),
            "{said}"
        );
        assert_eq!(stderr(&output), "");
    }
    for file in [
        "dataset/manifest.json",
        "calibration-beam.json",
        "calibration-joint.json",
        "calibration-beam-gls.json",
    ] {
        assert!(folder.path().join("d").join(file).is_file(), "{file}");
    }
    for file in [
        "score-beam.json",
        "score-joint.json",
        "score-beam-gls.json",
        "report.html",
        "cloud.ply",
    ] {
        assert!(folder.path().join("d").join(file).is_file(), "{file}");
    }
}
