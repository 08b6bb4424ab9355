//! What can keep a study from being begun, gone on with or merged. A calibrator that fails is a result.

use catoptric_files::IoError;
use catoptric_files::scene::SceneErrors;
use catoptric_model::Stopped;
use catoptric_sim::SimError;

/// Why there is no study.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// What was asked for makes no sense, or does not fit what is there.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: String,
    },
    /// A scene that is not valid with the values of a cell.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// A scene that cannot be set up.
    #[error(transparent)]
    Setup(#[from] SimError),
    /// A file that cannot be read, written or understood.
    #[error(transparent)]
    File(#[from] IoError),
    /// The study was stopped; what is on disk is kept, and the same request goes on from there.
    #[error(transparent)]
    Stopped(#[from] Stopped),
}

impl StudyError {
    pub(crate) fn invalid(message: impl Into<String>, help: &str) -> Self {
        Self::Invalid {
            message: message.into(),
            help: help.to_owned(),
        }
    }

    /// What a program that ends with this error reports to its caller: 2 for invalid input, 3 where reading or writing
    /// failed, 130 where it was stopped.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Invalid { .. } | Self::Setup(_) | Self::Scene(SceneErrors::Invalid(_)) => 2,
            Self::Scene(SceneErrors::Mesh { source, .. }) => source.exit_code(),
            Self::Scene(SceneErrors::Read { .. }) => 3,
            Self::File(error) => error.exit_code(),
            Self::Stopped(_) => 130,
        }
    }
}
