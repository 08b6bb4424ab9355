//! Why a verb can fail: one error type for the whole library, with help texts and exit codes.

use catoptric_assess::apply::ApplyError;
use catoptric_assess::study::StudyError;
use catoptric_calib::CalibError;
use catoptric_files::IoError;
use catoptric_files::scene::SceneErrors;
use catoptric_model::{Stopped, Unreadable};
use catoptric_sim::SimError;

/// Why a verb has no result.
///
/// A calibration that is not good enough is not an error but a [`Verdict`](crate::Verdict); an element that cannot be
/// solved is data, a [`Status`](crate::model::Status) with a reason.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene cannot be read or is invalid; lists every problem with line and column.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// A valid scene cannot be set up.
    #[error(transparent)]
    Setup(SimError),
    /// A file cannot be read, written or parsed.
    #[error(transparent)]
    File(IoError),
    /// A dataset cannot be calibrated, or no calibration can meet the request.
    #[error("cannot calibrate: {0}")]
    Calibration(CalibError),
    /// A dataset cannot be turned into the requested point cloud.
    #[error(transparent)]
    Apply(ApplyError),
    /// Readings that a dataset's recording gives no more.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A study that cannot be begun, gone on with or merged.
    #[error(transparent)]
    Study(StudyError),
    /// A search cannot use the given goals, parameters or requirements.
    #[cfg(feature = "design")]
    #[error(transparent)]
    Optimize(#[from] catoptric_design::optimize::OptimizeError),
    /// A requirement names no existing figure.
    #[error(transparent)]
    Requirement(#[from] catoptric_assess::RequirementError),
    /// An invalid request.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: Option<String>,
    },
    /// The work was stopped through [`Control::stop`](crate::Control::stop).
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The system could not start the threads.
    #[error("cannot start threads: {0}")]
    Threads(String),
}

impl Error {
    /// Creates an error for an invalid request.
    pub(crate) fn invalid(message: impl Into<String>, help: Option<&str>) -> Self {
        Self::Invalid {
            message: message.into(),
            help: help.map(str::to_owned),
        }
    }

    /// What to do about it, if known.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Invalid { help, .. } => help.clone(),
            Self::Study(StudyError::Invalid { help, .. }) => Some(help.clone()),
            Self::Calibration(error) => error.help(),
            #[cfg(feature = "design")]
            Self::Optimize(error) => error.help(),
            Self::Requirement(error) => error.help(),
            Self::Scene(_)
            | Self::Setup(_)
            | Self::File(_)
            | Self::Apply(_)
            | Self::Unreadable(_)
            | Self::Study(_)
            | Self::Stopped(_)
            | Self::Threads(_) => None,
        }
    }

    /// Exit code of the program `catoptric`: 2 for invalid input, 3 if reading or writing failed, 130 if it was stopped.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Stopped(_) => 130,
            Self::File(error) => error.exit_code(),
            Self::Scene(SceneErrors::Mesh { source, .. }) => source.exit_code(),
            Self::Scene(SceneErrors::Read { .. }) | Self::Unreadable(_) | Self::Threads(_) => 3,
            Self::Study(error) => error.exit_code(),
            #[cfg(feature = "design")]
            Self::Optimize(catoptric_design::optimize::OptimizeError::Search(_)) => 3,
            #[cfg(feature = "design")]
            Self::Optimize(_) => 2,
            Self::Scene(SceneErrors::Invalid(_))
            | Self::Requirement(_)
            | Self::Setup(_)
            | Self::Calibration(_)
            | Self::Apply(_)
            | Self::Invalid { .. } => 2,
        }
    }
}

impl From<SimError> for Error {
    fn from(error: SimError) -> Self {
        match error {
            SimError::Stopped(stopped) => Self::Stopped(stopped),
            other => Self::Setup(other),
        }
    }
}

impl From<IoError> for Error {
    fn from(error: IoError) -> Self {
        match error {
            IoError::Stopped(stopped) => Self::Stopped(stopped),
            other => Self::File(other),
        }
    }
}

impl From<CalibError> for Error {
    fn from(error: CalibError) -> Self {
        match error {
            CalibError::Stopped(stopped) => Self::Stopped(stopped),
            CalibError::Unreadable(error) => Self::Unreadable(error),
            other => Self::Calibration(other),
        }
    }
}

impl From<ApplyError> for Error {
    fn from(error: ApplyError) -> Self {
        match error {
            ApplyError::Unreadable(error) => Self::Unreadable(error),
            other => Self::Apply(other),
        }
    }
}

impl From<StudyError> for Error {
    fn from(error: StudyError) -> Self {
        match error {
            StudyError::Stopped(stopped) => Self::Stopped(stopped),
            StudyError::File(error) => error.into(),
            StudyError::Setup(error) => error.into(),
            other => Self::Study(other),
        }
    }
}
