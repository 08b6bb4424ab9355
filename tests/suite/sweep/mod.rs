//! Every number of every file, set to what no number should be: refused with its place and key, or within the limits that
//! the schema states.
//!
//! The schema is followed here once more, independently of the reader: both must agree about every number. The files have
//! every key of their schema. What a verb makes of the values that are within the limits is shown by the long form,
//! `cargo test --release --test suite sweep:: -- --ignored --nocapture`, which goes through the program.

mod limits;

use crate::common::{VALID, catoptric};
use crate::corpus::corpus;
use catoptric::files::rays::RayReader;
use catoptric::files::scene::{self, SceneErrors};
use catoptric::files::schema::FileKind;
use catoptric::files::{
    npy, parse_calibration, parse_characterization, parse_manifest, parse_session, parse_truth,
};
use limits::{MARK, allows, example, marked, numbers, replaced, schema_at, tree};
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

/// What replaces a number, in TOML and in JSON.
const VALUES: [(&str, &str); 8] = [
    ("nan", "NaN"),
    ("inf", "Infinity"),
    ("-inf", "-Infinity"),
    ("-1", "-1"),
    ("0", "0"),
    ("1e18", "1e18"),
    ("1e308", "1e308"),
    ("1000000000000000000", "1e999"),
];

/// Reads a file of a kind; the error as text.
fn read(kind: FileKind, name: &str, text: &str) -> Result<(), String> {
    let (bytes, path) = (text.as_bytes(), Path::new(name));
    let said = |e: catoptric::files::IoError| e.to_string();
    match kind {
        FileKind::Session => parse_session(bytes, path).map(drop).map_err(said),
        FileKind::Truth => parse_truth(bytes, path).map(drop).map_err(said),
        FileKind::Calibration => parse_calibration(bytes, path).map(drop).map_err(said),
        FileKind::Characterization => parse_characterization(bytes, path).map(drop).map_err(said),
        FileKind::Manifest => parse_manifest(bytes, path).map(drop).map_err(said),
        FileKind::Scene => match scene::parse(text, name, &[]) {
            Ok(_) => Ok(()),
            Err(SceneErrors::Invalid(problems)) => {
                let line = |d| {
                    let (line, column) = problems
                        .position(d)
                        .unwrap_or_else(|| panic!("no place: {problems}"));
                    format!("{name}:{line}:{column}: {}", d.message)
                };
                Err(problems.list.iter().map(line).collect::<Vec<_>>().join("\n"))
            }
            Err(other) => Err(other.to_string()),
        },
    }
}

/// The files: one with every key of its schema for each kind, and the samples of the corpus.
fn files() -> Vec<(FileKind, String, String)> {
    let mut files = Vec::new();
    for kind in FileKind::ALL {
        let sample = |name: &str| std::fs::read_to_string(corpus().join(kind.name()).join(name)).unwrap();
        if kind == FileKind::Scene {
            files.push((kind, "valid.toml".to_owned(), VALID.to_owned()));
            files.push((kind, "small.toml".to_owned(), sample("small.toml")));
            files.push((kind, "small.json".to_owned(), sample("small.json")));
            continue;
        }
        let schema = kind.json_schema();
        let every_key = example(&schema, &schema);
        if kind == FileKind::Session {
            files.push((
                kind,
                "every-key.toml".to_owned(),
                toml::to_string(&every_key).unwrap(),
            ));
            files.push((kind, "small.toml".to_owned(), sample("small.toml")));
        } else {
            files.push((kind, "every-key.json".to_owned(), format!("{every_key:#}")));
            files.push((kind, "small.json".to_owned(), sample("small.json")));
        }
    }
    files
}

/// What became of the combinations.
#[derive(Debug, Default)]
struct Count {
    numbers: usize,
    refused: usize,
    legal: usize,
    slowest: Duration,
    /// Runs that took longer than [`LONGEST`], for whoever runs it on a quiet machine.
    slow: usize,
}

/// Duration of a run of the program that should not be exceeded on a machine that has nothing else to do.
const LONGEST: Duration = Duration::from_secs(2);

/// A number of a text.
struct Number {
    at: Range<usize>,
    /// Its path, with `[]` for an index.
    list: String,
    /// Its own key.
    key: String,
    /// Its schema.
    limits: Value,
}

/// The numbers of a file: the first and the last of each list, or all.
fn numbers_of(kind: FileKind, name: &str, text: &str, all: bool) -> Vec<Number> {
    let schema = match kind {
        FileKind::Scene => scene::json_schema(),
        _ => kind.json_schema(),
    };
    let mut by_path: BTreeMap<String, Vec<Number>> = BTreeMap::new();
    for at in numbers(text) {
        let mut path = Vec::new();
        let changed = tree(&replaced(text, &at, &MARK.to_string()), name.ends_with(".json"));
        assert!(marked(&changed, &mut path), "{name}: {at:?}");
        let steps: Vec<&str> = path.iter().map(|s| s.as_str().unwrap_or("[]")).collect();
        let list = steps.join(".");
        let limits = schema_at(&schema, &schema, &path);
        let number = Number {
            at,
            key: path.iter().rev().find_map(Value::as_str).unwrap().to_owned(),
            limits: limits
                .unwrap_or_else(|| panic!("{name}: no schema of {list}"))
                .clone(),
            list: list.clone(),
        };
        by_path.entry(list).or_default().push(number);
    }
    assert!(!by_path.is_empty(), "{name} has no numbers");
    let sampled = by_path.into_values().map(|mut places| {
        if !all && places.len() > 2 {
            places.drain(1..places.len() - 1);
        }
        places
    });
    sampled.flatten().collect()
}

/// Sweeps over the numbers of a file.
fn sweep(kind: FileKind, name: &str, text: &str, all: bool, count: &mut Count) {
    let is_json = name.ends_with(".json");
    for Number {
        at,
        list,
        key,
        limits,
    } in &numbers_of(kind, name, text, all)
    {
        count.numbers += 1;
        let before = &text[..at.start];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap().chars().count() + 1;
        for (toml, json) in VALUES {
            let value = if is_json { json } else { toml };
            let changed = replaced(text, at, value);
            let begin = Instant::now();
            let ended = read(kind, name, &changed);
            count.slowest = count.slowest.max(begin.elapsed());
            let place = format!("{name}:{line}:");
            match ended {
                Ok(()) => {
                    assert!(allows(limits, value), "{name}: {list} = {value} is read");
                    count.legal += 1;
                }
                Err(said) if allows(limits, value) => {
                    // Another number forbids it: the place is one of the two.
                    assert!(said.starts_with(&format!("{name}:")), "{list} = {value}: {said}");
                    count.legal += 1;
                }
                // What is no number in JSON ends the reading there, without the key.
                Err(said) if json.parse::<f64>().is_ok_and(f64::is_finite) || !is_json => {
                    let there = said
                        .lines()
                        .find(|l| l.starts_with(&format!("{place}{column}: ")));
                    let said = there.unwrap_or_else(|| panic!("{list} = {value} at {line}:{column}: {said}"));
                    assert!(said.contains(key), "{list} = {value}: {said}");
                    count.refused += 1;
                }
                Err(said) => {
                    assert!(said.starts_with(&place), "{list} = {value}: {said}");
                    count.refused += 1;
                }
            }
        }
    }
}

#[test]
fn every_number_is_refused_with_its_place_or_within_its_limits() {
    let mut count = Count::default();
    for (kind, name, text) in files() {
        sweep(kind, &name, &text, false, &mut count);
    }
    assert!(count.numbers > 500 && count.refused > count.legal, "{count:?}");
}

/// The values of a ray, and whether each is allowed in the columns of the origin and of the direction.
const OF_RAYS: [(f64, bool, bool); 8] = [
    (f64::NAN, false, false),
    (f64::INFINITY, false, false),
    (f64::NEG_INFINITY, false, false),
    (-1.0, true, true),
    (0.0, true, true),
    (1e18, false, true),
    (1e308, false, true),
    (10_000.001, false, true),
];

#[test]
fn every_number_of_rays_is_refused_with_its_place_or_within_its_limits() {
    let good = [0.5, -0.5, 0.25, 0.0, 0.6, 0.8];
    for (column, (value, origin, direction)) in (0..6).flat_map(|c| OF_RAYS.map(|v| (c, v))) {
        let mut bad = good;
        bad[column] = value;
        let text = format!(
            "x_m,y_m,z_m,dx,dy,dz\n{}\n{}\n",
            good.map(|n| n.to_string()).join(","),
            bad.map(|n| n.to_string()).join(",")
        );
        let numbers = good.iter().chain(&bad).flat_map(|n| n.to_le_bytes());
        let array: Vec<u8> = npy::header(2, 6).into_iter().chain(numbers).collect();
        let before: usize = bad[..column].iter().map(|n| n.to_string().len() + 1).sum();
        let places = [
            (
                "rays.csv",
                text.into_bytes(),
                format!("rays.csv:3:{}: ", before + 1),
            ),
            (
                "rays.npy",
                array,
                format!("(by byte {})", npy::HEADER_LENGTH + 48 + 8 * column),
            ),
        ];
        for (name, bytes, place) in places {
            let read = RayReader::parse(&bytes, Path::new(name)).and_then(|mut reader| reader.next_rays(10));
            let allowed = if column < 3 { origin } else { direction };
            match read {
                Ok(rays) => {
                    assert!(allowed && rays.len() == 2, "{name}: column {column} = {value}");
                    let length = rays[1].direction.norm();
                    assert!((length - 1.0).abs() < 1e-12, "{length}");
                }
                Err(error) => {
                    let said = error.to_string();
                    let key = ["x_m", "y_m", "z_m", "dx", "dy", "dz"][column];
                    assert!(
                        !allowed && said.contains(key) && said.contains(&place),
                        "{value}: {said}"
                    );
                    assert_eq!(error.exit_code(), 2);
                }
            }
        }
    }
}

/// The verb that reads a file of a dataset, and what it makes of it: the folder of the dataset is `data`.
fn arguments(kind: FileKind) -> Vec<&'static [&'static str]> {
    match kind {
        FileKind::Scene => vec![&["check", "scene.toml"], &["layout", "scene.toml", "--json"]],
        FileKind::Session | FileKind::Manifest => vec![&["calibrate", "data", "--out", "c.json"]],
        FileKind::Truth => vec![&["score", "data", "calibration.json"]],
        FileKind::Calibration => vec![
            &["score", "data", "calibration.json"],
            &["apply", "data", "calibration.json", "--out", "cloud.ply"],
            &["validate", "calibration.json"],
        ],
        FileKind::Characterization => vec![&[
            "calibrate",
            "data",
            "--characterization",
            "characterization.json",
            "--out",
            "c.json",
        ]],
    }
}

/// The long form: every number of every file of a whole experiment, through the program.
#[test]
#[ignore = "thousands of runs of the program: half an hour"]
fn every_number_of_an_experiment_through_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::copy(corpus().join("scene/small.toml"), at.join("scene.toml")).unwrap();
    let run = |arguments: &[&str]| {
        let begin = Instant::now();
        let output = catoptric().args(arguments).current_dir(at).output().unwrap();
        (output, begin.elapsed())
    };
    for arguments in [
        &["simulate", "scene.toml", "--out", "data"][..],
        &["calibrate", "data", "--out", "calibration.json"],
        &["characterize", "data", "--out", "characterization.json"],
    ] {
        assert_eq!(run(arguments).0.status.code(), Some(0), "{arguments:?}");
    }
    // Otherwise every change would be found by the hashes.
    std::fs::remove_file(at.join("data/manifest.json")).unwrap();
    let (mut faults, mut total) = (Vec::new(), Count::default());
    for (kind, name) in [
        (FileKind::Scene, "scene.toml"),
        (FileKind::Session, "data/session.toml"),
        (FileKind::Truth, "data/truth/truth.json"),
        (FileKind::Calibration, "calibration.json"),
        (FileKind::Characterization, "characterization.json"),
    ] {
        let (text, is_json) = (
            std::fs::read_to_string(at.join(name)).unwrap(),
            name.ends_with(".json"),
        );
        let (mut count, mut codes) = (Count::default(), BTreeMap::<i32, usize>::new());
        sweep(kind, name, &text, true, &mut count);
        let mut seen = BTreeSet::new();
        for number in numbers_of(kind, name, &text, true) {
            let is_first = seen.insert(number.list.clone());
            for (toml, json) in VALUES {
                let value = if is_json { json } else { toml };
                // What the reader refuses goes through the program once for each list.
                if !is_first && !allows(&number.limits, value) {
                    continue;
                }
                std::fs::write(at.join(name), replaced(&text, &number.at, value)).unwrap();
                for arguments in arguments(kind) {
                    let (output, took) = run(arguments);
                    let code = output.status.code().unwrap_or(-1);
                    *codes.entry(code).or_default() += 1;
                    count.slowest = count.slowest.max(took);
                    let said = String::from_utf8_lossy(&output.stderr);
                    count.slow += usize::from(took > LONGEST);
                    // A verdict, which names the key, is about the one file that is judged.
                    let is_placed = code != 2 || said.contains(name) || said.contains(&number.key);
                    if !(0..=2).contains(&code) || !is_placed {
                        let list = &number.list;
                        faults.push(format!(
                            "{name}: {list} = {value}: {arguments:?}: {code}, {took:?}: {said}"
                        ));
                    }
                }
            }
        }
        let slowest = count.slowest;
        eprintln!(
            "{name}: {} numbers, exit codes {codes:?}, slowest {slowest:.1?}, {} above {LONGEST:?}",
            count.numbers, count.slow
        );
        std::fs::write(at.join(name), text).unwrap();
        total.numbers += count.numbers;
    }
    eprintln!("{} numbers", total.numbers);
    assert!(
        faults.is_empty(),
        "{} faults:\n{}",
        faults.len(),
        faults.join("\n")
    );
}
