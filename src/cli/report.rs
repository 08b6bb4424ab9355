//! `catoptric report`: writes one HTML page about calibrations and their scores.

use super::error::CliError;
use super::output::print;
use super::{Context, Reading};
use catoptric::apply::{CloudSketch, Lift};
use catoptric::report::MAX_POINTS;
use catoptric::{CloudFrame, Error, files, read_calibration_for, read_truth, report, score};
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
    /// The page to write.
    #[arg(long, value_name = "report.html")]
    out: PathBuf,
    #[command(flatten)]
    reading: Reading,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    let truth = read_truth(&arguments.dataset)?;
    let mut results = Vec::new();
    for path in &arguments.calibrations {
        context.check()?;
        let calibration = read_calibration_for(path, &dataset.session)?;
        let result = score(&dataset, &calibration, truth.as_ref()).map_err(Error::from)?;
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
    files::write_file(&arguments.out, html.as_bytes())?;
    print(&format!(
        "wrote {path}\nnext: open {path} in a browser\n",
        path = arguments.out.display()
    ))
}
