//! Every verb: exit code, messages, files.

use crate::common::{VALID, catoptric, folder_with, run, stderr, stdout};
use std::io::Read;
use std::process::Stdio;

#[test]
fn new_writes_a_scene_that_check_accepts() {
    let folder = tempfile::tempdir().unwrap();
    for layout in ["prototype", "two-mirror", "pyramid", "altimeter", "blank"] {
        let name = format!("{layout}.toml");
        let output = run(folder.path(), &["new", &name, "--layout", layout]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(
            stdout(&output),
            format!("wrote {name}\nnext: catoptric check {name}\n")
        );
        let text = std::fs::read_to_string(folder.path().join(&name)).unwrap();
        assert!(
            text.contains(&format!("name = \"{layout}\"")) && text.contains("# "),
            "{text}"
        );
        let output = run(folder.path(), &["check", &name]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    }
}

#[test]
fn a_scene_of_mirrors_alone_can_be_looked_at() {
    let folder = tempfile::tempdir().unwrap();
    let go = |arguments: &[&str]| run(folder.path(), arguments);
    assert_eq!(
        go(&["new", "mine.toml", "--layout", "blank"]).status.code(),
        Some(0)
    );
    std::fs::write(
        folder.path().join("rays.csv"),
        "x_m,y_m,z_m,dx,dy,dz\n0,0,0,1,0,0\n",
    )
    .unwrap();
    for arguments in [
        &["check", "mine.toml"][..],
        &["layout", "mine.toml", "--out", "layout"],
        &["trace", "mine.toml", "--rays", "rays.csv", "--out", "paths.csv"],
        &["export", "mine.toml", "--format", "csv", "--out", "corners.csv"],
        &["tolerance", "mine.toml", "--draws", "3"],
    ] {
        let output = go(arguments);
        assert_eq!(
            output.status.code(),
            Some(0),
            "{arguments:?}: {}",
            stderr(&output)
        );
    }
    for verb in [
        &["simulate", "mine.toml", "--out", "data"][..],
        &["characterize", "mine.toml", "--out", "c.json"],
        &["study", "mine.toml", "--seeds", "2", "--out", "study"],
        &["plan", "mine.toml"],
    ] {
        let output = go(verb);
        assert_eq!(output.status.code(), Some(2), "{verb:?}");
        assert!(
            stderr(&output).contains("the scene has no laboratory"),
            "{verb:?}: {}",
            stderr(&output)
        );
    }
    // A mirror out of the scan is no obstacle, but a warning.
    let text = std::fs::read_to_string(folder.path().join("mine.toml")).unwrap();
    let high = text.replace("shape.plate = {", "shape.rectangle = { center_mm = [60, 0, 40], normal = [-1, 0, 1], width_mm = 20, height_mm = 20 }\n#");
    std::fs::write(folder.path().join("high.toml"), high).unwrap();
    for verb in ["check", "layout"] {
        let output = go(&[verb, "high.toml"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(
            stderr(&output).contains("warning: high.toml: `superstructure.facet[0]` is not reached"),
            "{}",
            stderr(&output)
        );
    }
}

#[test]
fn what_is_missing_is_named_with_what_was_meant() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join("dataset-1")).unwrap();
    std::fs::write(folder.path().join("dataset-1/joint.json"), "{}").unwrap();
    for (arguments, meant) in [
        (
            &["calibrate", "datset-1", "--out", "c.json"][..],
            "did you mean dataset-1?",
        ),
        (
            &["score", "datset-1", "dataset-1/joint.json"],
            "did you mean dataset-1?",
        ),
        (
            &["validate", "dataset-1/joit.json"],
            "did you mean dataset-1/joint.json?",
        ),
    ] {
        let output = run(folder.path(), arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{said}");
        assert!(said.contains(meant), "{arguments:?}: {said}");
    }
    let output = run(folder.path(), &["calibrat", "dataset-1"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("'calibrate'"), "{}", stderr(&output));
}

#[test]
fn new_does_not_change_an_existing_file() {
    let (folder, path) = folder_with("mine");
    let output = run(folder.path(), &["new", "scene.toml"]);
    assert_eq!(output.status.code(), Some(2));
    let said = stderr(&output);
    assert!(
        said.contains("scene.toml exists already") && said.contains("help: "),
        "{said}"
    );
    assert_eq!(std::fs::read_to_string(path).unwrap(), "mine");
}

#[test]
fn new_reports_where_it_cannot_write() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["new", "no/such/folder/scene.toml"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(
        stderr(&output).contains("no/such/folder/scene.toml: cannot be written"),
        "{}",
        stderr(&output)
    );
    let output = run(folder.path(), &["new", "scene.txt"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("catoptric new scene.toml"),
        "{}",
        stderr(&output)
    );
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn check_reports_the_size_of_the_experiment() {
    let (folder, _) = folder_with(VALID);
    let output = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let said = stdout(&output);
    let mut lines = said.lines();
    let first = lines.next().unwrap();
    assert!(first.starts_with("ok: small: 3 facets of "), "{first}");
    // Two poses of 10 scans, 100 scans of the room and 100 of the bare structure, with 1081 beams each.
    assert!(
        first.ends_with(", 1 board, 2 poses, 220 scans, 237 820 readings"),
        "{first}"
    );
    assert_eq!(
        lines.next(),
        Some("next: catoptric simulate scene.toml --out scene-dataset")
    );
    let output = run(
        folder.path(),
        &["check", "scene.toml", "--set", "experiment.scans_per_pose=20"],
    );
    assert!(stdout(&output).contains(" 240 scans,"), "{}", stdout(&output));
    assert!(
        stdout(&output).ends_with(" --set 'experiment.scans_per_pose=20'\n"),
        "{}",
        stdout(&output)
    );
    let output = run(folder.path(), &["-v", "check", "scene.toml"]);
    // 15° in steps of 0.25°; the beams along the two cut edges may be on either side.
    let beams: usize = stdout(&output)
        .lines()
        .find_map(|l| l.strip_prefix("  wedge: ")?.strip_suffix(" beams")?.parse().ok())
        .unwrap();
    assert!((59..=61).contains(&beams), "{beams}");
}

#[test]
fn a_wrong_command_line_exits_with_2() {
    let folder = tempfile::tempdir().unwrap();
    for arguments in [
        &["frobnicate"][..],
        &["check"],
        &["check", "--frob"],
        &["--threads", "0", "schema"],
        &["-v", "-q", "schema"],
        &["completions", "klingon"],
        &["new", "a.toml", "--layout", "hexagon"],
    ] {
        let output = run(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(
            output.stdout.is_empty() && !output.stderr.is_empty(),
            "{arguments:?}"
        );
    }
    // A typo gets the most similar verb.
    assert!(stderr(&run(folder.path(), &["chekc"])).contains("check"));
}

#[test]
fn help_and_version_go_to_standard_output() {
    let folder = tempfile::tempdir().unwrap();
    let help = run(folder.path(), &["--help"]);
    assert_eq!(help.status.code(), Some(0));
    assert!(stdout(&help).contains("Exit codes:"));
    let version = run(folder.path(), &["--version"]);
    assert_eq!(
        stdout(&version),
        concat!("catoptric ", env!("CARGO_PKG_VERSION"), "\n")
    );
}

#[test]
fn the_schema_describes_every_key_of_a_scene() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["schema"]);
    assert_eq!(output.status.code(), Some(0));
    let schema: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    let scene = catoptric::files::scene::parse(VALID, "scene.toml", &[]).unwrap();
    let keys = serde_json::to_value(&scene).unwrap();
    for key in keys.as_object().unwrap().keys() {
        assert!(schema["properties"][key]["description"].is_string(), "{key}");
    }
    assert_eq!(schema["additionalProperties"], false);
    assert_eq!(
        schema["$defs"]["Wedge"]["properties"]["azimuth_deg"]["maxItems"],
        2
    );
}

/// A number without limits would be a number that nothing checks.
#[test]
fn every_number_of_a_scene_has_limits() {
    fn without_limits(node: &serde_json::Value, path: &str, found: &mut Vec<String>) {
        let types = |name: &str| match &node["type"] {
            serde_json::Value::String(only) => only == name,
            serde_json::Value::Array(all) => all.iter().any(|t| t == name),
            _ => false,
        };
        if types("number") && !(node["minimum"].is_number() && node["maximum"].is_number()) {
            found.push(path.to_owned());
        }
        let children: Vec<(String, &serde_json::Value)> = match node {
            serde_json::Value::Object(map) => map.iter().map(|(k, v)| (k.clone(), v)).collect(),
            serde_json::Value::Array(all) => {
                all.iter().enumerate().map(|(i, v)| (i.to_string(), v)).collect()
            }
            _ => Vec::new(),
        };
        for (key, child) in children {
            without_limits(child, &format!("{path}/{key}"), found);
        }
    }
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["schema"]);
    let mut found = Vec::new();
    without_limits(&serde_json::from_str(&stdout(&output)).unwrap(), "", &mut found);
    assert_eq!(found, Vec::<String>::new());
}

#[test]
fn completions_and_manual_pages_know_the_verbs() {
    let folder = tempfile::tempdir().unwrap();
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let output = run(folder.path(), &["completions", shell]);
        assert_eq!(output.status.code(), Some(0));
        assert!(stdout(&output).contains("check"), "{shell}");
    }
    let output = run(folder.path(), &["man"]);
    assert!(stdout(&output).contains(".TH catoptric 1"));
    let output = run(folder.path(), &["man", "--out", "pages"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(folder.path().join("pages/catoptric-check.1").is_file());
}

#[test]
fn a_closed_pipe_ends_quietly() {
    for arguments in [&["schema"][..], &["completions", "bash"], &["man"], &["--help"]] {
        let child = catoptric()
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn();
        let mut child = child.unwrap();
        // Like `| head -c 1`: what does not fit into the pipe finds a closed end.
        let mut pipe = child.stdout.take().unwrap();
        pipe.read_exact(&mut [0]).unwrap();
        drop(pipe);
        let output = child.wait_with_output().unwrap();
        assert_eq!(
            output.status.code(),
            Some(0),
            "{arguments:?}: {}",
            stderr(&output)
        );
        assert_eq!(stderr(&output), "", "{arguments:?}");
    }
    // A pipe whose reader never existed: even the first byte finds a closed end.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = catoptric()
        .arg("schema")
        .stdout(writer)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(0));
    assert_eq!(stderr(&output), "");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_output_error() {
    let full = std::fs::File::create("/dev/full").unwrap();
    let output = catoptric()
        .arg("schema")
        .stdout(full)
        .stderr(Stdio::piped())
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(3));
    assert!(stderr(&output).starts_with("error: "), "{}", stderr(&output));
}
