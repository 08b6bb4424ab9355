//! Why a study cannot be started, resumed or merged. A calibrator that fails is a result, not an error.

use catoptric_files::IoError;
use catoptric_files::scene::SceneErrors;
use catoptric_model::Stopped;
use catoptric_sim::SimError;

/// Why a study fails.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The request is invalid, or does not match the existing files.
    #[error("{message}")]
    Invalid {
        /// What is wrong.
        message: String,
        /// What to do about it.
        help: String,
    },
    /// A scene is invalid with the values of a cell.
    #[error(transparent)]
    Scene(#[from] SceneErrors),
    /// A scene cannot be set up.
    #[error(transparent)]
    Setup(#[from] SimError),
    /// A file cannot be read, written or parsed.
    #[error(transparent)]
    File(#[from] IoError),
    /// The study was stopped; finished experiments stay on disk, and the same request resumes from there.
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

    /// Exit code of a program that ends with this error: 2 for invalid input, 3 if reading or writing failed, 130 if it
    /// was stopped.
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
