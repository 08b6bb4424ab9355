//! Errors that stop a simulation.

use catoptric_model::{ScanError, Stopped};

/// Why a scene cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// The caller stopped the work.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// A facet whose description spans no mirror.
    #[error("facet {name:?} has no shape: {reason}")]
    Facet {
        /// The facet.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A color that is not defined.
    #[error("color {name:?} is not defined; known: {known}")]
    UnknownColor {
        /// The name used.
        name: String,
        /// The known names.
        known: String,
    },
    /// A name that a pose or a test refers to and that the scene does not contain.
    #[error("{by} refers to {what}, which the scene does not contain")]
    UnknownName {
        /// What refers to it.
        by: String,
        /// What it refers to.
        what: String,
    },
    /// Fewer than three markers, or markers on one line: they do not determine a pose.
    #[error("the markers of {body:?} do not span a plane")]
    Markers {
        /// The body.
        body: String,
    },
    /// No space in the room for a board where the procedure needs one.
    #[error("no room for board {board:?} in front of {target}: {reason}")]
    Placement {
        /// The board.
        board: String,
        /// What it should be in front of.
        target: String,
        /// Why it does not fit anywhere.
        reason: String,
    },
    /// A surface of the room whose description spans no surface.
    #[error("surface {name:?} of the room has no shape: {reason}")]
    Surface {
        /// The surface.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A mesh that has not been read.
    #[error("the mesh {file:?} has not been read")]
    Mesh {
        /// Its file, as the scene names it.
        file: String,
    },
    /// A flight with fewer than two waypoints, or with times that do not increase.
    #[error("flight {name:?} goes nowhere: it needs at least two waypoints with increasing times")]
    Flight {
        /// The flight.
        name: String,
    },
    /// A mishap that is impossible.
    #[error("a mishap in pose {pose}: {what}")]
    Mishap {
        /// Number of the pose.
        pose: usize,
        /// Why it is impossible.
        what: String,
    },
    /// Patterns that have not been expanded into facets.
    #[error("the scene's patterns have not been expanded into facets")]
    Patterns,
    /// A scanner that cannot scan as the scene says.
    #[error("scanner.custom: {0}")]
    Scanner(#[from] ScanError),
    /// A scene to trace rays in or to look at mirrors, and no more.
    #[error(
        "the scene has no laboratory: recording needs a [superstructure] with markers, and either room.size_m and a \
         board, or a [[flight]]; this scene can be checked, traced, exported and looked at by `layout`"
    )]
    NoLaboratory,
}
