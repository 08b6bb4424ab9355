//! What every verb receives besides its own arguments: the global options, and what stops a run and reports on it.

use super::error::CliError;
use super::progress::Reporter;
use catoptric::files::names::printable;
use catoptric::files::unverified_truth;
use catoptric::sim::Truth;
use catoptric::{Control, Damage, Dataset, Stop, read_dataset_with, read_reference};
use clap::{ArgAction, Args};
use std::ffi::OsString;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;

/// Options of every verb.
#[derive(Debug, Clone, Args)]
pub(super) struct Global {
    /// Number of threads; all of the machine by default. Affects speed, never results.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    pub(super) threads: Option<u16>,
    /// Print more on stderr.
    #[arg(short, long, global = true, action = ArgAction::Count)]
    pub(super) verbose: u8,
    /// Print nothing but errors on stderr.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(super) quiet: bool,
}

/// How a dataset is read.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(crate) struct Reading {
    /// Leave out the damaged stretches of a recording, with the reason, and use the rest.
    #[arg(long)]
    partial: bool,
}

/// What every verb receives in addition to its own arguments.
pub(crate) struct Context {
    pub(super) global: Global,
    /// The command line as given, without the program's name.
    pub(super) given: Vec<OsString>,
    pub(super) stop: Stop,
    pub(super) reporter: Arc<Reporter>,
}

impl Context {
    /// The control of a long verb: it stops on Ctrl-C and reports progress on stderr.
    pub(super) fn control(&self) -> Control {
        let reporter = self.reporter.clone();
        Control {
            stop: self.stop.clone(),
            progress: Some(Arc::new(move |progress| reporter.report(progress))),
            threads: None,
        }
    }

    /// Reads a dataset, and says what was unusual in its recording. Ctrl-C stops that, and every later pass over its
    /// readings.
    pub(super) fn read_dataset(&self, folder: &Path, reading: Reading) -> Result<Dataset, CliError> {
        let damage = if reading.partial {
            Damage::LeftOut
        } else {
            Damage::Refused
        };
        let dataset = read_dataset_with(folder, damage, &self.control())?;
        for warning in &dataset.warnings {
            self.say(&format!("warning: {warning}"));
        }
        Ok(dataset)
    }

    /// Reads the truth to judge by, and says if nothing shows that it is the one that was written.
    pub(super) fn read_reference(&self, dataset: &Path, blind: bool) -> Result<Option<Truth>, CliError> {
        let truth = read_reference(dataset, blind)?;
        if truth.is_some()
            && let Some(warning) = unverified_truth(dataset)?
        {
            self.say(&format!("warning: {warning}"));
        }
        Ok(truth)
    }

    /// Prints what of a scene is probably not meant.
    pub(super) fn warn_of(&self, scene: &catoptric::Scene) {
        for warning in scene.warnings() {
            self.say(&format!("warning: {}: {warning}", scene.name()));
        }
    }

    /// Returns an error once Ctrl-C has been pressed.
    pub(super) fn check(&self) -> Result<(), CliError> {
        Ok(self.stop.check().map_err(catoptric::Error::from)?)
    }

    /// Prints a line on stderr, unless `--quiet` is set.
    pub(super) fn say(&self, text: &str) {
        if !self.global.quiet {
            // If stderr is closed, there is nowhere left to report to.
            let _ = writeln!(anstream::stderr(), "{}", printable(text));
        }
    }

    /// Prints a line on stderr if `--verbose` is set.
    pub(super) fn detail(&self, text: &str) {
        if self.global.verbose > 0 {
            self.say(text);
        }
    }
}
