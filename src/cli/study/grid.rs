//! What is studied: contestants, the grid of scene values, a part of it.

use super::{StudyArguments, invalid};
use crate::cli::error::CliError;
use catoptric::calib::{CalibError, Method};
use catoptric::files::scene;
use catoptric::study::{Cell, Contestant, Program};
use std::path::Path;

/// Which part of how many: `i/N`.
pub(super) fn shard(text: &str) -> Result<[usize; 2], CliError> {
    let found = text
        .split_once('/')
        .and_then(|(i, n)| Some([i.parse().ok()?, n.parse().ok()?]));
    found.filter(|[i, n]| (1..=*n).contains(i)).ok_or_else(|| {
        invalid(
            format!("--shard {text}: it is no part of a whole"),
            "--shard 1/4 is the first of four",
        )
    })
}

/// Who calibrates, each under a name of its own.
pub(super) fn contestants(arguments: &StudyArguments) -> Result<Vec<Contestant>, CliError> {
    let mut all: Vec<Contestant> = Vec::new();
    for name in &arguments.methods {
        if name == "oracle" {
            all.push(Contestant::Oracle);
            continue;
        }
        let method: Method = name.parse().map_err(|error: CalibError| CliError::Invalid {
            message: format!("--methods: {error}, and oracle"),
            help: None,
        })?;
        all.push(Contestant::Method(method));
        if arguments.uncorrected {
            all.push(Contestant::Uncorrected(method));
        }
    }
    for text in &arguments.program {
        let program = Program::parse(text, arguments.program_timeout_s).ok_or_else(|| {
            invalid(
                format!("--program {text}: it is not NAME=COMMAND"),
                "--program 'mine=python3 mine.py {dataset} {out}'",
            )
        })?;
        all.push(Contestant::Program(program));
    }
    let mut names: Vec<String> = all.iter().map(Contestant::name).collect();
    names.sort();
    if let Some(twice) = names.windows(2).find(|pair| pair[0] == pair[1]) {
        return Err(invalid(
            format!("{:?} is named twice", twice[0]),
            "name every method and program once",
        ));
    }
    Ok(all)
}

/// The grid: every combination of the axes' values.
pub(super) fn cells(scene_path: &Path, axes: &[String], sets: &[String]) -> Result<Vec<Cell>, CliError> {
    let mut grid: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for text in axes {
        let (key, values) = axis(text)?;
        if grid[0].iter().any(|(other, _)| *other == key) {
            return Err(invalid(
                format!("--axis {text}: {key} is an axis already"),
                "give all values of a key in one --axis",
            ));
        }
        if let Some(set) = sets.iter().find(|set| set.split('=').next() == Some(&key)) {
            return Err(invalid(
                format!("--axis {text}: --set {set} gives it one value"),
                "leave the --set out",
            ));
        }
        grid = grid
            .iter()
            .flat_map(|cell| {
                values.iter().map(|value| {
                    let mut cell = cell.clone();
                    cell.push((key.clone(), value.clone()));
                    cell
                })
            })
            .collect();
    }
    grid.into_iter()
        .map(|values| {
            let mut sets = sets.to_vec();
            sets.extend(values.iter().map(|(key, value)| format!("{key}={value}")));
            Ok(Cell {
                scene: scene::load(scene_path, &sets)?,
                values,
            })
        })
        .collect()
}

/// `key=a,b,c` or `key=from:to:steps`.
fn axis(text: &str) -> Result<(String, Vec<String>), CliError> {
    let wrong = || {
        invalid(
            format!("--axis {text}: it is neither KEY=a,b,c nor KEY=from:to:steps"),
            "--axis experiment.poses_per_group=3,4,6 or --axis errors.drift_sd_mm=0:2:5",
        )
    };
    let (key, values) = text.split_once('=').ok_or_else(wrong)?;
    let parts: Vec<&str> = values.split(':').collect();
    let values: Vec<String> = match parts.as_slice() {
        [from, to, steps] => {
            let (from, to): (f64, f64) = from.parse().ok().zip(to.parse().ok()).ok_or_else(wrong)?;
            let steps: u32 = steps
                .parse()
                .ok()
                .filter(|n| (2..=1000).contains(n))
                .ok_or_else(wrong)?;
            (0..steps)
                .map(|i| (from + (to - from) * f64::from(i) / f64::from(steps - 1)).to_string())
                .collect()
        }
        [list] => list.split(',').map(str::to_owned).collect(),
        _ => return Err(wrong()),
    };
    if key.is_empty() || values.iter().any(String::is_empty) {
        return Err(wrong());
    }
    if let Some(twice) = (1..values.len()).find(|i| values[..*i].contains(&values[*i])) {
        return Err(invalid(
            format!("--axis {text}: {} is there twice", values[twice]),
            "give every value of an axis once",
        ));
    }
    Ok((key.to_owned(), values))
}
