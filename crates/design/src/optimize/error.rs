//! Why a search failed, and what would correct it.

use super::goal::GoalError;
use crate::layout::RequirementError;
use catoptric_sim::SimError;

/// Why a search failed.
#[derive(Debug, thiserror::Error)]
pub enum OptimizeError {
    /// There is no parameter to vary.
    #[error("the scene has no parameter with both `low` and `high`")]
    NothingOpen,
    /// No parameter changes anything that is asked for.
    #[error("none of the scene's parameters changes a goal or a requirement")]
    NothingChanges,
    /// There is no goal.
    #[error("a search needs a goal")]
    NoGoal,
    /// A goal is invalid.
    #[error(transparent)]
    Goal(#[from] GoalError),
    /// A requirement is invalid.
    #[error(transparent)]
    Requirement(#[from] RequirementError),
    /// The scene cannot be set up.
    #[error(transparent)]
    Setup(#[from] SimError),
    /// The optimizer stopped with an error.
    #[error("the search ended early: {0}")]
    Search(String),
}

impl OptimizeError {
    /// Returns advice on how to correct it, where there is any.
    pub fn help(&self) -> Option<String> {
        match self {
            Self::Goal(GoalError::Unknown { help, .. } | GoalError::Figure { help, .. }) => {
                Some(help.clone())
            }
            Self::Requirement(error) => error.help(),
            Self::Goal(GoalError::Direction { .. } | GoalError::Directions)
            | Self::NothingOpen
            | Self::NothingChanges
            | Self::NoGoal
            | Self::Setup(_)
            | Self::Search(_) => None,
        }
    }
}
