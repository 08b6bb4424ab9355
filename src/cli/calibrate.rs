//! `catoptric calibrate`: estimates a calibration from a dataset. The truth is never read.

use super::context::{Context, Reading};
use super::error::CliError;
use super::one_of::one_of;
use super::output::{counted, print, quoted};
use super::outputs::Replacing;
use catoptric::calib::{JacobianForm, Options};
use catoptric::files::Content;
use catoptric::model::Status;
use catoptric::{Calibration, Method, calibrate_with, read_characterization, write_json};
use clap::Args;
use std::path::PathBuf;
use std::time::Instant;

/// Arguments of `calibrate`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The dataset.
    dataset: PathBuf,
    /// How the angles of an element are estimated.
    #[arg(
        long,
        value_parser = one_of(&Method::ALL, Method::name, Method::about),
        default_value = Method::default().name()
    )]
    method: Method,
    /// The calibration to write.
    #[arg(long, value_name = "calibration.json")]
    out: PathBuf,
    /// Sensor errors found in step 1, as written by `characterize`, instead of the session's beliefs.
    #[arg(long, value_name = "characterization.json")]
    characterization: Option<PathBuf>,
    /// Also predict each board from the others (five-fold cross-validation) and report the errors (`joint` only).
    #[arg(long)]
    cross_validate: bool,
    /// How derivatives are formed; both end at the same answer.
    #[arg(
        long,
        value_parser = one_of(&JacobianForm::ALL, JacobianForm::name, JacobianForm::about),
        default_value = JacobianForm::default().name()
    )]
    jacobian: JacobianForm,
    #[command(flatten)]
    reading: Reading,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, context: &Context) -> Result<(), CliError> {
    let outputs = arguments.replacing.outputs(&arguments.characterization);
    let out = outputs.file(&arguments.out, &Content::Calibration)?;
    let mut dataset = context.read_dataset(&arguments.dataset, arguments.reading)?;
    context.check()?;
    if let Some(path) = &arguments.characterization {
        let found = read_characterization(path)?;
        dataset.session.believed = dataset.session.believed.after(&found);
    }
    let method = arguments.method;
    if arguments.cross_validate && !method.cross_validates() {
        let message = format!(
            "--cross-validate works with --method joint only, not with {}",
            method.name()
        );
        return Err(CliError::invalid(message, None));
    }
    let options = Options {
        jacobian: arguments.jacobian,
        cross_validation: arguments.cross_validate,
        ..Options::default()
    };
    let begin = Instant::now();
    let calibration = calibrate_with(&dataset, method, &options, &context.control())?;
    context.detail(&format!("calibrated in {:.2} s", begin.elapsed().as_secs_f64()));
    let known = |warning: &&String| !dataset.warnings.contains(warning);
    for warning in calibration.warnings.iter().filter(known) {
        context.say(&format!("warning: {warning}"));
    }
    write_json(out, &calibration)?;
    print(&format!(
        "wrote {}: {}\n{}next: catoptric score {} {}\n",
        arguments.out.display(),
        summary(&calibration),
        cross_validation(&calibration),
        quoted(&arguments.dataset),
        quoted(&arguments.out)
    ))?;
    let solved = calibration.beams.iter().any(|b| b.status == Status::Solved);
    // Without a mirror, no element has a direction to solve.
    if solved || dataset.session.facets.is_empty() {
        return Ok(());
    }
    Err(CliError::Verdict(format!(
        "not good enough: no element is solved{}",
        most_frequent(&calibration)
    )))
}

/// The most frequent reason why elements are not solved.
fn most_frequent(calibration: &Calibration) -> String {
    let abstentions = catoptric::score::words::abstentions(calibration);
    abstentions.first().map_or_else(String::new, |a| {
        format!(
            "; the most frequent reason: {} {} ({})",
            a.count, a.status, a.reason
        )
    })
}

/// How well the boards are predicted by the others; empty unless requested.
fn cross_validation(calibration: &Calibration) -> String {
    let held_out = calibration.assessment.as_ref().and_then(|a| a.held_out.as_ref());
    held_out.map_or_else(String::new, |h| {
        format!(
            "{} boards predicted by the others: off by {:.2} mm rms and {:.2} mm in the mean over {} readings; {:.2} mm rms is \
             expected\n",
            h.boards, h.rms_mm, h.mean_mm, h.means, h.expected_mm
        )
    })
}

/// "481 beams solved, 550 direct, …": how many elements have each status.
pub(crate) fn summary(calibration: &Calibration) -> String {
    let count = |status| calibration.beams.iter().filter(|b| b.status == status).count();
    let mut parts = vec![format!("{} solved", counted(count(Status::Solved), "beam"))];
    for status in Status::ALL {
        if status != Status::Solved && count(status) > 0 {
            parts.push(format!("{} {}", count(status), status.word().replace('_', " ")));
        }
    }
    parts.join(", ")
}
