//! Why a verb can fail, the message it prints and the exit code the shell receives.

use super::interrupt;
use catoptric::Error;
use catoptric::files::IoError;
use catoptric::files::names::printable;
use catoptric::files::scene::SceneErrors;
use catoptric::sim::SimError;
use std::io::{IsTerminal, Write};

/// Why a verb did not succeed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// The library returned an error.
    #[error(transparent)]
    Library(#[from] Error),
    /// The verdict is "not good enough"; the results have been printed already.
    #[error("{0}")]
    Verdict(String),
    /// The verdict is "invalid"; the results have been printed already.
    #[error("{0}")]
    Invalid(String),
    /// Writing to standard output failed.
    #[error("{0}")]
    Output(std::io::Error),
    /// The reader of standard output has closed it, which is not an error.
    #[error("standard output was closed by its reader")]
    ClosedPipe,
}

impl From<IoError> for CliError {
    fn from(error: IoError) -> Self {
        Self::Library(error.into())
    }
}

impl From<SceneErrors> for CliError {
    fn from(error: SceneErrors) -> Self {
        Self::Library(error.into())
    }
}

impl From<SimError> for CliError {
    fn from(error: SimError) -> Self {
        Self::Library(error.into())
    }
}

impl CliError {
    /// An invalid argument.
    pub(crate) fn invalid(message: impl Into<String>, help: impl Into<Option<String>>) -> Self {
        Self::Library(Error::Invalid {
            message: message.into(),
            help: help.into(),
        })
    }

    fn exit_code(&self) -> u8 {
        match self {
            Self::ClosedPipe => 0,
            Self::Verdict(_) => 1,
            Self::Invalid(_) => 2,
            Self::Output(_) => 3,
            Self::Library(Error::Stopped(_)) => interrupt::exit_code(),
            Self::Library(error) => error.exit_code(),
        }
    }

    /// Prints the error to stderr and returns the exit code.
    pub(crate) fn report(&self) -> u8 {
        let mut stderr = anstream::stderr();
        // If stderr is closed, there is nowhere left to report to.
        let _ = match self {
            Self::ClosedPipe => Ok(()),
            Self::Library(Error::Scene(SceneErrors::Invalid(problems))) => {
                writeln!(stderr, "{}", problems.render(std::io::stderr().is_terminal()))
            }
            Self::Library(Error::Stopped(_)) => {
                writeln!(
                    stderr,
                    "{}; no incomplete files were left behind",
                    interrupt::word()
                )
            }
            Self::Verdict(_) | Self::Invalid(_) => writeln!(stderr, "{}", printable(&self.to_string())),
            Self::Library(error) => {
                let text = match help(error) {
                    Some(help) => format!("error: {error}\nhelp: {help}"),
                    None => format!("error: {error}"),
                };
                writeln!(stderr, "{}", printable(&text))
            }
            Self::Output(error) => writeln!(stderr, "error: {error}"),
        };
        self.exit_code()
    }
}

/// What to do about an error, in terms of command-line options.
fn help(error: &Error) -> Option<String> {
    match error {
        Error::Setup(SimError::Placement { .. }) => {
            Some("use a larger room, a smaller board, or a shorter experiment.range_m".to_owned())
        }
        Error::File(IoError::Damaged { .. }) => {
            Some("--partial leaves out what is damaged and uses the rest".to_owned())
        }
        Error::File(IoError::Changed { path, .. }) if path.extension().is_some_and(|e| e == "mcap") => {
            Some("--partial uses what can be read of it nevertheless".to_owned())
        }
        Error::File(IoError::NoTruth { .. }) => Some("--blind judges by boards and walls alone".to_owned()),
        Error::File(IoError::Foreign { .. }) => Some("choose another --out".to_owned()),
        Error::File(IoError::Exists { .. }) => {
            Some("--replace replaces it; another --out leaves it as it is".to_owned())
        }
        other => other.help(),
    }
}
