//! Files that claim more than they hold, many problems at once, and a machine without threads: the answer comes soon and
//! in bounded memory, and states the reason.

use crate::common::{VALID, catoptric, folder_with, stderr};
use crate::corpus::corpus;
use catoptric::files::npy;
use std::path::Path;
use std::process::Output;
use std::time::{Duration, Instant};

/// Runs the program with a gigabyte of address space; without a limit where the shell sets none.
fn run_limited(folder: &Path, arguments: &[&str]) -> Output {
    if !cfg!(target_os = "linux") {
        return catoptric().args(arguments).current_dir(folder).output().unwrap();
    }
    let mut shell = std::process::Command::new("sh");
    let script = "ulimit -v 1000000 && exec \"$0\" \"$@\"";
    shell.args(["-c", script, env!("CARGO_BIN_EXE_catoptric"), "--threads", "2"]);
    shell.args(arguments).current_dir(folder).output().unwrap()
}

fn refused(folder: &Path, arguments: &[&str], words: &str) {
    let output = run_limited(folder, arguments);
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert!(said.contains(words), "{arguments:?}: {said}");
}

#[test]
fn nothing_is_allocated_that_a_file_only_claims() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let session = std::fs::read_to_string(corpus().join("session/small.toml")).unwrap();
    let dataset = |name: &str, session: &str, recording: &str| {
        std::fs::create_dir(at.join(name)).unwrap();
        std::fs::write(at.join(name).join("session.toml"), session).unwrap();
        std::fs::copy(
            corpus().join("recording").join(recording),
            at.join(name).join("observations.mcap"),
        )
        .unwrap();
    };
    dataset("claims", &session, "claims-4-gib.mcap");
    refused(
        at,
        &["calibrate", "claims", "--out", "c.json"],
        "observations.mcap",
    );
    let many = session.replace("beams = 55", "beams = 9223372036854775807");
    dataset("many", &many, "empty.mcap");
    refused(
        at,
        &["calibrate", "many", "--out", "c.json"],
        "session.toml:6:9: `scanner.beams` is 9223372036854775807",
    );
    dataset("empty", &session, "empty.mcap");
    refused(
        at,
        &["calibrate", "empty", "--out", "c.json"],
        "observations.mcap",
    );
    std::fs::write(at.join("scene.toml"), VALID).unwrap();
    let mut rays = npy::header(usize::MAX / 64, 6);
    rays.extend([0; 48]);
    std::fs::write(at.join("rays.npy"), rays).unwrap();
    refused(
        at,
        &["trace", "scene.toml", "--rays", "rays.npy", "--out", "out.npy"],
        "rays.npy",
    );
    assert!(!at.join("out.npy").exists());
    for (name, text) in [
        ("huge.stl", [&[b' '; 80][..], &u32::MAX.to_le_bytes()].concat()),
        ("huge.ply", b"ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n".to_vec()),
    ] {
        std::fs::write(at.join(name), text).unwrap();
        let scene = format!("{VALID}\n[[room.surface]]\nname = \"m\"\nshape.mesh = {{ file = \"{name}\", units = \"m\" }}\n");
        std::fs::write(at.join("mesh.toml"), scene).unwrap();
        refused(at, &["check", "mesh.toml"], name);
    }
}

/// Ten thousand facets, each with several problems: the time is that of reading them, not of comparing each with each.
#[test]
fn many_problems_are_counted_and_the_first_are_shown() {
    let mut scene = VALID.to_owned();
    for i in 0..10_000 {
        scene.push_str(&format!(
            "[[superstructure.facet]]\nname = \"f{}\"\nnaem = 1\nshape.rectangle = {{ center_mm = [nan, 0, {i}], normal = [0, 1, 1], width_mm = -3, height_mm = 1e300 }}\n",
            i / 2
        ));
    }
    let (folder, path) = folder_with(&scene);
    let begin = Instant::now();
    let output = catoptric().arg("check").arg(&path).output().unwrap();
    let (took, said) = (begin.elapsed(), stderr(&output));
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.contains("40000 problems, of which the first 50 are shown"),
        "{}",
        &said[said.len() - 200..]
    );
    assert!(said.len() < 50_000);
    // It took fifteen; the margin is for a machine that is busy with other tests.
    assert!(took < Duration::from_secs(10), "{took:?}");
    // The same in JSON, as one line, and in a calibration.
    let beams: Vec<String> = (0..10_000)
        .map(|i| format!("{{\"beem\": {i}, \"status\": \"solvd\"}}"))
        .collect();
    let text = format!(
        "{{\"schema_version\": 1, \"method\": \"m\", \"frame\": \"sensor\", \"beams\": [{}]}}",
        beams.join(", ")
    );
    std::fs::write(folder.path().join("calibration.json"), text).unwrap();
    let begin = Instant::now();
    let output = catoptric()
        .arg("validate")
        .arg("calibration.json")
        .current_dir(folder.path())
        .output()
        .unwrap();
    let (took, said) = (begin.elapsed(), stderr(&output));
    assert_eq!(output.status.code(), Some(2));
    assert!(
        said.contains("calibration.json:1:68: unknown key `beem`"),
        "{said}"
    );
    assert!(
        said.contains("did you mean `beam`?") && said.contains("did you mean \"solved\"?"),
        "{said}"
    );
    assert!(
        said.contains("and 19950 more problems") && said.len() < 20_000,
        "{said}"
    );
    assert!(took < Duration::from_secs(10), "{took:?}");
}

/// Stacks of a petabyte cannot be had, so no thread can be started.
#[test]
fn a_machine_without_threads_is_an_error_of_the_machine() {
    let (folder, path) = folder_with(VALID);
    for threads in [&[][..], &["--threads", "2"]] {
        let run = catoptric()
            .env("RUST_MIN_STACK", "1000000000000000")
            .args(["simulate", path.to_str().unwrap(), "--out", "data"])
            .args(threads)
            .current_dir(folder.path())
            .output()
            .unwrap();
        let said = stderr(&run);
        assert_eq!(run.status.code(), Some(3), "{said}");
        assert!(said.starts_with("error: cannot start threads: "), "{said}");
        assert!(!folder.path().join("data").exists());
    }
}
