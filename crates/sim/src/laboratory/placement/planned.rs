//! A stretch as it is meant to be recorded.

use crate::error::SimError;
use crate::scene::Scene;
use catoptric_model::{Pose, PoseKind, TestNote};

/// A stretch as it is meant to be recorded.
#[derive(Debug, Clone)]
pub struct Planned {
    /// What it is for.
    pub kind: PoseKind,
    /// Scans.
    pub scans: usize,
    /// Facet in whose fan the board stands, by its index.
    pub facet: Option<usize>,
    /// First and last beam it is set up for.
    pub beams: Option<[usize; 2]>,
    /// The board, by its index, and where it is meant to stand.
    pub board: Option<(usize, Pose)>,
    /// Whether it is put exactly there.
    pub exact: bool,
    /// What is tested of the bare sensor.
    pub test: Option<TestNote>,
    /// The flight, by its index.
    pub flight: Option<usize>,
}

/// A board that fits nowhere.
pub(super) fn no_place_before(scene: &Scene, board: usize, target: String, reason: String) -> SimError {
    SimError::Placement {
        board: scene.board[board].name.clone(),
        target,
        reason,
    }
}
