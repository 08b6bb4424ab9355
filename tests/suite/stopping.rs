//! Signals: each stops a run with its own exit code, nothing is left behind, ignored ones stay ignored; what a killed run
//! left is removed by the next one, and nothing of one that lives.
#![cfg(unix)]

use crate::common::{catoptric, heeding_signals, run, stderr};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let mut names: Vec<String> = entries
        .map(|e| e.file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn temporary(folder: &Path) -> usize {
    names(folder).iter().filter(|n| n.contains(".partial-")).count()
}

/// A folder with a scene.
fn workplace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["new", "scene.toml", "--layout", "two-mirror"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    folder
}

/// Begins a simulation and waits until it writes beside `before` other temporary folders.
fn simulate(folder: &Path, out: &str, scans: usize, before: usize) -> Child {
    let mut command = heeding_signals();
    command
        .args(["simulate", "scene.toml", "--quiet", "--out", out])
        .args(["--set", &format!("experiment.scans_per_pose={scans}")]);
    begin(command, folder, before)
}

fn begin(mut command: Command, folder: &Path, before: usize) -> Child {
    command
        .current_dir(folder)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    let begun = Instant::now();
    while temporary(folder) <= before {
        assert!(begun.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

fn send(signal: &str, child: &Child) {
    let sent = Command::new("kill")
        .args([&format!("-{signal}"), &child.id().to_string()])
        .status();
    assert!(sent.unwrap().success());
}

/// A recording that would take minutes.
const LONG: usize = 200_000;

#[test]
fn each_signal_ends_with_its_own_code_and_leaves_nothing() {
    for (signal, code, word) in [
        ("INT", 130, "interrupted"),
        ("TERM", 143, "terminated"),
        ("HUP", 129, "hung up"),
    ] {
        let folder = workplace();
        let child = simulate(folder.path(), "data", LONG, 0);
        send(signal, &child);
        let sent = Instant::now();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{signal}: {}", stderr(&output));
        assert_eq!(
            stderr(&output),
            format!("{word}; no incomplete files were left behind\n")
        );
        assert_eq!(names(folder.path()), ["scene.toml"], "{signal}");
        // The promise is 0.1 s; machines on which tests run are busy.
        assert!(
            sent.elapsed() < Duration::from_secs(5),
            "{signal}: {:?}",
            sent.elapsed()
        );
    }
}

/// As `nohup` does it; and as a shell starts a program in the background.
#[cfg(target_os = "linux")]
#[test]
fn signals_ignored_at_the_start_stay_ignored() {
    let folder = workplace();
    let mut command = Command::new("sh");
    let script = "trap '' HUP INT; exec \"$@\"";
    command.args(["-c", script, "sh"]).arg(catoptric().get_program());
    command.args(["simulate", "scene.toml", "--out", "data", "--quiet"]);
    command.args(["--set", "experiment.scans_per_pose=400"]);
    let child = begin(command, folder.path(), 0);
    send("HUP", &child);
    send("INT", &child);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert_eq!(names(folder.path()), ["data", "scene.toml"]);
}

#[test]
fn what_a_killed_run_left_is_removed_by_the_next_and_nothing_of_a_living_one() {
    let folder = workplace();
    let at = folder.path();
    let lives = simulate(at, "lives", LONG, 0);
    let mut killed = simulate(at, "killed", LONG, 1);
    killed.kill().unwrap();
    killed.wait().unwrap();
    assert_eq!(temporary(at), 2);
    // Another verb that writes to the same folder.
    let output = run(at, &["new", "other.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let left: Vec<String> = names(at)
        .into_iter()
        .filter(|n| n.contains(".partial-"))
        .collect();
    assert!(
        left.len() == 1 && left[0].starts_with(".lives.partial-"),
        "{left:?}"
    );
    send("TERM", &lives);
    assert_eq!(lives.wait_with_output().unwrap().status.code(), Some(143));
    assert_eq!(names(at), ["other.toml", "scene.toml"]);
}

/// Every process started by a study notes its number; they are gone with the study, even those that ignore SIGTERM.
#[test]
fn programs_of_a_study_end_with_it() {
    for (signal, code) in [("TERM", 143), ("HUP", 129)] {
        let folder = workplace();
        let at = folder.path();
        let noted = at.join("processes here");
        let text =
            "trap '' TERM\nsh -c \"trap '' TERM; sleep 300\" &\necho $$ $! >> \"$1\"\nwait\nsleep 300\n";
        std::fs::write(at.join("a program.sh"), text).unwrap();
        let program = format!(
            "stubborn=sh 'a program.sh' '{}' {{dataset}} {{out}}",
            noted.display()
        );
        let child = heeding_signals()
            .args([
                "study",
                "scene.toml",
                "--seeds",
                "1",
                "--methods",
                "oracle",
                "--out",
                "s",
                "-q",
            ])
            .args(["--set", "experiment.scans_per_pose=1", "--program", &program])
            .current_dir(at)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let begun = Instant::now();
        let processes = loop {
            let text = std::fs::read_to_string(&noted).unwrap_or_default();
            if text.ends_with('\n') {
                break text;
            }
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "no program was started"
            );
            std::thread::sleep(Duration::from_millis(10));
        };
        send(signal, &child);
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        let lives = |process: &str| {
            let status = Command::new("kill")
                .args(["-0", process])
                .stderr(Stdio::null())
                .status();
            let state = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
            status.unwrap().success() && !state.contains(") Z ")
        };
        std::thread::sleep(Duration::from_millis(100));
        assert!(!processes.split_whitespace().any(lives), "{processes}");
        assert_eq!(names(&at.join("s")), ["plan.json"]);
    }
}

fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Input that never comes: nobody opens the pipe, somebody opens it and writes nothing, standard input stays open.
#[test]
fn a_signal_ends_the_wait_for_input() {
    let folder = workplace();
    let at = folder.path();
    fifo(&at.join("rays.csv"));
    fifo(&at.join("pipe.toml"));
    let trace: &[&str] = &["trace", "scene.toml", "--rays", "rays.csv", "--out", "paths.csv"];
    for (arguments, opened) in [
        (trace, Some("rays.csv")),
        (trace, None),
        (&["check", "pipe.toml"], None),
        (&["check", "/dev/stdin"], None),
        (&["validate", "/dev/stdin"], None),
    ] {
        for (signal, code, word) in [("INT", 130, "interrupted"), ("TERM", 143, "terminated")] {
            let mut child = heeding_signals()
                .args(arguments)
                .current_dir(at)
                .stdin(Stdio::piped())
                .stdout(Stdio::piped())
                .stderr(Stdio::piped())
                .spawn()
                .unwrap();
            // A writer that only opens the pipe returns once the program reads it.
            let _writer = opened.map(|pipe| std::fs::OpenOptions::new().write(true).open(at.join(pipe)));
            std::thread::sleep(Duration::from_millis(300));
            assert!(
                child.try_wait().unwrap().is_none(),
                "{arguments:?} waits for input"
            );
            send(signal, &child);
            let sent = Instant::now();
            let stdin = child.stdin.take();
            let output = child.wait_with_output().unwrap();
            drop(stdin);
            assert_eq!(
                output.status.code(),
                Some(code),
                "{arguments:?}: {}",
                stderr(&output)
            );
            assert_eq!(stderr(&output), format!("{word} while waiting for input\n"));
            // The promise is 0.1 s; machines on which tests run are busy.
            assert!(sent.elapsed() < Duration::from_secs(5), "{arguments:?}");
            assert!(names(at).iter().all(|name| !name.contains(".partial-")));
        }
    }
}

/// The second signal does not wait for the run.
#[test]
fn a_second_signal_ends_at_once() {
    // More than a pipe holds, which nobody reads.
    let mut child = heeding_signals()
        .args(["schema", "scene"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(1));
    send("TERM", &child);
    std::thread::sleep(Duration::from_millis(500));
    assert!(child.try_wait().unwrap().is_none(), "it waits for its reader");
    send("TERM", &child);
    assert_eq!(child.wait().unwrap().code(), Some(143));
}
