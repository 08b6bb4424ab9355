//! What the verbs that judge have in common: limits on figures, the JUnit file, and exit codes that follow from verdicts.

use super::error::CliError;
use super::outputs::{Outputs, Replacing};
use catoptric::files::Content;
use catoptric::junit::{self, Case, Ended, Suite};
use catoptric::requirement::{Requirement, RequirementError};
use catoptric::{Calibration, Error, Output, Rules, Verdict, files, read_calibration};
use clap::Args;
use std::path::{Path, PathBuf};

/// Limits on figures.
#[derive(Debug, Args)]
pub(crate) struct Limits {
    /// Fail (exit code 1) if a figure is below a value. May be given more than once.
    #[arg(long, value_name = "FIGURE=X")]
    min: Vec<String>,
    /// Fail (exit code 1) if a figure is above a value. May be given more than once.
    #[arg(long, value_name = "FIGURE=X")]
    max: Vec<String>,
    /// Fail (exit code 1) unless a figure meets a limit, in quotes: 'coverage_95>=0.8'. May be given more than once.
    #[arg(long, value_name = "'FIGURE>=X'")]
    require: Vec<String>,
}

impl Limits {
    /// Parses all of them; `example` is a requirement that the verb knows.
    pub(crate) fn requirements(&self, example: &str) -> Result<Vec<Requirement>, CliError> {
        type Parse = fn(&str) -> Result<Requirement, RequirementError>;
        let options: [(&str, &Vec<String>, Parse); 3] = [
            ("--min", &self.min, Requirement::minimum),
            ("--max", &self.max, Requirement::maximum),
            ("--require", &self.require, Requirement::parse),
        ];
        let mut all = Vec::new();
        for (option, texts, parse) in options {
            for text in texts {
                let parsed = parse(text).map_err(|error| {
                    let help = match option {
                        "--require" => format!("--require '{example}'"),
                        option => format!("{option} {}", example.replace(['<', '>'], "")),
                    };
                    CliError::invalid(format!("{option}: {error}"), help)
                })?;
                all.push(parsed);
            }
        }
        Ok(all)
    }
}

/// The help of `--require`, with a requirement that the verb knows.
pub(crate) fn require_help(example: &str) -> String {
    format!(
        "Fail (exit code 1) unless a figure meets a limit, in quotes: '{example}'. May be given more than once"
    )
}

/// The error for a requirement that names no figure.
pub(crate) fn unknown(error: &RequirementError) -> CliError {
    CliError::invalid(format!("a limit: {error}"), error.help())
}

/// The rules of `score` and `compare`.
#[derive(Debug, Args)]
pub(crate) struct Judging {
    /// Share of the elements that the boards determine which must be solved, 0.9 unless given; on blind data, and only if
    /// given, of those that the calibration calls deflected.
    #[arg(long, value_name = "SHARE", value_parser = share)]
    min_solved: Option<f64>,
    #[command(flatten)]
    limits: Limits,
    /// Judge by boards and walls alone, as if there were no truth.
    #[arg(long)]
    pub(crate) blind: bool,
    /// Also write the verdict as JUnit XML.
    #[arg(long, value_name = "FILE")]
    pub(crate) junit: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
}

fn share(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.0..=1.0).contains(&value) => Ok(value),
        _ => Err("must be a number from 0 to 1".to_owned()),
    }
}

impl Judging {
    pub(crate) fn rules(&self) -> Result<Rules, CliError> {
        Ok(Rules {
            min_solved: self.min_solved,
            requirements: self.limits.requirements("coverage_95>=0.8")?,
        })
    }

    /// The place of the JUnit file, if one is asked for.
    pub(crate) fn place(&self, calibrations: &[PathBuf]) -> Result<Option<Output>, CliError> {
        junit_place(self.junit.as_ref(), &self.replacing.outputs(calibrations))
    }

    /// Reads a calibration; one that is not valid is reported in the JUnit file, too.
    pub(crate) fn read(&self, path: &Path, junit: Option<&Output>) -> Result<Calibration, CliError> {
        read_calibration(path).map_err(|error| {
            let error = Error::from(error);
            match (junit, error.exit_code()) {
                (Some(junit), 2) => match write_junit(Some(junit), &[unread(path, &error)]) {
                    Ok(()) => error.into(),
                    Err(error) => error,
                },
                _ => error.into(),
            }
        })
    }
}

/// The suite of a file that is not a calibration.
pub(crate) fn unread(path: &Path, error: &Error) -> Suite {
    Suite {
        name: path.display().to_string(),
        verdict: Verdict::Invalid.word().to_owned(),
        cases: vec![Case {
            name: "valid".to_owned(),
            ended: Ended::Invalid(error.to_string()),
        }],
    }
}

/// The place of the JUnit file, if one is asked for; refused before any work is done.
pub(crate) fn junit_place(path: Option<&PathBuf>, outputs: &Outputs) -> Result<Option<Output>, CliError> {
    path.map(|path| outputs.file(path, &Content::Junit)).transpose()
}

/// Writes the JUnit file if one is asked for.
pub(crate) fn write_junit(out: Option<&Output>, suites: &[Suite]) -> Result<(), CliError> {
    match out {
        Some(out) => Ok(files::write_file(out.clone(), junit::to_xml(suites).as_bytes())?),
        None => Ok(()),
    }
}

/// The error of a verdict, with one line for each reason; none if it is good enough.
pub(crate) fn conclude(verdict: Verdict, reasons: &[String]) -> Result<(), CliError> {
    let list = || reasons.iter().map(|why| format!("\n  {why}")).collect::<String>();
    match verdict {
        Verdict::Pass | Verdict::Blind => Ok(()),
        Verdict::Fail | Verdict::NotJudged => Err(CliError::Verdict(format!("not good enough:{}", list()))),
        Verdict::Invalid => Err(CliError::Invalid(format!("not valid:{}", list()))),
    }
}
