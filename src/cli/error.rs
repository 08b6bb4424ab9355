//! How a verb can end other than well, and what the shell is told.

use catoptric::Error;
use catoptric::files::IoError;
use catoptric::files::scene::SceneErrors;
use catoptric::sim::SimError;
use std::io::{IsTerminal, Write};

/// Why a verb did not succeed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// The library has no result.
    #[error(transparent)]
    Library(#[from] Error),
    /// The verdict is "not good enough"; what it is about has been printed.
    #[error("{0}")]
    Verdict(String),
    /// Standard output refused.
    #[error("{0}")]
    Output(std::io::Error),
    /// Nobody reads standard output any more: no error at all.
    #[error("the reader of standard output has gone")]
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
    /// An argument that makes no sense as it was given.
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
            Self::Output(_) => 3,
            Self::Library(error) => error.exit_code(),
        }
    }

    /// Tells the person on stderr and the shell by the exit code.
    pub(crate) fn report(&self) -> u8 {
        let mut stderr = anstream::stderr();
        // With stderr closed there is nobody left to read it.
        let _ = match self {
            Self::ClosedPipe => Ok(()),
            Self::Library(Error::Scene(SceneErrors::Invalid(problems))) => {
                writeln!(stderr, "{}", problems.render(std::io::stderr().is_terminal()))
            }
            Self::Library(Error::Stopped(_)) => {
                writeln!(stderr, "interrupted; nothing half-written was left behind")
            }
            Self::Verdict(_) => writeln!(stderr, "{self}"),
            Self::Library(error) => match help(error) {
                Some(help) => writeln!(stderr, "error: {error}\nhelp: {help}"),
                None => writeln!(stderr, "error: {error}"),
            },
            Self::Output(error) => writeln!(stderr, "error: {error}"),
        };
        self.exit_code()
    }
}

/// What to do about an error, in the words of the command line.
fn help(error: &Error) -> Option<String> {
    match error {
        Error::Setup(SimError::Placement { .. }) => {
            Some("make the room larger, the board smaller, or experiment.range_m shorter".to_owned())
        }
        Error::File(IoError::Exists { .. }) => Some("give --replace, or another --out".to_owned()),
        other => other.help(),
    }
}
