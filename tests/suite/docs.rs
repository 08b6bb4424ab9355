//! The documents are correct: crates, files, commands, keys and printed figures are compared with the real ones.
//!
//! These prove that everything the documents name exists, and that everything they must name is there. They do not prove
//! that the sentences are true; the examples of the guide are run as doctests.

use crate::common::{run, stdout};
use catoptric::files::scene::{self, Template};
use catoptric::model::Curve;
use catoptric::model::assessment::{
    Assessment, Cause, ComponentTest, Doubt, HeldOut, SharedParameter, VarianceComponent,
};
use catoptric::model::calibration::{FacetEstimate, MountEstimate};
use catoptric::model::curve::RoundCurve;
use catoptric::model::glass::GlassSheet;
use catoptric::model::{AngleTable, BeamEstimate, Calibration, RangeBias, ScanGeometry, Status};
use catoptric::{calib, score, sim};
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(path: &str) -> String {
    fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// All files below a folder, with their paths relative to the root of the repository.
fn files_below(folder: &str) -> Vec<String> {
    let mut found = Vec::new();
    for entry in fs::read_dir(root().join(folder)).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let path = format!("{folder}/{name}");
        if root().join(&path).is_dir() {
            found.extend(files_below(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The documents, as (path, text).
fn documents() -> Vec<(String, String)> {
    let mut paths = ["README.md", "ARCHITECTURE.md", "CHANGELOG.md"]
        .map(str::to_owned)
        .to_vec();
    paths.extend(files_below("docs").into_iter().filter(|p| p.ends_with(".md")));
    paths.into_iter().map(|p| (p.clone(), read(&p))).collect()
}

/// The text between single backquotes, outside code blocks.
fn code_words(text: &str) -> Vec<String> {
    let prose: Vec<&str> = text.split("```").step_by(2).collect();
    let prose = prose.concat();
    prose.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The code blocks of one language.
fn code_blocks(text: &str, language: &str) -> Vec<String> {
    text.split("```")
        .skip(1)
        .step_by(2)
        .filter_map(|block| {
            block
                .strip_prefix(language)?
                .strip_prefix('\n')
                .map(str::to_owned)
        })
        .collect()
}

/// The words of the first column of the table below a heading.
fn first_column(text: &str, heading: &str) -> BTreeSet<String> {
    let mut lines = text.lines().skip_while(|line| !line.starts_with(heading)).skip(1);
    let section: Vec<&str> = lines.by_ref().take_while(|line| !line.starts_with('#')).collect();
    let rows = section
        .iter()
        .filter_map(|line| line.strip_prefix('|')?.split('|').next());
    let words: BTreeSet<String> = rows.flat_map(code_words).collect();
    assert!(!words.is_empty(), "no table below {heading:?}");
    words
}

/// Packages that a package is built from, tests included.
fn dependencies(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--locked",
            "--offline",
            "--prefix",
            "none",
            "--format",
            "{p}",
        ])
        .args(["-e", "normal,build,dev", "-p", package])
        .current_dir(root())
        .output()
        .unwrap();
    let text = stdout(&output);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let names: BTreeSet<String> = text
        .lines()
        .filter_map(|line| line.split(' ').next())
        .map(str::to_owned)
        .collect();
    assert!(
        names.contains(package),
        "cargo tree does not list {package}:\n{text}"
    );
    names
}

#[test]
fn the_estimator_cannot_see_the_truth() {
    let has = |names: &BTreeSet<String>, word: &str| {
        names
            .iter()
            .any(|n| n == word || n.starts_with(&format!("{word}_")) || n.starts_with(&format!("{word}3d")))
    };
    let calib = dependencies("catoptric-calib");
    for foreign in ["catoptric-sim", "parry", "rand", "catoptric"] {
        assert!(
            !has(&calib, foreign),
            "catoptric-calib depends on {foreign}: {calib:?}"
        );
    }
    let model = dependencies("catoptric-model");
    for foreign in ["catoptric-sim", "catoptric-calib", "parry", "rand", "catoptric"] {
        assert!(
            !has(&model, foreign),
            "catoptric-model depends on {foreign}: {model:?}"
        );
    }
    let sim = dependencies("catoptric-sim");
    assert!(
        !sim.contains("catoptric-calib") && !sim.contains("catoptric"),
        "{sim:?}"
    );
    // Names as printed by cargo.
    assert!(
        has(&sim, "parry") && has(&sim, "rand") && sim.contains("catoptric-model"),
        "{sim:?}"
    );
}

#[test]
fn every_scene_is_valid() {
    let mut scenes = files_below("scenes");
    // Meshes are stored next to the scenes that refer to them.
    scenes.retain(|p| p.ends_with(".toml"));
    assert!(scenes.len() >= 2, "{scenes:?}");
    for path in scenes {
        if let Err(problems) = scene::load(&root().join(&path), &[]) {
            panic!("{path}:\n{problems}");
        }
    }
}

#[test]
fn links_have_targets() {
    let mut links = 0;
    for (path, text) in documents() {
        let folder = root().join(&path).parent().unwrap().to_owned();
        for target in text
            .split("](")
            .skip(1)
            .map(|rest| rest.split(')').next().unwrap())
        {
            links += 1;
            if let Some(anchor) = target.strip_prefix('#') {
                let mut headings = text.lines().filter_map(|l| l.strip_prefix("## "));
                assert!(
                    headings.any(|h| h.to_lowercase().replace(' ', "-") == anchor),
                    "{path} has no heading {anchor}"
                );
            } else if !target.starts_with("https://") {
                assert!(
                    folder.join(target).exists(),
                    "{path} links to {target}, which does not exist"
                );
            }
        }
    }
    assert!(links > 5, "only {links} links found");
}

#[test]
fn files_named_in_documents_exist() {
    let folders = [
        "crates/",
        "src/",
        "tests/",
        "examples/",
        "benches/",
        "scenes/",
        "docs/",
        ".ci/",
    ];
    let mut named = 0;
    for (path, text) in documents() {
        for word in code_words(&text) {
            let is_path = folders.iter().any(|f| word.starts_with(f)) && !word.contains([' ', '*', '…']);
            if is_path && !word.contains("NNNN") {
                named += 1;
                assert!(
                    root().join(&word).exists(),
                    "{path} names {word}, which does not exist"
                );
            }
        }
    }
    assert!(named > 20, "only {named} files found");
}

#[test]
fn the_architecture_names_every_crate() {
    let text = read("ARCHITECTURE.md");
    let named = first_column(&text, "## The crates");
    let mut there: BTreeSet<String> = files_below("crates")
        .into_iter()
        .filter(|path| path.ends_with("/Cargo.toml"))
        .chain(["Cargo.toml".to_owned()])
        .map(|path| package_name(&read(&path)))
        .collect();
    there.remove("");
    assert_eq!(named, there, "ARCHITECTURE.md (left) and the workspace (right)");
}

/// The name that a Cargo.toml gives its package.
fn package_name(manifest: &str) -> String {
    let mut lines = manifest
        .lines()
        .skip_while(|line| *line != "[package]")
        .filter_map(|line| line.strip_prefix("name = "));
    lines.next().unwrap_or_default().trim_matches('"').to_owned()
}

#[test]
fn every_source_file_says_first_what_it_is() {
    for folder in ["src", "crates", "tests", "benches", "examples"] {
        for path in files_below(folder).into_iter().filter(|p| p.ends_with(".rs")) {
            let text = read(&path);
            let first = text.lines().next().unwrap_or_default();
            assert!(
                first.starts_with("//!") || path.ends_with("/build.rs"),
                "{path} begins with {first:?}"
            );
        }
    }
}

/// Packages that a user compiles beside our own crates' dependencies, ours counted.
fn packages(arguments: &[&str]) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args([
            "tree",
            "--locked",
            "--offline",
            "--prefix",
            "none",
            "--format",
            "{p}",
        ])
        .args(["-e", "normal"])
        .args(arguments)
        .current_dir(root())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let words = |line: &str| line.split(' ').take(2).collect::<Vec<_>>().join(" ");
    stdout(&output).lines().map(words).collect()
}

#[test]
fn who_only_tests_a_calibration_compiles_little() {
    let with = packages(&["-p", "catoptric", "--features", "testing"]);
    let without = packages(&[
        "-p",
        "catoptric",
        "--no-default-features",
        "--features",
        "testing",
    ]);
    assert!(with.len() <= 125, "{}: {with:?}", with.len());
    assert!(without.len() <= 95, "{}: {without:?}", without.len());
    for foreign in ["clap", "indicatif", "plotters", "image", "argmin"] {
        let has = |names: &BTreeSet<String>| names.iter().any(|n| n.split(' ').next() == Some(foreign));
        assert!(!has(&with) && !has(&without), "{foreign}");
    }
}

/// The verbs of the program, from its help.
fn verbs() -> BTreeSet<String> {
    let help = stdout(&run(root(), &["--help"]));
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let verbs: BTreeSet<String> = commands
        .take_while(|line| !line.is_empty())
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .filter_map(|line| line.split_whitespace().next())
        .filter(|verb| *verb != "help")
        .map(str::to_owned)
        .collect();
    assert!(verbs.contains("demo") && verbs.len() > 5, "{verbs:?} in\n{help}");
    verbs
}

/// Every `catoptric …` command shown in a document, as words.
fn commands_of_the_program() -> Vec<(String, Vec<String>)> {
    let mut commands = Vec::new();
    for (path, text) in documents() {
        let shown = code_blocks(&text, "sh").concat();
        let lines = shown.lines().map(str::to_owned).chain(code_words(&text));
        for line in lines.flat_map(|l| l.split("&&").map(|c| c.trim().to_owned()).collect::<Vec<_>>()) {
            if let Some(rest) = line.strip_prefix("catoptric ") {
                // What follows a pipe is somebody else's program.
                let words = rest.split_whitespace().take_while(|word| *word != "|");
                commands.push((path.clone(), words.map(str::to_owned).collect()));
            }
        }
    }
    commands
}

#[test]
fn every_verb_is_documented_and_every_documented_verb_and_option_exists() {
    let verbs = verbs();
    let commands = commands_of_the_program();
    let shown: BTreeSet<String> = commands
        .iter()
        .filter(|(path, _)| path == "README.md" || path.starts_with("docs/guide/"))
        .map(|(_, words)| words[0].clone())
        .filter(|word| !word.starts_with('-'))
        .collect();
    assert_eq!(shown, verbs, "documented (left) and in the help (right)");
    for (path, words) in commands {
        let of_verb = if words[0].starts_with('-') {
            vec!["--help"]
        } else {
            vec![words[0].as_str(), "--help"]
        };
        let help = stdout(&run(root(), &of_verb));
        for option in words.iter().filter(|w| w.starts_with('-')) {
            assert!(
                help.contains(option.as_str()),
                "{path}: {words:?} has no {option}:\n{help}"
            );
        }
    }
}

#[test]
fn the_readme_s_commands_are_run_by_ci() {
    let ci = read(".ci/run").replace(" --locked", "");
    let blocks = code_blocks(&read("README.md"), "sh");
    let commands: Vec<&str> = blocks.iter().flat_map(|b| b.lines()).collect();
    assert_eq!(
        commands,
        ["cargo run --release -- demo", "cargo test --workspace"]
    );
    for command in commands {
        let is_run = ci
            .lines()
            .any(|line| line == command || line.starts_with(&format!("{command} ")));
        assert!(is_run, ".ci/run does not run {command:?}");
    }
}

#[test]
fn the_demo_prints_what_the_readme_says() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(folder.path(), &["demo"]);
    assert!(output.status.success());
    let without_time = |text: &str| -> Vec<String> {
        text.lines()
            .filter(|l| !l.starts_with("took "))
            .map(str::to_owned)
            .collect()
    };
    let printed = stdout(&output);
    for path in ["README.md", "docs/guide/1-getting-started.md"] {
        let shown = &code_blocks(&read(path), "text")[0];
        assert_eq!(
            without_time(shown),
            without_time(&printed),
            "{path} is out of date; demo prints:\n{printed}"
        );
    }
}

/// Paths of all keys of a value; lists are written `name[]`, and maps with free keys are not descended into.
fn keys(value: &Value, free: &[&str]) -> BTreeSet<String> {
    fn walk(value: &Value, path: &str, free: &[&str], found: &mut BTreeSet<String>) {
        match value {
            Value::Object(map) if !free.contains(&path) => {
                for (key, value) in map {
                    let path = if path.is_empty() {
                        key.clone()
                    } else {
                        format!("{path}.{key}")
                    };
                    walk(value, &path, free, found);
                }
            }
            Value::Array(items) if items.iter().any(Value::is_object) => {
                for item in items {
                    walk(item, &format!("{path}[]"), free, found);
                }
            }
            _ => {
                found.insert(path.to_owned());
            }
        }
    }
    let mut found = BTreeSet::new();
    walk(value, "", free, &mut found);
    found
}

/// A calibration in which every key has a value.
fn every_key() -> Calibration {
    let estimate = BeamEstimate {
        facet: Some("left".to_owned()),
        azimuth_rad: Some(0.1),
        elevation_rad: Some(0.7),
        distance_m: Some(0.07),
        covariance_rad2: Some([[1e-6, 0.0], [0.0, 1e-6]]),
        distance_sd_m: Some(0.002),
        noise_covariance_rad2: Some([[1e-8, 0.0], [0.0, 1e-8]]),
        null_direction: Some([0.0, 1.0]),
        poses: Some(6),
        readings: Some(600),
        iterations: Some(4),
        rms_residual_m: Some(1e-3),
        ..BeamEstimate::without_angles(700, Status::Solved, Some("for the sake of its key".to_owned()))
    };
    let facet = FacetEstimate {
        facet: "left".to_owned(),
        normal: [0.0, -1.0, 0.0],
        offset_m: 0.05,
        covariance: [[0.0; 3]; 3],
    };
    let mount = MountEstimate {
        translation_m: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        covariance: Some([[0.0; 6]; 6]),
    };
    Calibration {
        schema_version: 2,
        method: "mine".to_owned(),
        frame: "sensor".to_owned(),
        scanner: Some(*ScanGeometry::default().angles()),
        dataset: Some("0".repeat(64)),
        beams: vec![estimate],
        facets: vec![facet],
        rig_from_sensor: Some(mount),
        bias: Some(RangeBias::default()),
        warnings: vec!["the board moved".to_owned()],
        assessment: Some(assessment()),
    }
}

fn assessment() -> Assessment {
    Assessment {
        variance_components: vec![VarianceComponent {
            name: "drift of a pose".to_owned(),
            believed_mm: 0.9,
            found_mm: Some(1.0),
            found_sd_mm: Some(0.1),
        }],
        parameters: vec![SharedParameter {
            name: "A_a (mm)".to_owned(),
            change: 1.0,
            believed_sd: 3.0,
            sd: 1.0,
        }],
        correlations: vec![vec![1.0]],
        tests: vec![ComponentTest {
            cause: Cause::Drift,
            statistic: 9.0,
            degrees_of_freedom: 8.5,
            p_value: 0.3,
        }],
        doubts: vec![Doubt {
            causes: vec![Cause::Board],
            poses: vec![3],
            statistic: 90.0,
            degrees_of_freedom: 4.0,
            message: "the board was moved".to_owned(),
        }],
        open: vec!["port".to_owned()],
        held_out: Some(HeldOut {
            boards: 1,
            means: 1,
            rms_mm: 1.0,
            expected_mm: 1.0,
            mean_mm: 0.0,
        }),
        ..Assessment::default()
    }
}

#[test]
fn documented_keys_are_the_keys_of_the_files() {
    let text = read("docs/guide/5-files.md");
    let same = |heading: &str, value: &Value, free: &[&str]| {
        let documented = first_column(&text, &format!("## {heading}"));
        assert_eq!(
            documented,
            keys(value, free),
            "{heading}: documented (left) and written (right)"
        );
    };
    let json = |value: Result<Value, serde_json::Error>| value.unwrap();

    same(
        "calibration.json",
        &json(serde_json::to_value(every_key())),
        &["bias.color"],
    );

    let quick = ["experiment.scans_per_pose=2", "scanner.sub_rays=1"].map(str::to_owned);
    let flight = r#"
[[flight]]
name = "hover"
waypoint = [{ time_s = 0, position_m = [0, 0, 1.8] }, { time_s = 0.025, position_m = [0, 0, 1.8] }]
[[experiment.mishap]]
pose = 3
moved_mm = [0, 0, 4]
"#;
    let small = Template::TwoMirror.text().to_owned() + flight;
    let small = scene::parse(&small, "two-mirror.toml", &quick).unwrap();
    let laboratory = sim::Laboratory::new(&small, small.seed).unwrap();
    let (dataset, mut truth) = (laboratory.dataset().unwrap(), laboratory.truth().unwrap());
    let mut session = dataset.session.clone();
    session.believed.element_sd_mm = 0.5;
    session.bare_structure.noise_sd_mm = 0.5;
    session.boards[0].thickness_mm = 2.0;
    session.glass = Some(GlassSheet {
        thickness_mm: 2.0,
        thickness_sd_mm: 0.1,
        ..GlassSheet::default()
    });
    let curve = Curve::Sphere(RoundCurve {
        radius_mm: 400.0,
        touches_mm: [0.0; 2],
    });
    session.facets[0].curve = Some(curve);
    truth.facets[0].curve = Some(curve);
    let noise = session.believed.noise.clone().unwrap();
    session.believed.noise_of.insert("grey".to_owned(), noise);
    same(
        "session.toml",
        &json(serde_json::to_value(&session)),
        &["believed.bias.color", "believed.noise_of", "facets[].curve"],
    );
    same(
        "truth.json",
        &json(serde_json::to_value(&sim::Truth {
            detector_errors: true,
            ..truth.clone()
        })),
        &["bias.color", "poses[].mishap", "facets[].curve"],
    );

    let calibration = calib::calibrate(&dataset, calib::Method::Beam, &calib::Options::default()).unwrap();
    let mut score = score(&dataset, &calibration, Some(&truth)).expect("in memory");
    score.mistakes.push(score::Mistake {
        correction: "φ negated".to_owned(),
        figure: "per_axis_rms_deg",
        found: 90.0,
        would_be: 0.1,
    });
    same(
        "score.json",
        &json(serde_json::to_value(&score)),
        &["statuses", "nulls"],
    );

    let sets = ["experiment.scans_per_pose=2", "scanner.sub_rays=1"].map(str::to_owned);
    let mut bare = scene::load(&root().join("scenes/ust-20lx-cooper.toml"), &sets).unwrap();
    bare.experiment.test[5].range_m.truncate(1);
    let laboratory = sim::Laboratory::new(&bare, bare.seed).unwrap();
    let tested = laboratory.dataset().unwrap();
    let mut found = calib::characterize(&tested).unwrap();
    found.bias.angle.table = Some(AngleTable::default());
    same(
        "characterization.json",
        &json(serde_json::to_value(&found)),
        &["bias.color"],
    );

    let labels: BTreeSet<String> = dataset
        .poses
        .iter()
        .chain(&tested.poses)
        .flat_map(|p| keys(&json(serde_json::to_value(&p.label)), &[]))
        .collect();
    let topics_and_labels = first_column(&text, "## observations.mcap");
    let documented: BTreeSet<String> = topics_and_labels
        .into_iter()
        .filter(|w| !w.starts_with('/'))
        .collect();
    assert_eq!(
        documented, labels,
        "/session/pose: documented (left) and written (right)"
    );

    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("scenes/two-mirror.toml");
    let arguments = [
        "simulate",
        scene.to_str().unwrap(),
        "--out",
        "dataset",
        "--json",
        "--returns",
        "--readings",
        "--sub-rays",
    ];
    let output = run(
        folder.path(),
        &[&arguments[..], &["--set", &quick[0], "--set", &quick[1]]].concat(),
    );
    assert!(output.status.success());
    let manifest = fs::read_to_string(folder.path().join("dataset/manifest.json")).unwrap();
    same(
        "manifest.json",
        &json(serde_json::from_str(&manifest)),
        &["files"],
    );
    for file in files_of_dataset(&text) {
        assert!(
            folder.path().join("dataset").join(&file).is_file(),
            "a dataset has no {file}"
        );
    }
    let table = fs::read_to_string(folder.path().join("dataset/truth/sub_rays.csv")).unwrap();
    let columns: BTreeSet<String> = table
        .lines()
        .next()
        .unwrap()
        .split(',')
        .map(str::to_owned)
        .collect();
    assert_eq!(
        first_column(&text, "## sub_rays.csv"),
        columns,
        "sub_rays.csv: documented (left) and written (right)"
    );
    let figures = keys(&json(serde_json::from_str(&stdout(&output))), &[]);
    let section = text
        .split("## simulate --json")
        .nth(1)
        .unwrap()
        .split("\n## ")
        .next()
        .unwrap();
    let documented: BTreeSet<String> = code_words(section).into_iter().collect();
    assert_eq!(
        documented, figures,
        "simulate --json: documented (left) and printed (right)"
    );
}

#[test]
fn documented_figures_of_a_layout_are_those_of_its_json() {
    let text = read("docs/guide/12-layouts.md");
    let scene = scene::load(&root().join("scenes/two-mirror.toml"), &[]).unwrap();
    let mut analysis = catoptric::layout::analyze(&scene, None, catoptric::layout::Detail::Full).unwrap();
    analysis.accuracy = Some(catoptric::layout::predict(&scene, scene.seed));
    let written = keys(&serde_json::to_value(&analysis).unwrap(), &["counts"]);
    assert_eq!(
        first_column(&text, "## layout --json"),
        written,
        "documented (left) and written (right)"
    );
    let classes: BTreeSet<String> = catoptric::layout::Class::ALL.map(|c| c.name().to_owned()).into();
    assert_eq!(first_column(&text, "## What becomes of each element"), classes);
}

#[test]
fn documented_figures_of_a_tolerance_are_those_of_its_json() {
    use catoptric::tolerance::{Bounds, Calibrated, Workshop};
    let text = read("docs/guide/15-tolerances.md");
    let scene = scene::load(&root().join("scenes/two-mirror.toml"), &[]).unwrap();
    let workshop = Workshop::new(&scene).unwrap();
    let mut tolerance = workshop.summarize(&[workshop.build(1).unwrap()]);
    tolerance.bound = Some(Bounds::of(&[]));
    tolerance.calibrated = Some(Calibrated::of(&[]));
    assert_eq!(
        first_column(&text, "## tolerance --json"),
        keys(&serde_json::to_value(&tolerance).unwrap(), &[]),
        "documented (left) and written (right)"
    );
}

/// The files listed in the picture of a dataset folder.
fn files_of_dataset(text: &str) -> Vec<String> {
    let picture = &code_blocks(text, "text")[0];
    let files: Vec<String> = picture
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .map(str::to_owned)
        .collect();
    assert!(files.len() > 4, "{picture}");
    files
}

#[test]
fn the_ci_chapter_shows_the_example_that_is_run() {
    let shown = code_blocks(&read("docs/guide/10-ci.md"), "rust");
    assert_eq!(shown, [read("examples/ci/calibrator.rs")]);
}

#[test]
fn the_chapter_on_testing_shows_the_program_that_is_run() {
    let shown = code_blocks(&read("docs/guide/9-test-your-own.md"), "python");
    assert_eq!(shown, [read("examples/python/calibrate.py")]);
    assert!(read(".ci/run").contains("examples/python/calibrate.py \"$work/own-data\""));
}

#[test]
fn every_status_is_explained() {
    let text = read("docs/guide/4-calibrating-and-scoring.md");
    let explained = first_column(&text, "## Every element has a status");
    let all: BTreeSet<String> = Status::ALL.iter().map(|s| s.word().to_owned()).collect();
    assert_eq!(explained, all);
}

/// The words of a choice in the scene's schema, or the keys of its tables.
fn choices(name: &str) -> Vec<String> {
    let schema = scene::json_schema();
    let variants = schema["$defs"][name]["oneOf"].as_array().unwrap().clone();
    let word = |v: &Value| {
        v["const"]
            .as_str()
            .or(v["required"][0].as_str())
            .unwrap()
            .to_owned()
    };
    variants.iter().map(word).collect()
}

#[test]
fn the_guide_names_every_choice() {
    let guide = |chapter| code_words(&read(chapter)).join(" ");
    let simulating = guide("docs/guide/3-simulating.md");
    for name in ["Preset", "Detector", "EchoChoice", "FacetShape"] {
        for word in choices(name) {
            assert!(simulating.contains(&word), "{name}: {word}");
        }
    }
    let calibrating = guide("docs/guide/4-calibrating-and-scoring.md");
    for method in calib::Method::ALL {
        assert!(calibrating.contains(method.name()), "{method:?}");
    }
    let text = read("docs/guide/3-simulating.md");
    for format in catoptric::files::mesh::MeshFormat::ALL {
        assert!(text.contains(&format.extension().to_uppercase()), "{format:?}");
    }
}
