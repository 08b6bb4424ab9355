//! A stretch as planned.

use crate::error::SimError;
use crate::scene::Scene;
use catoptric_model::{Pose, PoseKind, TestNote};

/// A stretch as planned.
#[derive(Debug, Clone)]
pub struct Planned {
    /// Kind of the stretch.
    pub kind: PoseKind,
    /// Number of scans.
    pub scans: usize,
    /// Index of the facet in whose fan the board is.
    pub facet: Option<usize>,
    /// First and last beam for which the board is set up.
    pub beams: Option<[usize; 2]>,
    /// Index of the board and its planned pose in the room.
    pub board: Option<(usize, Pose)>,
    /// Whether the board is placed exactly there.
    pub exact: bool,
    /// The test of the bare sensor that it belongs to.
    pub test: Option<TestNote>,
    /// Index of the flight.
    pub flight: Option<usize>,
}

/// The error for a board that fits nowhere.
pub(super) fn placement_error(scene: &Scene, board: usize, target: String, reason: String) -> SimError {
    SimError::Placement {
        board: scene.board[board].name.clone(),
        target,
        reason,
    }
}
