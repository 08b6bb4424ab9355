//! `catoptric report`: writes one HTML page about calibrations and their scores.

use super::context::{Context, Reading};
use super::error::CliError;
use super::judging::conclude;
use super::output::print;
use super::outputs::Replacing;
use catoptric::apply::{CloudSketch, Lift};
use catoptric::files::Content;
use catoptric::report::MAX_POINTS;
use catoptric::{CloudFrame, Error, Verdict, files, read_calibration, report, score};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `report`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The dataset.
    dataset: PathBuf,
    /// The calibrations; the fans of the first one are drawn.
    #[arg(required = true)]
    calibrations: Vec<PathBuf>,
    /// Judge by boards and walls alone, as if there were no truth.
    #[arg(long)]
    blind: bool,
    /// The page to write.
    #[arg(long, value_name = "report.html")]
    out: PathBuf,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let outputs = arguments.replacing.outputs(&arguments.calibrations);
    let out = outputs.file(&arguments.out, &Content::Page)?;
    let dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    let truth = context.read_reference(&arguments.dataset, arguments.blind)?;
    let mut results = Vec::new();
    for path in &arguments.calibrations {
        context.check()?;
        let calibration = read_calibration(path)?;
        let result = score(&dataset, &calibration, truth.as_ref()).map_err(Error::from)?;
        if result.verdict == Verdict::Invalid {
            let reasons: Vec<String> = result
                .reasons()
                .iter()
                .map(|w| format!("{}: {w}", path.display()))
                .collect();
            return conclude(result.verdict, &reasons);
        }
        results.push((calibration, result));
    }
    let cloud = results
        .first()
        .map(|(calibration, _)| Lift::new(&dataset, calibration, None, CloudFrame::Room));
    let cloud = match cloud {
        Some(Ok(lift)) => Some(CloudSketch::of(&lift, MAX_POINTS).map_err(Error::from)?),
        Some(Err(error)) => {
            context.say(&format!("no cloud: {error}"));
            None
        }
        None => None,
    };
    let html = report(&dataset, truth.as_ref(), &results, cloud.as_ref());
    files::write_file(out, html.as_bytes())?;
    print(&format!(
        "wrote {path}\nnext: open {path} in a browser\n",
        path = arguments.out.display()
    ))
}
