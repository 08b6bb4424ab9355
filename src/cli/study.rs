//! `catoptric study`: many experiments, and what their errors have in common.

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::output::{counted, print, quoted};
use super::progress::Progress;
use catoptric::calib::Method;
use catoptric::io::{self, scene};
use catoptric::report;
use catoptric::study::{
    Cell, Contestant, Job, Program, Run, Study, Summary, angles, from_csv, run as run_one, summarize, to_csv,
};
use clap::Args;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Experiments between two files on disk: what an interruption can cost.
const CHUNK: usize = 32;

/// What was asked for, in the folder of the study.
const PLAN: &str = "plan.json";
const RUNS: &str = "runs.csv";
const TIMES: &str = "times.csv";
const RESULT: &str = "study.json";
const PAGE: &str = "report.html";
const ELEMENTS: &str = "elements.csv";

/// Arguments of `study`.
#[derive(Debug, Args)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    study: StudyArguments,
}

#[derive(Debug, clap::Subcommand)]
enum Verb {
    /// Put the shards of a study together
    Merge(MergeArguments),
}

#[derive(Debug, Args)]
struct MergeArguments {
    /// The folders of all shards.
    #[arg(required = true, value_name = "DIR")]
    shards: Vec<PathBuf>,
    /// The folder to write.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct StudyArguments {
    /// The scene.
    #[arg(required = true)]
    scene: Option<PathBuf>,
    /// How many experiments of every kind: seeds 1 to N.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// Who calibrates: our methods, and "oracle", which knows the truth.
    #[arg(
        long,
        value_name = "NAME,…",
        value_delimiter = ',',
        default_value = "joint,beam-gls,beam"
    )]
    methods: Vec<String>,
    /// A program that calibrates too, any number of times: NAME=COMMAND. It is given the folder of a blind dataset and the
    /// file to write, where the command says {dataset} and {out} or at its end.
    #[arg(long, value_name = "NAME=COMMAND")]
    program: Vec<String>,
    /// After how long a program is taken to hang, in seconds.
    #[arg(long, value_name = "S", default_value_t = 600)]
    program_timeout_s: u64,
    /// Adds to every method of ours one that is told of no bias.
    #[arg(long)]
    uncorrected: bool,
    /// A value of the scene to be varied, any number of times: key=a,b,c or key=from:to:steps.
    #[arg(long, value_name = "KEY=VALUES")]
    axis: Vec<String>,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Do the i-th of N parts: 1/4. `study merge` puts them together.
    #[arg(long, value_name = "i/N", default_value = "1/1")]
    shard: String,
    /// Also list θ_a and φ of every element of every run.
    #[arg(long)]
    elements: bool,
    /// The folder to write. An interrupted study goes on from there.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// What makes two folders parts of one study.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Plan {
    schema_version: u32,
    version: String,
    name: String,
    /// Every cell's values and the SHA-256 of its scene.
    cells: Vec<PlannedCell>,
    seeds: u64,
    contestants: Vec<String>,
    shard: [usize; 2],
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct PlannedCell {
    values: Vec<(String, String)>,
    scene_sha256: String,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    match &arguments.verb {
        Some(Verb::Merge(merge)) => merge_shards(merge),
        None => study(&arguments.study, context),
    }
}

fn invalid(message: String, help: &str) -> CliError {
    CliError::Invalid {
        message,
        help: Some(help.to_owned()),
    }
}

fn study(arguments: &StudyArguments, context: &Context) -> Result<(), CliError> {
    let [part, parts] = shard(&arguments.shard)?;
    let (Some(scene_path), Some(out)) = (&arguments.scene, &arguments.out) else {
        return Err(invalid(
            "no scene or no folder is given".to_owned(),
            "catoptric study scene.toml --out study",
        ));
    };
    let study = Study {
        cells: cells(scene_path, arguments)?,
        seeds: arguments.seeds,
        contestants: contestants(arguments)?,
    };
    let plan = plan_of(&study, [part, parts])?;
    claim(out, &plan)?;
    let jobs: Vec<Job> = study
        .jobs()
        .enumerate()
        .filter(|(i, _)| i % parts == part - 1)
        .map(|(_, job)| job)
        .collect();
    let mut progress = Progress::new(context, "experiments", jobs.len());
    let mut runs: Vec<Run> = Vec::new();
    for (number, chunk) in jobs.chunks(CHUNK).enumerate() {
        let (path, times) = (
            out.join(format!("runs-{number:06}.csv")),
            out.join(format!("times-{number:06}.csv")),
        );
        interrupt::check()?;
        let done = if path.exists() {
            read_runs(&path)?
        } else {
            let done = chunk
                .par_iter()
                .map(|job| run_one(&study, *job))
                .collect::<Result<Vec<_>, _>>()?
                .concat();
            io::write_file(&times, times_csv(&done).as_bytes())?;
            io::write_file(&path, to_csv(&done).as_bytes())?;
            done
        };
        runs.extend(done);
        progress.advance(chunk.len());
    }
    drop(progress);
    if arguments.elements {
        let rows = jobs
            .par_iter()
            .map(|job| Ok(elements_csv(*job, &angles(&study, *job)?)))
            .collect::<Result<Vec<String>, CliError>>()?;
        let text = format!("{ELEMENTS_HEADER}{}", rows.concat());
        io::write_file(out.join(ELEMENTS), text.as_bytes())?;
    }
    join_times(out, jobs.len().div_ceil(CHUNK))?;
    let summary = finish(&study, runs, &plan.name, out)?;
    for number in 0..jobs.len().div_ceil(CHUNK) {
        for kind in ["runs", "times"] {
            let path = out.join(format!("{kind}-{number:06}.csv"));
            std::fs::remove_file(&path).map_err(|source| CliError::Write { path, source })?;
        }
    }
    tell(&summary, out, arguments.json)
}

/// Runs in order, their table, result and page.
fn finish(study: &Study, mut runs: Vec<Run>, name: &str, out: &Path) -> Result<Summary, CliError> {
    let place = |r: &Run| study.contestants.iter().position(|c| c.name() == r.method);
    runs.sort_by_key(|r| (r.cell, r.seed, place(r)));
    let summary = summarize(study, &runs);
    io::write_file(out.join(RUNS), to_csv(&runs).as_bytes())?;
    io::write_file(out.join(PAGE), report::study(name, &summary).as_bytes())?;
    io::write_json(out.join(RESULT), &summary)?;
    Ok(summary)
}

fn merge_shards(arguments: &MergeArguments) -> Result<(), CliError> {
    let mut first: Option<Plan> = None;
    let mut seen: Vec<usize> = Vec::new();
    let mut runs = Vec::new();
    let mut elements = String::new();
    for folder in &arguments.shards {
        let mut plan: Plan = io::read_json(folder.join(PLAN))?;
        let [part, parts] = plan.shard;
        plan.shard = [1, 1];
        let known = first.get_or_insert_with(|| plan.clone());
        if *known != plan {
            return Err(invalid(
                format!(
                    "{} is a part of another study than {}",
                    folder.display(),
                    arguments.shards[0].display()
                ),
                "give the shards of one study: same scene, seeds, methods and axes",
            ));
        }
        if parts != arguments.shards.len() {
            return Err(invalid(
                format!(
                    "{} is one of {}, and {} given",
                    folder.display(),
                    counted(parts, "shard"),
                    counted(arguments.shards.len(), "folder")
                ),
                "give every shard once",
            ));
        }
        if seen.contains(&part) {
            return Err(invalid(
                format!(
                    "shard {part}/{parts} is given twice, the second time as {}",
                    folder.display()
                ),
                "give every shard once",
            ));
        }
        seen.push(part);
        runs.extend(read_runs(&folder.join(RUNS))?);
        if let Ok(text) = std::fs::read_to_string(folder.join(ELEMENTS)) {
            elements += text.split_once('\n').map_or("", |(_, rows)| rows);
        }
    }
    let Some(plan) = first else {
        return Err(invalid(
            "no shard is given".to_owned(),
            "catoptric study merge part-1 part-2 --out whole",
        ));
    };
    let study = named(&plan)?;
    claim(&arguments.out, &plan)?;
    if !elements.is_empty() {
        let mut rows: Vec<&str> = elements.lines().collect();
        let key = |row: &&str| {
            let mut fields = row.split(',').map(|f| f.parse::<u64>().unwrap_or(u64::MAX));
            (fields.next(), fields.next())
        };
        rows.sort_by_key(key);
        let text = format!("{ELEMENTS_HEADER}{}\n", rows.join("\n"));
        io::write_file(arguments.out.join(ELEMENTS), text.as_bytes())?;
    }
    let summary = finish(&study, runs, &plan.name, &arguments.out)?;
    tell(&summary, &arguments.out, arguments.json)
}

/// A study with the names of a plan; its scenes are not needed any more.
fn named(plan: &Plan) -> Result<Study, CliError> {
    let scene = scene::parse(
        scene::scene_template(scene::Layout::Prototype),
        "prototype.toml",
        &[],
    )?;
    let contestant = |name: &String| match name.as_str() {
        "oracle" => Contestant::Oracle,
        _ => match (name.parse(), name.strip_suffix(" uncorrected").map(str::parse)) {
            (Ok(method), _) => Contestant::Method(method),
            (_, Some(Ok(method))) => Contestant::Uncorrected(method),
            _ => Contestant::Program(Program {
                name: name.clone(),
                command: Vec::new(),
                timeout_s: 0,
            }),
        },
    };
    Ok(Study {
        cells: plan
            .cells
            .iter()
            .map(|c| Cell {
                values: c.values.clone(),
                scene: scene.clone(),
            })
            .collect(),
        seeds: plan.seeds,
        contestants: plan.contestants.iter().map(contestant).collect(),
    })
}

fn read_runs(path: &Path) -> Result<Vec<Run>, CliError> {
    let text = std::fs::read_to_string(path).map_err(|source| io::IoError::Read {
        path: path.to_owned(),
        source,
    })?;
    from_csv(&text).map_err(|what| CliError::Invalid {
        message: format!("{}: {what}", path.display()),
        help: Some("delete it, and its runs are done again".to_owned()),
    })
}

/// The folder is new, or of the very same study.
fn claim(out: &Path, plan: &Plan) -> Result<(), CliError> {
    let path = out.join(PLAN);
    if path.exists() {
        let there: Plan = io::read_json(&path)?;
        if there == *plan {
            return Ok(());
        }
        return Err(invalid(
            format!(
                "{} holds another study: {}",
                out.display(),
                difference(&there, plan)
            ),
            "give another --out, or the same arguments to go on with it",
        ));
    }
    if out.read_dir().is_ok_and(|mut entries| entries.next().is_some()) {
        return Err(invalid(
            format!("{} is not empty and holds no study", out.display()),
            "give another --out",
        ));
    }
    std::fs::create_dir_all(out).map_err(|source| CliError::Write {
        path: out.to_owned(),
        source,
    })?;
    Ok(io::write_json(path, plan)?)
}

fn difference(there: &Plan, wanted: &Plan) -> String {
    if there.version != wanted.version {
        format!(
            "it was begun by version {}, this is {}",
            there.version, wanted.version
        )
    } else if there.seeds != wanted.seeds {
        format!("{} seeds, {} asked for", there.seeds, wanted.seeds)
    } else if there.contestants != wanted.contestants {
        format!(
            "methods {}, {} asked for",
            there.contestants.join(","),
            wanted.contestants.join(",")
        )
    } else if there.shard != wanted.shard {
        let of = |[part, parts]: [usize; 2]| format!("{part}/{parts}");
        format!("shard {}, {} asked for", of(there.shard), of(wanted.shard))
    } else {
        "its scene or its axes differ".to_owned()
    }
}

fn plan_of(study: &Study, shard: [usize; 2]) -> Result<Plan, CliError> {
    let cells = study.cells.iter().map(|cell| {
        let text = scene::to_toml(&cell.scene).map_err(|e| CliError::Output(std::io::Error::other(e)))?;
        Ok(PlannedCell {
            values: cell.values.clone(),
            scene_sha256: io::file::sha256(text.as_bytes()),
        })
    });
    Ok(Plan {
        schema_version: catoptric::study::SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        name: study
            .cells
            .first()
            .map_or(String::new(), |c| c.scene.name.clone()),
        cells: cells.collect::<Result<_, CliError>>()?,
        seeds: study.seeds,
        contestants: study.contestants.iter().map(Contestant::name).collect(),
        shard,
    })
}

fn shard(text: &str) -> Result<[usize; 2], CliError> {
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

fn contestants(arguments: &StudyArguments) -> Result<Vec<Contestant>, CliError> {
    let mut all: Vec<Contestant> = Vec::new();
    for name in &arguments.methods {
        if name == "oracle" {
            all.push(Contestant::Oracle);
            continue;
        }
        let method: Method =
            name.parse()
                .map_err(|error: catoptric::calib::CalibError| CliError::Invalid {
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
fn cells(scene_path: &Path, arguments: &StudyArguments) -> Result<Vec<Cell>, CliError> {
    let mut grid: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for text in &arguments.axis {
        let (key, values) = axis(text)?;
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
            let mut sets = arguments.set.clone();
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
    Ok((key.to_owned(), values))
}

fn times_csv(runs: &[Run]) -> String {
    let row = |r: &Run| format!("{},{},{},{:.3}\n", r.cell, r.seed, r.method, r.milliseconds);
    runs.iter().map(row).collect()
}

/// How long each calibration took: beside what is compared, since no two runs take equally long.
fn join_times(out: &Path, chunks: usize) -> Result<(), CliError> {
    let mut text = "cell,seed,method,milliseconds\n".to_owned();
    for number in 0..chunks {
        text += &std::fs::read_to_string(out.join(format!("times-{number:06}.csv"))).unwrap_or_default();
    }
    Ok(io::write_file(out.join(TIMES), text.as_bytes())?)
}

const ELEMENTS_HEADER: &str =
    "cell,seed,method,beam,azimuth_deg,elevation_deg,true_azimuth_deg,true_elevation_deg\n";

fn elements_csv(job: Job, found: &[catoptric::study::ElementAngles]) -> String {
    found
        .iter()
        .map(|e| {
            format!(
                "{},{},{},{},{},{},{},{}\n",
                job.cell, e.seed, e.method, e.beam, e.estimate[0], e.estimate[1], e.truth[0], e.truth[1]
            )
        })
        .collect()
}

fn tell(summary: &Summary, out: &Path, json: bool) -> Result<(), CliError> {
    if json {
        let text = serde_json::to_string(summary).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{text}\n"));
    }
    let mut text = format!(
        "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9}  {}\n",
        "method", "runs", "rms (°)", "limit (°)", "efficiency", "ANEES", "95 %", "verdict"
    );
    for m in &summary.methods {
        if !m.axes.is_empty() {
            let values: Vec<String> = m.axes.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            text += &format!("{}\n", values.join(", "));
        }
        let number = |v: f64, decimals: usize| {
            if v.is_finite() {
                format!("{v:.decimals$}")
            } else {
                "–".to_owned()
            }
        };
        text += &format!(
            "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9}  {}\n",
            m.method,
            m.runs,
            number(m.per_axis_rms_deg, 4),
            number(m.crlb_per_axis_deg, 4),
            number(m.efficiency, 3),
            number(m.anees, 2),
            number(m.coverage_95.share, 3),
            m.failure.as_ref().map_or(m.verdict.clone(), |f| format!(
                "{}; {} failed: {f}",
                m.verdict, m.failed
            )),
        );
    }
    print(&format!(
        "{text}wrote {}, {RUNS} and {PAGE}\n",
        quoted(&out.join(RESULT))
    ))
}
