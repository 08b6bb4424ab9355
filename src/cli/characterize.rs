//! `catoptric characterize`: what the bare sensor's ranges are off by (step 1), from a dataset or a scene.

use super::Context;
use super::error::CliError;
use super::files::read_truth;
use super::interrupt;
use super::output::{print, quoted};
use super::progress::Progress;
use catoptric::files::{self, scene};
use catoptric::model::{Characterization, Dataset, PoseRecord, RangeBias};
use catoptric::sim::Laboratory;
use catoptric::{calib, report, tables};
use clap::Args;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Arguments of `characterize`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A dataset, recorded or simulated, or a scene to be simulated first.
    #[arg(value_name = "DATASET|SCENE")]
    input: PathBuf,
    /// The characterization to write; a page with its tables and pictures is written beside it, with the ending .html.
    #[arg(long, value_name = "characterization.json")]
    out: PathBuf,
    /// Seed of every random draw, instead of the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the characterization as JSON instead of tables.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let page = page_path(&arguments.out)?;
    let (dataset, injected) = if arguments.input.is_dir() {
        if arguments.seed.is_some() || !arguments.set.is_empty() {
            return Err(CliError::Invalid {
                message: "--seed and --set change a scene; a dataset is what it is".to_owned(),
                help: None,
            });
        }
        let truth = read_truth(&arguments.input)?;
        (
            files::read_dataset(&arguments.input)?,
            truth.and_then(|t| injected(t.bias)),
        )
    } else {
        simulate(arguments, context)?
    };
    interrupt::check()?;
    let found = calib::characterize(&dataset).map_err(|error| CliError::Invalid {
        message: error.to_string(),
        help: Some("record boards before the bare sensor: [[experiment.test]] in a scene".to_owned()),
    })?;
    interrupt::check()?;
    files::write_json(&arguments.out, &found)?;
    files::write_file(
        &page,
        report::characterization(&found, injected.as_ref()).as_bytes(),
    )?;
    if arguments.json {
        let json = serde_json::to_string(&found).map_err(|e| CliError::Output(e.into()))?;
        return print(&format!("{json}\n"));
    }
    print(&text(&found, injected.as_ref(), &arguments.out, &page))
}

/// Where the page goes: beside the JSON file, which it must not be.
fn page_path(out: &Path) -> Result<PathBuf, CliError> {
    let page = out.with_extension("html");
    if page == out {
        return Err(CliError::Invalid {
            message: format!(
                "--out {}: the file is JSON, the page beside it ends in .html",
                out.display()
            ),
            help: Some(format!("--out {}", quoted(&out.with_extension("json")))),
        });
    }
    Ok(page)
}

/// Simulates a scene's experiment in memory, a few stretches at a time.
fn simulate(arguments: &Arguments, context: &Context) -> Result<(Dataset, Option<RangeBias>), CliError> {
    let mut scene = scene::load(&arguments.input, &arguments.set)?;
    scene.seed = arguments.seed.unwrap_or(scene.seed);
    let laboratory = Laboratory::new(&scene, scene.seed)?;
    let mut progress = Progress::new(context, "simulating", laboratory.stretches());
    let all: Vec<usize> = (0..laboratory.stretches()).collect();
    let mut poses = Vec::with_capacity(all.len());
    for window in all.chunks(rayon::current_num_threads()) {
        interrupt::check()?;
        let recorded: Vec<PoseRecord> = window
            .par_iter()
            .map(|number| laboratory.pose_record(*number))
            .collect::<Result<_, _>>()?;
        poses.extend(recorded);
        progress.advance(window.len());
    }
    let session = laboratory.session()?;
    let bias = laboratory.sensor().bias().clone();
    Ok((Dataset { session, poses }, injected(bias)))
}

/// The biases of Eqs. 3 to 5 that a simulation put in; none where the errors came from the detector alone.
fn injected(bias: RangeBias) -> Option<RangeBias> {
    Some(bias).filter(|bias| *bias != RangeBias::default())
}

fn text(found: &Characterization, injected: Option<&RangeBias>, out: &Path, page: &Path) -> String {
    let mut text = String::new();
    for table in tables::tables(found, injected) {
        text += &table.text();
        text.push('\n');
    }
    for open in &found.not_observed {
        let of = open.color.as_ref().map_or(String::new(), |c| format!(" of {c}"));
        text += &format!("not observed: {}{of}: {}\n", open.symbol, open.reason);
    }
    text + &format!(
        "wrote {} and {}\nnext: catoptric calibrate DATASET --characterization {} --out calibration.json\n",
        out.display(),
        page.display(),
        quoted(out)
    )
}
