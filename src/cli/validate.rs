//! `catoptric validate`: checks that a calibration, from any source, is well formed and physically plausible.

use super::calibrate::summary;
use super::error::CliError;
use super::judging::{conclude, junit_place, unread, write_junit};
use super::output::{counted, print, print_json, quoted};
use super::outputs::Replacing;
use catoptric::junit::Suite;
use catoptric::validate::{Problem, Severity, validate_for};
use catoptric::{Calibration, Error, Verdict, files, validate};
use clap::Args;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Version of what `validate --json` prints.
const SCHEMA_VERSION: u32 = 1;

/// Arguments of `validate`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The calibration.
    calibration: PathBuf,
    /// Also check it for use with a dataset: its scanner and the names of its mirrors.
    #[arg(long, value_name = "DATASET")]
    dataset: Option<PathBuf>,
    /// Print the problems as JSON.
    #[arg(long)]
    json: bool,
    /// Also write them as JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.calibration;
    let junit = junit_place(arguments.junit.as_ref(), &arguments.replacing.outputs([path]))?;
    let junit = junit.as_ref();
    let calibration: Calibration = match files::read_calibration(path) {
        Ok(calibration) => calibration,
        Err(error) => {
            let error = Error::from(error);
            if error.exit_code() == 2 {
                write_junit(junit, &[unread(path, &error)])?;
            }
            return Err(error.into());
        }
    };
    let session = arguments
        .dataset
        .as_deref()
        .map(files::read_session)
        .transpose()?;
    let problems = match &session {
        Some(session) => validate_for(&calibration, session),
        None => validate(&calibration),
    };
    let name = path.display().to_string();
    write_junit(junit, &[Suite::of_problems(&name, &problems)])?;
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    let verdict = if errors > 0 {
        Verdict::Invalid
    } else {
        Verdict::Pass
    };
    if arguments.json {
        print_json(&json!({
            "schema_version": SCHEMA_VERSION,
            "verdict": verdict.word(),
            "problems": problems.iter().map(as_json).collect::<Vec<_>>(),
        }))?;
        let errors = problems.iter().filter(|p| p.severity == Severity::Error);
        return conclude(verdict, &errors.map(ToString::to_string).collect::<Vec<_>>());
    }
    if errors > 0 {
        return Err(invalid(path, &problems));
    }
    let mut text = String::new();
    for problem in &problems {
        text.push_str(&format!("{problem}\n"));
    }
    text.push_str(&format!("ok: {}: {}\n", path.display(), summary(&calibration)));
    text.push_str(&format!("next: catoptric score DATASET {}\n", quoted(path)));
    print(&text)
}

/// The error about a calibration with problems.
pub(super) fn invalid(path: &Path, problems: &[Problem]) -> CliError {
    let errors = problems.iter().filter(|p| p.severity == Severity::Error).count();
    let list: Vec<String> = problems.iter().map(|p| format!("  {p}")).collect();
    let message = format!(
        "{}: {}\n{}",
        path.display(),
        counted(errors, "error"),
        list.join("\n")
    );
    CliError::invalid(message, None)
}

fn as_json(problem: &Problem) -> serde_json::Value {
    let severity = match problem.severity {
        Severity::Warning => "warning",
        Severity::Error => "error",
    };
    json!({ "severity": severity, "key": problem.key, "beam": problem.beam, "message": problem.message })
}
