//! What a verb finds at the place of its output: results of the same kind are written over, anything else on request only,
//! and what is written is there as a whole or not at all.
//!
//! Where a disk is full is imitated by a limit on the size of files: the system refuses to write in both cases.

use crate::common::{VALID, catoptric, run, stderr, stdout};
use std::path::Path;
use std::process::Output;

/// Settings with which an experiment takes no time.
const QUICK: [&str; 4] = [
    "--set",
    "experiment.scans_per_pose=2",
    "--set",
    "scanner.sub_rays=1",
];

#[track_caller]
fn succeeds(output: &Output) {
    assert_eq!(output.status.code(), Some(0), "{}", stderr(output));
}

/// A folder with a scene, a dataset, a calibration and rays.
fn workplace() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(&run(at, &["new", "scene.toml", "--layout", "two-mirror"]));
    succeeds(&run(
        at,
        &[&["simulate", "scene.toml", "--out", "data"][..], &QUICK].concat(),
    ));
    let code = run(at, &["calibrate", "data", "--method", "beam", "--out", "c.json"])
        .status
        .code();
    assert_eq!(code, Some(0));
    std::fs::write(at.join("rays.csv"), "x_m,y_m,z_m,dx,dy,dz\n0,0,1,1,0,0\n").unwrap();
    folder
}

/// Every verb that writes a file, with its arguments but the last, the output; and the extension it must have.
const WRITERS: [(&[&str], &str); 19] = [
    (&["report", "data", "c.json", "--out"], ""),
    (&["calibrate", "data", "--method", "beam", "--out"], ""),
    (&["characterize", "data", "--out"], ".json"),
    (&["apply", "data", "c.json", "--out"], ".ply"),
    (&["apply", "data", "c.json", "--out"], ".pcd"),
    (&["plan", "scene.toml", "--poses", "1", "--out"], ""),
    (&["plan", "scene.toml", "--poses", "1", "--report"], ""),
    (&["export", "scene.toml", "--format", "stl", "--out"], ""),
    (&["export", "scene.toml", "--format", "glb", "--out"], ""),
    (&["export", "scene.toml", "--format", "csv", "--out"], ""),
    (&["export", "scene.toml", "--format", "urdf", "--out"], ""),
    (&["export", "data", "--format", "csv", "--out"], ""),
    (&["trace", "scene.toml", "--rays", "rays.csv", "--out"], ".csv"),
    (&["trace", "scene.toml", "--rays", "rays.csv", "--out"], ".npy"),
    (&["score", "data", "c.json", "--junit"], ""),
    (&["compare", "data", "c.json", "--junit"], ""),
    (&["validate", "c.json", "--junit"], ""),
    (&["layout", "scene.toml", "--coarse", "--junit"], ""),
    (&["new"], ".toml"),
];

#[test]
fn no_verb_writes_over_what_it_did_not_write() {
    let folder = workplace();
    let at = folder.path();
    let read = |name: &str| std::fs::read(at.join(name)).unwrap();
    let theirs = [
        ("scene", read("scene.toml")),
        ("session", read("data/session.toml")),
        ("recording", read("data/observations.mcap")),
        ("manifest", read("data/manifest.json")),
        ("truth", read("data/truth/truth.json")),
        ("letter", b"Dear all,\nyears of work\n".to_vec()),
        ("table", b"name,age\nme,40\n".to_vec()),
        (
            "page",
            b"<!DOCTYPE html>\n<html><body>mine</body></html>".to_vec(),
        ),
        ("other.json", b"{\"beams\": []}\n".to_vec()),
        ("binary", (0..=255).collect()),
    ];
    for (arguments, extension) in WRITERS {
        for (name, bytes) in &theirs {
            let name = format!("{name}{extension}");
            std::fs::write(at.join(&name), bytes).unwrap();
            let output = run(at, &[arguments, &[name.as_str()]].concat());
            let said = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{arguments:?} {name}: {said}");
            assert!(
                said.starts_with(&format!("error: {name} exists already and is "))
                    && said.contains("--replace replaces it"),
                "{arguments:?} {name}: {said}"
            );
            assert_eq!(&read(&name), bytes, "{arguments:?} {name}");
        }
        let name = format!("letter{extension}");
        succeeds(&run(at, &[arguments, &[name.as_str(), "--replace"]].concat()));
        assert_ne!(read(&name), theirs[5].1, "{arguments:?}");
        // Its own result may be written over, but a scene.
        let again = run(at, &[arguments, &[name.as_str()]].concat()).status.code();
        let is_scene = arguments[0] == "new" || arguments[..] == WRITERS[5].0[..];
        assert_eq!(again, Some(if is_scene { 2 } else { 0 }), "{arguments:?}");
    }
    assert_eq!(stray(at), Vec::<String>::new());
}

/// Temporary files in a folder.
fn stray(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let names = entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
    names.filter(|name| name.contains("partial")).collect()
}

#[test]
fn inputs_links_and_folders_are_not_written_over() {
    let folder = workplace();
    let at = folder.path();
    let scene = std::fs::read(at.join("scene.toml")).unwrap();
    let refused = |arguments: &[&str], why: &str| {
        let output = run(at, arguments);
        assert_eq!(
            output.status.code(),
            Some(2),
            "{arguments:?}: {}",
            stderr(&output)
        );
        assert!(
            stderr(&output).contains(why),
            "{arguments:?}: {}",
            stderr(&output)
        );
    };
    refused(&["report", "data", "c.json", "--out", "scene.toml"], "is a scene");
    let session = ["calibrate", "data", "--out", "data/session.toml"];
    refused(&session, "is the session of a dataset");
    refused(&["calibrate", "data", "--out", "data"], "is a folder");
    refused(
        &["export", "scene.toml", "--format", "stl", "--out", "data"],
        "is a folder",
    );
    for folder in ["layout", "tolerance"] {
        refused(
            &[folder, "scene.toml", "--out", "c.json"],
            "is a file, not a folder",
        );
        refused(&[folder, "scene.toml", "--out", "data", "--replace"], "holds ");
        refused(&[folder, "scene.toml", "--out", ".", "--replace"], "");
    }
    let twice = "another output of this run";
    refused(&["plan", "scene.toml", "--out", "x", "--report", "./x"], twice);
    refused(
        &["layout", "scene.toml", "--out", "l", "--junit", "l/j.xml"],
        twice,
    );
    refused(
        &["study", "scene.toml", "--out", "s", "--junit", "s/study.json"],
        twice,
    );
    // A mesh of our own is an STL like the one to be written, and an input.
    succeeds(&run(
        at,
        &["export", "scene.toml", "--format", "stl", "--out", "post.stl"],
    ));
    let with_mesh = String::from_utf8(scene.clone()).unwrap()
        + "\n[[room.surface]]\nname = \"cube\"\nposition_m = [1.0, 1.0, 1.0]\ncolor = \"white\"\n\
           shape.mesh = { file = \"post.stl\", unit = \"mm\" }\n";
    std::fs::write(at.join("mesh.toml"), with_mesh).unwrap();
    let output = run(
        at,
        &["export", "mesh.toml", "--format", "stl", "--out", "post.stl"],
    );
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("scene.toml", at.join("soft")).unwrap();
        std::fs::hard_link(at.join("scene.toml"), at.join("hard")).unwrap();
        std::os::unix::fs::symlink("nowhere", at.join("dangling")).unwrap();
        for name in ["soft", "hard"] {
            refused(&["report", "data", "c.json", "--out", name], "is a scene");
        }
        refused(&["report", "data", "c.json", "--out", "dangling"], "is a link");
    }
    assert_eq!(std::fs::read(at.join("scene.toml")).unwrap(), scene);
}

#[test]
fn a_folder_is_replaced_as_a_whole() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(&run(at, &["new", "eight.toml"]));
    succeeds(&run(at, &["new", "two.toml", "--layout", "two-mirror"]));
    let names = |folder: &str| {
        let entries = std::fs::read_dir(at.join(folder)).unwrap();
        let mut names: Vec<_> = entries.map(|e| e.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let layout = |scene: &str, out: &str, more: &[&str]| {
        run(at, &[&["layout", scene, "--coarse", "--out", out], more].concat())
    };
    succeeds(&layout("eight.toml", "used", &[]));
    succeeds(&layout("two.toml", "fresh", &[]));
    assert_ne!(names("used"), names("fresh"));
    succeeds(&layout("two.toml", "used", &[]));
    assert_eq!(names("used"), names("fresh"), "old pictures stay");
    std::fs::write(at.join("used/notes.txt"), "mine").unwrap();
    for more in [&[][..], &["--replace"]] {
        let output = layout("two.toml", "used", more);
        assert_eq!(output.status.code(), Some(2));
        assert!(stderr(&output).contains("holds notes.txt"), "{}", stderr(&output));
    }
    assert!(at.join("used/notes.txt").exists());

    let tolerance = [
        "tolerance",
        "two.toml",
        "--draws",
        "2",
        "--bounds",
        "0",
        "--out",
        "t",
    ];
    succeeds(&run(at, &tolerance));
    succeeds(&run(at, &tolerance));

    std::fs::write(at.join("open.toml"), crate::parametric::PARAMETRIC).unwrap();
    let optimize = |more: &[&str]| {
        let search = [
            "optimize",
            "open.toml",
            "--goal",
            "size",
            "--coarse",
            "--evaluations",
            "20",
        ];
        run(at, &[&search[..], &["--out", "o"], more].concat())
    };
    succeeds(&optimize(&[]));
    std::fs::write(at.join("o/front-99.toml"), VALID).unwrap();
    let output = optimize(&[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("with scenes"), "{}", stderr(&output));
    succeeds(&optimize(&["--replace"]));
    assert!(!at.join("o/front-99.toml").exists() && at.join("o/best.toml").exists());
    assert_eq!(stray(at), Vec::<String>::new());
}

#[test]
fn a_study_begins_anew_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(&run(at, &["new", "scene.toml", "--layout", "two-mirror"]));
    let study = |seeds: &str, more: &[&str]| {
        let first = [
            "study",
            "scene.toml",
            "--methods",
            "oracle",
            "--seeds",
            seeds,
            "--out",
            "s",
            "-q",
        ];
        run(at, &[&first[..], &QUICK, more].concat())
    };
    succeeds(&study("2", &["--elements"]));
    std::fs::write(at.join("s/notes.txt"), "mine").unwrap();
    let output = study("1", &[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("--replace"), "{}", stderr(&output));
    succeeds(&study("1", &["--replace"]));
    assert!(at.join("s/notes.txt").exists() && !at.join("s/elements.csv").exists());
    let runs = std::fs::read_to_string(at.join("s/runs.csv")).unwrap();
    assert_eq!(runs.lines().count(), 2);
}

#[test]
fn a_demo_replaces_only_its_own_dataset() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    succeeds(&run(at, &["new", "scene.toml", "--layout", "two-mirror"]));
    succeeds(&run(
        at,
        &[&["simulate", "scene.toml", "--out", "d/dataset"][..], &QUICK].concat(),
    ));
    let output = run(at, &["demo", "--out", "d"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(stderr(&output).contains("holds a dataset"), "{}", stderr(&output));
    std::fs::create_dir(at.join("e")).unwrap();
    std::fs::write(at.join("e/report.html"), "mine").unwrap();
    let output = run(at, &["demo", "--out", "e"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(!at.join("e/dataset").exists());
}

/// Runs the program with a limit on the size of files, in blocks of 512 bytes.
#[cfg(target_os = "linux")]
fn limited(folder: &Path, blocks: usize, arguments: &[&str]) -> Output {
    std::process::Command::new("sh")
        .args(["-c", &format!("ulimit -f {blocks}; exec \"$@\""), "sh"])
        .arg(catoptric().get_program())
        .args(arguments)
        .current_dir(folder)
        .output()
        .unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn what_cannot_be_written_as_a_whole_leaves_nothing() {
    let folder = workplace();
    let at = folder.path();
    std::fs::write(at.join("open.toml"), crate::parametric::PARAMETRIC).unwrap();
    let bare = include_str!("../../scenes/ust-20lx-cooper.toml");
    std::fs::write(at.join("bare.toml"), bare).unwrap();
    // Enough for the first files of each, but not for all.
    for (arguments, blocks) in [
        (&["layout", "scene.toml", "--coarse", "--out", "new"][..], 16),
        (
            &[
                "optimize",
                "open.toml",
                "--goal",
                "size",
                "--coarse",
                "--evaluations",
                "20",
                "--out",
                "new",
            ],
            16,
        ),
        (
            &[
                "tolerance",
                "scene.toml",
                "--draws",
                "2",
                "--bounds",
                "0",
                "--out",
                "new",
            ],
            12,
        ),
        (&["characterize", "bare.toml", "--out", "new.json"], 40),
        (
            &[
                "plan",
                "scene.toml",
                "--poses",
                "1",
                "--report",
                "new.html",
                "--out",
                "new.toml",
            ],
            8,
        ),
        (&["simulate", "scene.toml", "--out", "new"], 16),
        (&["calibrate", "data", "--method", "beam", "--out", "new.json"], 8),
        (
            &["export", "scene.toml", "--format", "glb", "--out", "new.glb"],
            4,
        ),
        (&["apply", "data", "c.json", "--out", "new.ply"], 2),
        (&["man", "--out", "new"], 4),
    ] {
        let output = limited(at, blocks, arguments);
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(3), "{arguments:?}: {said}");
        assert!(
            said.contains("larger than the system allows; nothing half-written was left behind"),
            "{arguments:?}: {said}"
        );
        assert!(
            said.contains("new") || arguments[0] == "man",
            "{arguments:?}: {said}"
        );
        let left: Vec<String> = std::fs::read_dir(at)
            .unwrap()
            .map(|e| e.unwrap().file_name().to_string_lossy().into_owned())
            .filter(|name| name.starts_with("new") || name.contains("partial"))
            .collect();
        if arguments[0] == "man" {
            assert_eq!(std::fs::read_dir(at.join("new")).unwrap().count(), 0);
            std::fs::remove_dir(at.join("new")).unwrap();
        } else {
            assert_eq!(left, Vec::<String>::new(), "{arguments:?}");
        }
    }
}

/// While a dataset is replaced again and again, it is there at every moment.
#[cfg(target_os = "linux")]
#[test]
fn a_dataset_is_replaced_without_a_gap() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().to_owned();
    succeeds(&run(&at, &["new", "scene.toml", "--layout", "two-mirror"]));
    let simulate = [
        &["simulate", "scene.toml", "--out", "data", "--replace"][..],
        &QUICK,
    ]
    .concat();
    succeeds(&run(&at, &simulate));
    let done = std::sync::atomic::AtomicBool::new(false);
    let manifest = at.join("data/manifest.json");
    std::thread::scope(|scope| {
        let watch = scope.spawn(|| {
            let (mut looks, mut gaps) = (0_usize, 0_usize);
            while !done.load(std::sync::atomic::Ordering::SeqCst) {
                looks += 1;
                gaps += usize::from(!manifest.exists());
            }
            (looks, gaps)
        });
        for _ in 0..4 {
            succeeds(&run(&at, &simulate));
        }
        done.store(true, std::sync::atomic::Ordering::SeqCst);
        let (looks, gaps) = watch.join().unwrap();
        assert!(looks > 100 && gaps == 0, "{gaps} of {looks}");
    });
    assert!(stdout(&run(&at, &["calibrate", "data", "--out", "c.json"])).contains("wrote c.json"));
}
