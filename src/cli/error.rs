//! How a verb can end other than well, and what the shell is told.

use catoptric::calib::CalibError;
use catoptric::files::IoError;
use catoptric::files::scene::SceneErrors;
use catoptric::sim::SimError;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;

/// Why a verb did not succeed.
#[derive(Debug, thiserror::Error)]
pub(crate) enum CliError {
    /// The input is not what it should be.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: Option<String>,
    },
    /// There is no scene.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// The scene is valid and still cannot be set up.
    #[error("{0}")]
    Setup(#[from] SimError),
    /// A file that cannot be read, written or understood.
    #[error(transparent)]
    File(#[from] IoError),
    /// The dataset cannot be calibrated.
    #[error("cannot calibrate: {0}")]
    Calibration(#[from] CalibError),
    /// The verdict is "not good enough"; what it is about has been printed.
    #[error("{0}")]
    Verdict(String),
    /// Ctrl-C.
    #[error("interrupted; nothing half-written was left behind")]
    Interrupted,
    /// A file could not be written.
    #[error("cannot write {}: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// Standard output, or the machine, refused.
    #[error("{0}")]
    Output(std::io::Error),
    /// Nobody reads standard output any more: no error at all.
    #[error("the reader of standard output has gone")]
    ClosedPipe,
}

impl CliError {
    fn exit_code(&self) -> u8 {
        match self {
            Self::ClosedPipe => 0,
            Self::Verdict(_) => 1,
            Self::Calibration(_) => 2,
            Self::File(error) => error.exit_code(),
            Self::Interrupted => 130,
            Self::Invalid { .. } | Self::Setup(_) | Self::Scene(SceneErrors::Invalid(_)) => 2,
            Self::Scene(SceneErrors::Mesh { source, .. }) => source.exit_code(),
            Self::Scene(SceneErrors::Read { .. }) | Self::Write { .. } | Self::Output(_) => 3,
        }
    }

    /// Tells the person on stderr and the shell by the exit code.
    pub(crate) fn report(&self) -> u8 {
        let mut stderr = anstream::stderr();
        // With stderr closed there is nobody left to tell.
        let _ = match self {
            Self::ClosedPipe => Ok(()),
            Self::Scene(SceneErrors::Invalid(problems)) => {
                writeln!(stderr, "{}", problems.render(std::io::stderr().is_terminal()))
            }
            Self::Invalid {
                message,
                help: Some(help),
            } => writeln!(stderr, "error: {message}\nhelp: {help}"),
            Self::Setup(error @ SimError::Placement { .. }) => writeln!(
                stderr,
                "error: {error}\nhelp: make the room larger, the board smaller, or experiment.range_m shorter"
            ),
            Self::File(error @ IoError::Exists { .. }) => {
                writeln!(stderr, "error: {error}\nhelp: give --replace, or another --out")
            }
            Self::Verdict(_) | Self::Interrupted => writeln!(stderr, "{self}"),
            other => writeln!(stderr, "error: {other}"),
        };
        self.exit_code()
    }
}
