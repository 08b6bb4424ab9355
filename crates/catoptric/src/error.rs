//! What can keep a verb from its result: one error for the whole library.

use catoptric_assess::apply::ApplyError;
use catoptric_assess::study::StudyError;
use catoptric_calib::CalibError;
use catoptric_files::IoError;
use catoptric_files::scene::SceneErrors;
use catoptric_model::{Stopped, Unreadable};
use catoptric_sim::SimError;

/// Why a verb has no result.
///
/// A calibration that is not good enough is no error but a [`Verdict`](crate::Verdict); an element that cannot be
/// solved is data, a [`Status`](crate::model::Status) with its reason.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A scene that cannot be read, or everything that is wrong with it, with line and column.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// A valid scene that still cannot be set up.
    #[error(transparent)]
    Setup(#[from] SimError),
    /// A file that cannot be read, written or understood.
    #[error(transparent)]
    File(#[from] IoError),
    /// A dataset that cannot be calibrated, or a request that no calibration can meet.
    #[error("cannot calibrate: {0}")]
    Calibration(CalibError),
    /// A dataset that cannot be turned into the cloud asked for.
    #[error(transparent)]
    Apply(ApplyError),
    /// Readings that a dataset's recording gives no more.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// A study that cannot be begun, gone on with or merged.
    #[error(transparent)]
    Study(StudyError),
    /// Goals, parameters or requirements that a search cannot use.
    #[cfg(feature = "design")]
    #[error(transparent)]
    Optimize(#[from] catoptric_design::optimize::OptimizeError),
    /// A requirement that no figure answers to.
    #[cfg(feature = "design")]
    #[error(transparent)]
    Requirement(#[from] catoptric_design::layout::RequirementError),
    /// A request that makes no sense as it was given.
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
    /// The system gave no threads.
    #[error("no threads to compute with: {0}")]
    Threads(String),
}

impl Error {
    /// A request that makes no sense as it was given.
    pub(crate) fn invalid(message: impl Into<String>, help: Option<&str>) -> Self {
        Self::Invalid {
            message: message.into(),
            help: help.map(str::to_owned),
        }
    }

    /// What to do about it, where that is known.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Invalid { help, .. } => help.clone(),
            Self::Study(StudyError::Invalid { help, .. }) => Some(help.clone()),
            Self::Calibration(error) => error.help(),
            #[cfg(feature = "design")]
            Self::Optimize(error) => error.help(),
            #[cfg(feature = "design")]
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

    /// What the program `catoptric` exits with: 2 for invalid input, 3 where reading or writing failed, 130 where it
    /// was stopped.
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
            Self::Optimize(_) | Self::Requirement(_) => 2,
            Self::Scene(SceneErrors::Invalid(_))
            | Self::Setup(_)
            | Self::Calibration(_)
            | Self::Apply(_)
            | Self::Invalid { .. } => 2,
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
            StudyError::File(error) => Self::File(error),
            StudyError::Setup(error) => Self::Setup(error),
            other => Self::Study(other),
        }
    }
}
