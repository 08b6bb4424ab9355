//! `catoptric characterize`: measures the range errors of the bare sensor (step 1), from a dataset or a scene.

use super::context::{Context, Reading};
use super::error::CliError;
use super::output::{print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::files::Content;
use catoptric::model::{Characterization, RangeBias};
use catoptric::{Error, Scene, characterize, files, read_truth, report, simulate_with, tables};
use clap::Args;
use std::path::{Path, PathBuf};

/// Arguments of `characterize`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// A dataset, recorded or simulated, or a scene to simulate first.
    #[arg(value_name = "DATASET|SCENE")]
    input: PathBuf,
    /// The characterization to write; a page with its tables and pictures is written next to it, with the extension
    /// .html.
    #[arg(long, value_name = "characterization.json")]
    out: PathBuf,
    /// Seed of all random effects, instead of the scene's.
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Change a value of the scene first: experiment.scans_per_pose=20.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Print the characterization as JSON instead of tables.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let page = page_path(&arguments.out)?;
    let outputs = arguments.replacing.outputs([&arguments.input]);
    let places = [
        outputs.file(&arguments.out, &Content::Characterization)?,
        outputs.file(&page, &Content::Page)?,
    ];
    let (dataset, truth) = if arguments.input.is_dir() {
        if arguments.seed.is_some() || !arguments.set.is_empty() {
            let message = "--seed and --set change a scene; a dataset cannot be changed";
            return Err(CliError::invalid(message, None));
        }
        let truth = read_truth(&arguments.input)?;
        (context.read_dataset(&arguments.input, arguments.reading)?, truth)
    } else {
        let mut scene = Scene::load_with(&arguments.input, &arguments.set)?;
        if let Some(seed) = arguments.seed {
            scene = scene.with_seed(seed);
        }
        let (dataset, truth) = simulate_with(&scene, &context.control())?;
        (dataset, Some(truth))
    };
    let injected = truth.and_then(|t| injected(t.bias));
    context.check()?;
    let found = characterize(&dataset).map_err(|error| match error {
        Error::Calibration(error) => CliError::invalid(
            error.to_string(),
            "record boards in front of the bare sensor: [[experiment.test]] in a scene".to_owned(),
        ),
        other => other.into(),
    })?;
    context.check()?;
    let json = files::json::to_json(&arguments.out, &found)?;
    let html = report::characterization(&found, injected.as_ref()).into_bytes();
    let [to_json, to_page] = places;
    files::write_files(&[(to_json, json), (to_page, html)])?;
    if arguments.json {
        return print_json(&found);
    }
    print(&text(&found, injected.as_ref(), &arguments.out, &page))
}

/// Path of the page: next to the JSON file, which it must not overwrite.
fn page_path(out: &Path) -> Result<PathBuf, CliError> {
    let page = out.with_extension("html");
    if page == out {
        return Err(CliError::invalid(
            format!(
                "--out {}: the file is JSON; the page next to it has the extension .html",
                out.display()
            ),
            format!("--out {}", quoted(&out.with_extension("json"))),
        ));
    }
    Ok(page)
}

/// The biases of Eqs. (3)–(5) that a simulation injected; `None` if all errors came from the detector.
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
