//! What can stop a simulation.

use catoptric_model::ScanError;

/// Why a scene cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SimError {
    /// A facet whose description spans no mirror.
    #[error("facet {name:?} has no shape: {reason}")]
    Facet {
        /// The facet.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A color that nobody defined.
    #[error("color {name:?} is not defined; there are {known}")]
    UnknownColor {
        /// The name used.
        name: String,
        /// The names there are.
        known: String,
    },
    /// Something that a pose or a test refers to and that the scene does not hold.
    #[error("{by} refers to {what}, which the scene does not hold")]
    UnknownName {
        /// What refers to it.
        by: String,
        /// What it refers to.
        what: String,
    },
    /// Three markers on a line or fewer fix no pose.
    #[error("the markers of {body:?} do not span a plane")]
    Markers {
        /// The body.
        body: String,
    },
    /// There is no place in the room for a board where the procedure needs one.
    #[error("no room for board {board:?} before {target}: {reason}")]
    Placement {
        /// The board.
        board: String,
        /// What it should stand before.
        target: String,
        /// Why it fits nowhere.
        reason: String,
    },
    /// A surface in the room whose description spans none.
    #[error("surface {name:?} of the room has no shape: {reason}")]
    Surface {
        /// The surface.
        name: String,
        /// What is wrong with it.
        reason: String,
    },
    /// A mesh that nobody has read.
    #[error("the mesh {file:?} has not been read")]
    Mesh {
        /// Its file, as the scene names it.
        file: String,
    },
    /// A flight with fewer than two waypoints, or with times that do not increase.
    #[error("flight {name:?} goes nowhere: it takes at least two waypoints whose times increase")]
    Flight {
        /// The flight.
        name: String,
    },
    /// A mishap that cannot happen.
    #[error("a mishap in pose {pose}: {what}")]
    Mishap {
        /// Number of the pose.
        pose: usize,
        /// Why it cannot.
        what: String,
    },
    /// Patterns that nobody has made facets of.
    #[error("the scene's patterns have not been worked out into facets")]
    Patterns,
    /// A scanner that cannot scan as the scene says.
    #[error("scanner.custom: {0}")]
    Scanner(#[from] ScanError),
    /// A scene to trace rays in, and no more.
    #[error(
        "the scene has no laboratory: recording takes a [superstructure] with markers, and either room.size_m and a \
         board or a facet, or a [[flight]]; this scene can be traced"
    )]
    NoLaboratory,
}
