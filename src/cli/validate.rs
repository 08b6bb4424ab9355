//! `catoptric validate`: checks that a calibration, from any source, is well formed and physically plausible.

use super::calibrate::summary;
use super::error::CliError;
use super::output::{counted, print, quoted};
use catoptric::validate::Severity;
use catoptric::{Calibration, files, validate};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The calibration.
    calibration: PathBuf,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.calibration;
    let calibration: Calibration = files::read_json(path)?;
    let problems = validate(&calibration);
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    if errors > 0 {
        let list: Vec<String> = problems.iter().map(|p| format!("  {p}")).collect();
        let message = format!(
            "{}: {}\n{}",
            path.display(),
            counted(errors, "error"),
            list.join("\n")
        );
        return Err(CliError::invalid(message, None));
    }
    let mut text = String::new();
    for problem in &problems {
        text.push_str(&format!("{problem}\n"));
    }
    text.push_str(&format!("ok: {}: {}\n", path.display(), summary(&calibration)));
    text.push_str(&format!("next: catoptric score DATASET {}\n", quoted(path)));
    print(&text)
}
