//! Studies: the same bytes however computed, and correct verdicts about contestants known to be right or wrong.
//!
//! The formulas of the statistics are covered by their unit tests. The programs exist on any Unix.

use crate::common::{catoptric, heeding_signals, run, stderr, stdout};
use catoptric::calib::{CalibError, Calibrator, Method};
use catoptric::files::scene as scenes;
use catoptric::model::{Calibration, Dataset};
use catoptric::study::{Contestant, Study, run as run_one, summarize};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn scene() -> String {
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    root.join("scenes/reference-facet.toml").display().to_string()
}

/// Two cells of 17 seeds, so that there is more than one chunk of 32 experiments.
const SEEDS: usize = 17;

/// Contestants of the small study.
const METHODS: usize = 2;

/// Runs a small study; extra arguments come last.
fn study(folder: &Path, out: &str, extra: &[&str]) -> std::process::Output {
    let (scene, seeds) = (scene(), SEEDS.to_string());
    let mut arguments = vec![
        "study",
        &scene,
        "--seeds",
        &seeds,
        "--methods",
        "closed-form,oracle",
        "--axis",
        "experiment.poses_per_group=4,6",
        "--set",
        "experiment.scans_per_pose=2",
        "--out",
        out,
        "--quiet",
    ];
    arguments.extend(extra);
    run(folder, &arguments)
}

fn read(folder: &Path, file: &str) -> String {
    std::fs::read_to_string(folder.join(file)).unwrap_or_else(|e| panic!("{file}: {e}"))
}

fn results(folder: &Path, out: &str) -> Vec<String> {
    [
        "study.json",
        "runs.csv",
        "report.html",
        "elements.csv",
        "spread.csv",
    ]
    .iter()
    .map(|f| read(&folder.join(out), f))
    .collect()
}

#[test]
fn threads_and_shards_change_no_byte() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let done = study(at, "whole", &["--elements"]);
    assert!(done.status.success(), "{}", stderr(&done));
    let whole = results(at, "whole");
    assert!(
        study(at, "one", &["--elements", "--threads", "1"])
            .status
            .success()
    );
    assert_eq!(results(at, "one"), whole);
    for parts in 2..=3 {
        let folders: Vec<String> = (1..=parts).rev().map(|i| format!("part-{i}-{parts}")).collect();
        for (i, out) in folders.iter().rev().enumerate() {
            let part = format!("{}/{parts}", i + 1);
            assert!(study(at, out, &["--elements", "--shard", &part]).status.success());
        }
        let out = format!("merged-{parts}");
        let mut arguments = vec!["study", "merge"];
        arguments.extend(folders.iter().map(String::as_str));
        arguments.extend(["--out", &out, "--json"]);
        let merged = run(at, &arguments);
        assert!(merged.status.success(), "{}", stderr(&merged));
        assert_eq!(results(at, &out), whole);
        let printed: serde_json::Value = serde_json::from_str(&stdout(&merged)).unwrap();
        assert!(printed["methods"][0]["ms_per_calibration"].as_f64().unwrap() > 0.0);
    }
    assert!(!whole[0].contains("ms_per_calibration"));
}

#[test]
fn an_interrupted_study_resumes_and_a_finished_one_is_not_repeated() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(study(at, "whole", &["--elements"]).status.success());
    let whole = results(at, "whole");
    let first = |file: &str, rows: usize| -> String {
        let text = read(&at.join("whole"), file);
        text.split_inclusive('\n').take(1 + rows).collect()
    };
    // What remains after an interruption: the plan and the first chunk.
    let rows = 32 * METHODS;
    let runs = first("runs.csv", rows);
    let last = runs.lines().last().unwrap();
    let job = last.split(',').take(2).collect::<Vec<_>>().join(",") + ",";
    let elements = read(&at.join("whole"), "elements.csv");
    let of_last = |(_, line): &(usize, &str)| line.starts_with(&job);
    let (end, _) = elements.lines().enumerate().filter(of_last).last().unwrap();
    let resumed = at.join("resumed");
    let leave = |runs: &str| {
        let _ = std::fs::remove_dir_all(&resumed);
        std::fs::create_dir(&resumed).unwrap();
        std::fs::copy(at.join("whole/plan.json"), resumed.join("plan.json")).unwrap();
        std::fs::write(resumed.join("runs-000000.csv"), runs).unwrap();
        std::fs::write(resumed.join("elements-000000.csv"), first("elements.csv", end)).unwrap();
        let times = first("times.csv", rows).replacen("\n0,1,closed-form,", "\n0,1,closed-form,9876543", 1);
        std::fs::write(resumed.join("times-000000.csv"), times).unwrap();
    };
    leave(&runs);
    let done = study(at, "resumed", &["--elements"]);
    assert!(done.status.success(), "{}", stderr(&done));
    assert_eq!(results(at, "resumed"), whole);
    assert!(
        read(&resumed, "times.csv").contains(",9876543"),
        "the chunk was computed again"
    );
    let left: Vec<String> = std::fs::read_dir(&resumed)
        .unwrap()
        .map(|f| f.unwrap().file_name().into_string().unwrap())
        .filter(|f| f.contains("00000"))
        .collect();
    assert!(left.is_empty(), "{left:?}");

    let times = read(&resumed, "times.csv");
    assert!(study(at, "resumed", &[]).status.success());
    assert_eq!(results(at, "resumed"), whole);
    assert_eq!(read(&resumed, "times.csv"), times);

    // A chunk that lacks a run is invalid.
    leave(&first("runs.csv", rows - 1));
    let refused = study(at, "resumed", &["--elements"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(
        stderr(&refused).contains("runs-000000.csv: there is no run of oracle on seed 15 of cell 1"),
        "{}",
        stderr(&refused)
    );
}

#[test]
fn foreign_folders_and_shards_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    assert!(study(at, "a", &["--shard", "1/2"]).status.success());
    let other = study(at, "a", &["--shard", "2/2"]);
    assert_eq!(other.status.code(), Some(2));
    assert!(
        stderr(&other).contains("shard 1/2, 2/2 requested"),
        "{}",
        stderr(&other)
    );
    let twice = run(at, &["study", "merge", "a", "a", "--out", "m"]);
    assert_eq!(twice.status.code(), Some(2));
    assert!(stderr(&twice).contains("given twice"), "{}", stderr(&twice));
    let alone = run(at, &["study", "merge", "a", "--out", "m"]);
    assert_eq!(alone.status.code(), Some(2));
    let half_done = at.join("b");
    std::fs::create_dir(&half_done).unwrap();
    let other_half = read(at, "a/plan.json").replacen("1,\n    2", "2,\n    2", 1);
    std::fs::write(half_done.join("plan.json"), &other_half).unwrap();
    let unfinished = run(at, &["study", "merge", "a", "b", "--out", "m"]);
    assert_eq!(unfinished.status.code(), Some(2));
    assert!(
        stderr(&unfinished).contains("b is not finished"),
        "{}",
        stderr(&unfinished)
    );
    std::fs::write(
        half_done.join("plan.json"),
        other_half.replace("\"seeds\": 17", "\"seeds\": 18"),
    )
    .unwrap();
    let foreign = run(at, &["study", "merge", "a", "b", "--out", "m"]);
    assert_eq!(foreign.status.code(), Some(2));
    assert!(
        stderr(&foreign).contains("not parts of the same study")
            && stderr(&foreign).contains("18 seeds, 17 there"),
        "{}",
        stderr(&foreign)
    );
    assert!(!at.join("m").exists());
    for (bad, word) in [
        (["--methods", "jont"], "jont"),
        (["--axis", "errors.drift_sd_mm"], "--axis"),
        (["--axis", "errors.drift_sd=1,2"], "drift_sd_mm"),
        (["--axis", "errors.drift_sd_mm=1,2,1"], "1 is given twice"),
        (["--axis", "errors.drift_sd_mm=1:2"], "from:to:steps"),
        (
            ["--axis=errors.drift_sd_mm=1,2", "--axis=errors.drift_sd_mm=3"],
            "already has an axis",
        ),
        (
            ["--axis=errors.drift_sd_mm=1,2", "--set=errors.drift_sd_mm=3"],
            "gives it one value",
        ),
        (["--methods", "oracle,beam,oracle"], "\"oracle\" is named twice"),
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
fn programs_are_contestants_and_their_failures_are_results() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let ours = format!(
        "ours={} calibrate --quiet {{dataset}} --method closed-form --out {{out}}",
        env!("CARGO_BIN_EXE_catoptric")
    );
    let scene = scene();
    let go = |out: &str, threads: &str, command: &str| {
        let mut arguments = vec!["study", &scene, "--seeds", "4", "--methods", "closed-form"];
        for program in [
            &ours,
            "silent=true",
            "missing=no-such-program-here",
            command,
            "nonsense=cp {dataset}/session.toml {out}",
            "hanging=tail -f {dataset}/session.toml",
            "peeking=cat {dataset}/truth/truth.json",
        ] {
            arguments.extend(["--program", program]);
        }
        arguments.extend(["--program-timeout-s", "2", "--set", "experiment.scans_per_pose=2"]);
        arguments.extend(["--out", out, "--quiet", "--json", "--threads", threads]);
        run(at, &arguments)
    };
    let output = go("s", "2", "broken=cat {dataset}/no-such-file");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    assert!(stderr(&output).contains("silent failed in all 4 runs: it wrote no calibration"));
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let of = |name: &str| {
        let all = found["methods"].as_array().unwrap();
        let known = all.iter().find(|m| m["method"] == name);
        known.unwrap_or_else(|| panic!("{name} is in the table"))
    };
    // Data that went through files equal those in memory, up to the resolution of the recording.
    let rms = |name: &str| of(name)["per_axis_rms_deg"].as_f64().unwrap();
    assert_eq!(of("ours")["failed"], 0);
    assert!((rms("ours") / rms("closed-form") - 1.0).abs() < 1e-2, "{found}");
    for (name, words) in [
        ("silent", "it wrote no calibration"),
        ("missing", "cannot be started"),
        (
            "broken",
            "it ended with exit status: 1: cat: dataset/no-such-file",
        ),
        ("nonsense", "what it wrote cannot be read: calibration.json:1"),
        ("hanging", "it did not end within 2 s"),
        // A blind dataset contains no truth.
        ("peeking", "dataset/truth/truth.json"),
    ] {
        let failure = of(name)["failure"].as_str().unwrap();
        assert!(failure.contains(words), "{name}: {failure}");
        assert_eq!(
            (of(name)["failed"].as_u64(), of(name)["verdict"].as_str()),
            (Some(4), Some("failed"))
        );
        assert_eq!(of(name)["nulls"]["anees"], "nothing was solved");
    }
    let again = go("t", "1", "broken=cat {dataset}/no-such-file");
    assert_eq!(again.status.code(), Some(1));
    assert_eq!(read(at, "t/runs.csv"), read(at, "s/runs.csv"));
    let other = go("t", "1", "broken=cat {dataset}/another-file");
    assert_eq!(other.status.code(), Some(2));
    assert!(
        stderr(&other).contains("a program's command"),
        "{}",
        stderr(&other)
    );
}

/// A script in a folder, as a command.
fn script(folder: &Path, name: &str, text: &str) -> String {
    std::fs::write(folder.join(name), text).unwrap();
    format!("sh {}", folder.join(name).display())
}

/// A program that starts another, records both process IDs and waits; it fails immediately if there is a file `go`.
fn hanging(folder: &Path) -> String {
    let at = folder.display();
    let text = format!("test -e {at}/go && exit 3\nsleep 300 &\necho $$ $! >> {at}/processes\nwait\n");
    script(folder, "hang.sh", &text)
}

/// Waits until the processes recorded by a hanging program are gone.
#[cfg(unix)]
fn all_ended(folder: &Path) -> bool {
    let noted = read(folder, "processes");
    assert!(noted.split_whitespace().count() >= 2, "{noted:?}");
    let is_there = |process: &str| {
        let state = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
        // The parent of a process that has ended may not have waited for it yet.
        let lives = std::process::Command::new("kill")
            .args(["-0", process])
            .stderr(std::process::Stdio::null())
            .status()
            .unwrap();
        lives.success() && !state.contains(") Z ")
    };
    (0..100).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        !noted.split_whitespace().any(is_there)
    })
}

#[cfg(unix)]
#[test]
fn child_processes_of_a_hanging_program_end_with_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (scene, program) = (scene(), format!("hanging={}", hanging(at)));
    let done = run(
        at,
        &[
            "study",
            &scene,
            "--seeds",
            "2",
            "--methods",
            "oracle",
            "--program",
            &program,
            "--program-timeout-s",
            "1",
            "--set",
            "experiment.scans_per_pose=1",
            "--out",
            "s",
            "--quiet",
        ],
    );
    assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    assert!(
        stdout(&done).contains("it did not end within 1 s"),
        "{}",
        stdout(&done)
    );
    assert!(all_ended(at));
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_programs_and_keeps_none_of_their_failures() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let (scene, program) = (scene(), format!("hanging={}", hanging(at)));
    let arguments = |out: &str| {
        [
            "study",
            &scene,
            "--seeds",
            "3",
            "--methods",
            "oracle",
            "--program",
            &program,
            "--set",
            "experiment.scans_per_pose=1",
            "--out",
            out,
            "--quiet",
        ]
        .map(str::to_owned)
    };
    let child = heeding_signals()
        .args(arguments("s"))
        .current_dir(at)
        .stdout(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let begun = (0..600).any(|_| {
        std::thread::sleep(std::time::Duration::from_millis(50));
        std::fs::read_to_string(at.join("processes")).is_ok_and(|noted| noted.ends_with('\n'))
    });
    assert!(begun, "no program was started");
    let interrupted = std::process::Command::new("kill")
        .args(["-INT", &child.id().to_string()])
        .status()
        .unwrap();
    assert!(interrupted.success());
    let ended = child.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(130));
    assert!(all_ended(at));
    let left: Vec<_> = std::fs::read_dir(at.join("s"))
        .unwrap()
        .map(|f| f.unwrap().file_name())
        .collect();
    assert_eq!(left, ["plan.json"]);
    // Resuming gives the same result as an uninterrupted study.
    std::fs::write(at.join("go"), "").unwrap();
    for out in ["s", "t"] {
        let done = catoptric().args(arguments(out)).current_dir(at).output().unwrap();
        // One contestant fails on its own, which is its result.
        assert_eq!(done.status.code(), Some(1), "{}", stderr(&done));
    }
    let runs = read(at, "s/runs.csv");
    assert_eq!(runs, read(at, "t/runs.csv"));
    assert_eq!(runs.matches("it ended with exit status: 3").count(), 3, "{runs}");
}

#[test]
fn a_program_that_states_a_hundredth_of_its_covariance_is_over_confident() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // Both calibrate identically; the second divides every number of every covariance.
    let calibrate = format!(
        "{} calibrate --quiet \"$1\" --method beam-gls --out \"$2\" > \"$2.said\" || exit 1\n",
        env!("CARGO_BIN_EXE_catoptric")
    );
    let divide = r#"awk '/"covariance_rad2": \[/ { left = 4 }
left > 0 && /^ *-?[0-9]/ { end = /,$/ ? "," : ""; sub(/,$/, ""); printf "%.17g%s\n", $1 / 100, end; left--; next }
{ print }' "$2" > "$2.divided" && mv "$2.divided" "$2"
"#;
    let honest = format!("honest={}", script(at, "honest.sh", &calibrate));
    let bold = format!("bold={}", script(at, "bold.sh", &(calibrate + divide)));
    let scene = scene();
    let mut arguments = vec!["study", &scene, "--seeds", "12", "--methods", "oracle"];
    arguments.extend(["--program", &honest, "--program", &bold]);
    arguments.extend([
        "--set",
        "experiment.scans_per_pose=4",
        "--out",
        "s",
        "--quiet",
        "--json",
    ]);
    let output = run(at, &arguments);
    assert!(output.status.success(), "{}", stderr(&output));
    let found: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let [oracle, honest, bold] = [0, 1, 2].map(|i| &found["methods"][i]);
    let number = |m: &serde_json::Value, key: &str| m[key].as_f64().unwrap_or(f64::NAN);
    assert_eq!(oracle["verdict"], "exact");
    assert_eq!(honest["verdict"], "consistent");
    assert!(
        bold["verdict"].as_str().unwrap().starts_with("over-confident: "),
        "{bold}"
    );
    let times = number(bold, "anees") / number(honest, "anees");
    assert!((times - 100.0).abs() < 1e-6, "{times}");
    assert_eq!(
        number(bold, "per_axis_rms_deg"),
        number(honest, "per_axis_rms_deg")
    );
    assert!(bold["coverage_95_interval"][1].as_f64().unwrap() < 0.95);
}

/// One of our methods with its stated standard deviations multiplied by a factor.
struct Stating {
    name: &'static str,
    times: f64,
}

impl Calibrator for Stating {
    fn name(&self) -> &str {
        self.name
    }

    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError> {
        let mut calibration = Method::BeamGls.calibrate(dataset)?;
        for beam in &mut calibration.beams {
            let scaled = |row: [f64; 2]| row.map(|c| c * self.times * self.times);
            beam.covariance_rad2 = beam.covariance_rad2.map(|rows| rows.map(scaled));
        }
        Ok(calibration)
    }
}

#[test]
fn unjustified_confidence_is_reported() {
    let sets = ["experiment.scans_per_pose=10".to_owned()];
    let reference = scenes::load(scene().as_ref(), &sets).unwrap();
    let stating = |name, times| Contestant::Own(Arc::new(Stating { name, times }));
    let contestants = vec![
        stating("honest", 1.0),
        stating("bold", 1.0 / 3.0),
        stating("timid", 3.0),
        Contestant::Oracle,
    ];
    let study = Study::of_scene(reference, 40, contestants);
    let jobs: Vec<_> = study.jobs().collect();
    let runs: Vec<_> = jobs
        .par_iter()
        .map(|job| run_one(&study, *job).unwrap())
        .collect();
    let summary = summarize(&study, &runs.concat());
    let [honest, bold, timid, oracle] = &summary.methods[..] else {
        panic!("four contestants");
    };
    assert_eq!(honest.verdict, "consistent");
    assert!(
        bold.verdict.starts_with("over-confident: errors are "),
        "{}",
        bold.verdict
    );
    assert!(
        timid.verdict.starts_with("under-confident: errors are "),
        "{}",
        timid.verdict
    );
    assert!(
        (bold.anees / honest.anees - 9.0).abs() < 1e-9
            && (9.0 * timid.anees / honest.anees - 1.0).abs() < 1e-9
    );
    // 95 % is outside the coverage interval of the over-confident one, and inside that of the honest one.
    let [low, high] = honest.coverage_95_interval;
    assert!((low..high).contains(&0.95), "{low} to {high}");
    assert!(
        bold.coverage_95_interval[1] < 0.95,
        "{:?}",
        bold.coverage_95_interval
    );
    assert_eq!((oracle.verdict.as_str(), oracle.per_axis_rms_deg), ("exact", 0.0));
    // The angles in the room are computed via poses, and back.
    assert!(
        oracle.per_axis_rms_room_deg < 1e-9,
        "{}",
        oracle.per_axis_rms_room_deg
    );
    assert_eq!(
        (oracle.missed, oracle.wrong, oracle.solved),
        (0.0, 0.0, honest.solved)
    );
    assert_eq!(oracle.nulls["efficiency"], "infinite: the error is exactly zero");
}
