//! `catoptric study`: runs many experiments and reports the statistics of their errors.

use super::context::Context;
use super::error::CliError;
use super::judging::{Limits, conclude, junit_place, unknown, write_junit};
use super::output::{print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::junit::Suite;
use catoptric::requirement::Requirement;
use catoptric::study::folder::{PLAN, RESULT, SPREAD};
use catoptric::study::{Axis, Contestant, Part, Program, Study, StudyError, Summary, grid};
use catoptric::{Error, Output, STUDY_PAGE, Scene, Stop, Verdict, merge_studies, study_into};
use clap::Args;
use std::path::{Path, PathBuf};

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
    /// Merge the shards of a study
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
    #[command(flatten)]
    judging: Judging,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

/// What a study has to meet.
#[derive(Debug, Args)]
struct Judging {
    #[command(flatten)]
    limits: Limits,
    /// Also write the verdict on every contestant as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
}

impl Judging {
    /// The places of the study and of the JUnit file.
    fn places(&self, out: &Path, scene: Option<&PathBuf>) -> Result<(Output, Option<Output>), CliError> {
        let outputs = self.replacing.outputs(scene);
        // A folder that the study shares with others: only its own files are its own.
        for name in [
            PLAN,
            RESULT,
            SPREAD,
            STUDY_PAGE,
            "runs.csv",
            "elements.csv",
            "times.csv",
        ] {
            outputs.place(&out.join(name))?;
        }
        let junit = junit_place(self.junit.as_ref(), &outputs)?;
        Ok((Output::new(out).replacing(self.replacing.replace), junit))
    }
}

#[derive(Debug, Args)]
struct StudyArguments {
    /// The scene.
    #[arg(required = true)]
    scene: Option<PathBuf>,
    /// Number of experiments per cell of the grid: seeds 1 to N.
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    seeds: u64,
    /// The methods to study, by name, and "oracle", which knows the truth.
    #[arg(long, value_name = "NAME,…", value_delimiter = ',', default_value = "joint")]
    methods: Vec<String>,
    /// A calibration program to study as well: NAME=COMMAND. May be given more than once. {dataset} and {out} in the
    /// command are replaced by the folder of a blind dataset and the file to write; they are appended if missing. The
    /// command is split into words as a shell does, with quotes and backslashes, and run without a shell.
    #[arg(long, value_name = "NAME=COMMAND")]
    program: Vec<String>,
    /// Time limit of a program, in seconds.
    #[arg(long, value_name = "S", default_value_t = 600)]
    program_timeout_s: u64,
    /// Also study a variant of every method that corrects no bias; its standard deviations of the biases are as large as
    /// the biases themselves.
    #[arg(long)]
    uncorrected: bool,
    /// A value of the scene to vary: key=a,b,c or key=from:to:steps. May be given more than once.
    #[arg(long, value_name = "KEY=VALUES")]
    axis: Vec<String>,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Run only the i-th of N parts: 1/4. `study merge` merges them.
    #[arg(long, value_name = "i/N", default_value = "1/1")]
    shard: String,
    /// Also list θ_a and φ of every element of every run, and how they spread over the seeds.
    #[arg(long)]
    elements: bool,
    /// The folder to write. An interrupted study resumes from it.
    // Required for a study, absent when merging shards; the same holds for `scene`.
    #[arg(long, value_name = "DIR", required = true)]
    out: Option<PathBuf>,
    #[command(flatten)]
    judging: Judging,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    match &arguments.verb {
        Some(Verb::Merge(merge)) => {
            let requirements = merge.judging.limits.requirements(EXAMPLE)?;
            let (place, junit) = merge.judging.places(&merge.out, None)?;
            let summary = merge_studies(&merge.shards, place)?;
            show(&summary, &merge.out, merge.json)?;
            judge(&summary, &requirements, &merge.out, junit.as_ref())
        }
        None => study_scene(&arguments.study, context),
    }
}

fn invalid(message: String, help: &str) -> CliError {
    CliError::invalid(message, help.to_owned())
}

/// The error for the value of an option, whose name the message begins with.
fn option(error: StudyError) -> CliError {
    match error {
        StudyError::Invalid { message, help } => invalid(format!("--{message}"), &help),
        other => Error::from(other).into(),
    }
}

fn study_scene(arguments: &StudyArguments, context: &Context) -> Result<(), CliError> {
    let part: Part = arguments.shard.parse().map_err(option)?;
    let requirements = arguments.judging.limits.requirements(EXAMPLE)?;
    let (Some(scene), Some(out)) = (&arguments.scene, &arguments.out) else {
        return Err(invalid(
            "a scene and --out are required".to_owned(),
            "catoptric study scene.toml --out study",
        ));
    };
    let axes: Vec<Axis> = arguments
        .axis
        .iter()
        .map(|text| text.parse().map_err(option))
        .collect::<Result<_, _>>()?;
    let load = |settings: &[String]| match Scene::load_with(scene, settings) {
        Ok(scene) => Ok(scene.resolved().clone()),
        Err(Error::Scene(error)) => Err(StudyError::Scene(error)),
        Err(error) => Err(StudyError::Invalid {
            message: error.to_string(),
            help: error.help().unwrap_or_default(),
        }),
    };
    let study = Study {
        cells: grid(&axes, &arguments.set, load).map_err(option)?,
        seeds: arguments.seeds,
        contestants: contestants(arguments)?,
        stop: Stop::default(),
    };
    let (place, junit) = arguments.judging.places(out, Some(scene))?;
    let summary = study_into(&study, part, arguments.elements, place, &context.control())?;
    show(&summary, out, arguments.json)?;
    judge(&summary, &requirements, out, junit.as_ref())
}

/// An example of a requirement.
const EXAMPLE: &str = "anees<=1.5";

/// Fails if a contestant has no result, or does not meet a requirement.
fn judge(
    summary: &Summary,
    requirements: &[Requirement],
    out: &Path,
    junit: Option<&Output>,
) -> Result<(), CliError> {
    let reasons = summary.reasons(requirements).map_err(|e| unknown(&e))?;
    let suite = Suite::of_study(&out.display().to_string(), summary, &reasons);
    write_junit(junit, &[suite])?;
    let words: Vec<String> = reasons.into_iter().map(|(_, why)| why).collect();
    let verdict = if words.is_empty() {
        Verdict::Pass
    } else {
        Verdict::Fail
    };
    conclude(verdict, &words)
}

/// The contestants, each under a different name.
fn contestants(arguments: &StudyArguments) -> Result<Vec<Contestant>, CliError> {
    let mut all: Vec<Contestant> = Vec::new();
    for name in &arguments.methods {
        let contestant = Contestant::named(name)
            .map_err(|error| CliError::invalid(format!("--methods: {error}, and oracle"), error.help()))?;
        if let (Contestant::Method(method), true) = (&contestant, arguments.uncorrected) {
            let uncorrected = Contestant::Uncorrected(*method);
            all.extend([contestant, uncorrected]);
        } else {
            all.push(contestant);
        }
    }
    for text in &arguments.program {
        let program = Program::parse(text, arguments.program_timeout_s).map_err(|why| {
            invalid(
                format!("--program {text}: {why}"),
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

/// Prints the summary.
fn show(summary: &Summary, out: &Path, json: bool) -> Result<(), CliError> {
    if json {
        return print_json(summary);
    }
    let number = |v: f64, decimals: usize| {
        if v.is_finite() {
            format!("{v:.decimals$}")
        } else {
            "–".to_owned()
        }
    };
    let mut text = format!(
        "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9} {:>7}  {}\n",
        "method", "runs", "rms (°)", "limit (°)", "efficiency", "ANEES", "95 %", "ms", "verdict"
    );
    let mut axes = None;
    for m in &summary.methods {
        if !m.axes.is_empty() && axes != Some(&m.axes) {
            let values: Vec<String> = m.axes.iter().map(|(k, v)| format!("{k} = {v}")).collect();
            text += &format!("{}\n", values.join(", "));
            axes = Some(&m.axes);
        }
        let verdict = match &m.failure {
            Some(failure) if m.failed == m.runs => format!("{}: {failure}", m.verdict),
            Some(failure) => format!("{}; {} failed: {failure}", m.verdict, m.failed),
            None => m.verdict.clone(),
        };
        text += &format!(
            "{:<20} {:>6} {:>10} {:>10} {:>11} {:>7} {:>9} {:>7}  {verdict}\n",
            m.method,
            m.runs,
            number(m.per_axis_rms_deg, 4),
            number(m.crlb_per_axis_deg, 4),
            number(m.efficiency, 3),
            number(m.anees, 2),
            number(m.coverage_95, 3),
            m.ms_per_calibration.map_or("–".to_owned(), |ms| number(ms, 1)),
        );
    }
    print(&format!(
        "{text}wrote {} and, next to it, {STUDY_PAGE} and the tables\n",
        quoted(&out.join(RESULT))
    ))
}
