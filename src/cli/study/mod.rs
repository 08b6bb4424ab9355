//! `catoptric study`: many experiments, and what their errors have in common.

mod grid;
mod plan;
mod results;
mod shards;

use super::Context;
use super::error::CliError;
use super::interrupt;
use super::progress::Progress;
use catoptric::study::{ElementAngles, Job, Run, Study, run_with_elements};
use clap::Args;
use plan::Plan;
use rayon::prelude::*;
use results::{Found, Tables};
use std::path::{Path, PathBuf};

/// Experiments between two files on disk: what an interruption can cost.
const CHUNK: usize = 32;

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
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "joint")]
    methods: Vec<String>,
    /// A program that calibrates too, any number of times: NAME=COMMAND. It is given the folder of a blind dataset and the
    /// file to write: where the command says {dataset} and {out}, and at its end if it does not. What it says is split at
    /// spaces and run without a shell.
    #[arg(long, value_name = "NAME=COMMAND")]
    program: Vec<String>,
    /// After how long a program is taken to hang, in seconds.
    #[arg(long, value_name = "S", default_value_t = 600)]
    program_timeout_s: u64,
    /// Adds to every method of ours one that is told of no bias, and believes that biases are as likely as those are large.
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
    /// Also list θ_a and φ of every element of every run, and how they spread over the seeds.
    #[arg(long)]
    elements: bool,
    /// The folder to write. An interrupted study goes on from there.
    // Required of a study, absent where shards are merged; both hold of `scene` too.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    match &arguments.verb {
        Some(Verb::Merge(merge)) => shards::merge(merge),
        None => study_scene(&arguments.study, context),
    }
}

fn invalid(message: String, help: &str) -> CliError {
    CliError::Invalid {
        message,
        help: Some(help.to_owned()),
    }
}

fn study_scene(arguments: &StudyArguments, context: &Context) -> Result<(), CliError> {
    let shard = grid::shard(&arguments.shard)?;
    let (Some(scene), Some(out)) = (&arguments.scene, &arguments.out) else {
        return Err(invalid(
            "a scene and --out are needed".to_owned(),
            "catoptric study scene.toml --out study",
        ));
    };
    let study = Study {
        cells: grid::cells(scene, &arguments.axis, &arguments.set)?,
        seeds: arguments.seeds,
        contestants: grid::contestants(arguments)?,
        stop: interrupt::flag(),
    };
    let plan = Plan::of(&study, shard)?;
    plan.claim(out)?;
    let jobs = study.jobs_of_part(shard);
    let tables = Tables::of(out);
    // Once they were asked for, they belong to the study.
    let with_elements = arguments.elements || tables.elements.exists();
    let found = if tables.runs.exists() && tables.elements.exists() >= with_elements {
        tables.read(&study, &jobs)?
    } else {
        simulate(&study, &jobs, out, with_elements, context)?
    };
    let summary = results::write(&study, &found, &plan, out)?;
    for number in 0..jobs.len().div_ceil(CHUNK) {
        Tables::of_chunk(out, number).remove()?;
    }
    results::tell(&summary, out, arguments.json)
}

/// All experiments, chunk by chunk; those on disk are not done again.
fn simulate(
    study: &Study,
    jobs: &[Job],
    out: &Path,
    with_elements: bool,
    context: &Context,
) -> Result<Found, CliError> {
    let mut progress = Progress::new(context, "experiments", jobs.len());
    let mut found = Found::default();
    for (number, chunk) in jobs.chunks(CHUNK).enumerate() {
        let tables = Tables::of_chunk(out, number);
        let done = if tables.runs.exists() && tables.elements.exists() >= with_elements {
            tables.read(study, chunk)?
        } else {
            let done = experiments(study, chunk, with_elements)?;
            tables.write(&done)?;
            done
        };
        found.extend(done);
        progress.advance(chunk.len());
    }
    Ok(found)
}

/// Nothing of a chunk is kept if Ctrl-C was pressed meanwhile: programs are ended then, which is no failure of theirs.
fn experiments(study: &Study, chunk: &[Job], with_elements: bool) -> Result<Found, CliError> {
    let one = |job: &Job| {
        interrupt::check()?;
        Ok::<(Vec<Run>, Vec<ElementAngles>), CliError>(run_with_elements(study, *job)?)
    };
    let (runs, elements): (Vec<_>, Vec<_>) = chunk
        .par_iter()
        .map(one)
        .collect::<Result<Vec<_>, CliError>>()?
        .into_iter()
        .unzip();
    interrupt::check()?;
    let runs = runs.concat();
    Ok(Found {
        times: results::times(&runs),
        runs,
        elements: with_elements.then(|| elements.concat()),
    })
}
