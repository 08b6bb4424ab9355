//! What is solved together: facets, the boards that any of them sees, and the elements that read these.

use catoptric_model::Pose;
use nalgebra::{Point3, RowDVector, Unit, Vector3};

/// Own parameters of a board: drift, offset and two tilts of its plane.
pub(super) const BOARD_ERRORS: usize = 4;

/// Orders of the polynomial along the fan by which a facet's normal varies about its mean.
pub(super) const FIGURE_ORDERS: usize = 3;

/// Own parameters of a facet's figure: every order about two axes.
pub(super) const FIGURE: usize = 2 * FIGURE_ORDERS;

/// Own parameters of a facet: two tilts and the offset of its plane, then its figure.
pub(super) const FACET_PARAMETERS: usize = 3 + FIGURE;

/// Blocks of a facet's parameters: normal, offset, figure.
pub(super) const FACET_BLOCKS: usize = 3;

/// A board as tracked in one pose.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Board {
    /// Index of the stretch in the dataset, and the number of its pose.
    pub(super) pose: usize,
    pub(super) number: usize,
    /// Tracked pose of the board in the rig.
    pub(super) rig_from_board: Pose,
    /// The same of its face, in front by the board's thickness.
    pub(super) rig_from_face: Pose,
    pub(super) color: String,
    /// Markers in the board frame.
    pub(super) markers: Vec<Point3<f64>>,
}

/// Mean of an element's readings of one board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sight {
    /// Index of the board in its group.
    pub(super) board: usize,
    pub(super) mean: f64,
    /// Standard deviation of the error that no other reading shares, in meters.
    pub(super) sd: f64,
    pub(super) count: usize,
}

/// An element and its readings; without a facet it is an undeflected beam.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct JointElement {
    pub(super) beam: usize,
    pub(super) azimuth: f64,
    pub(super) u: Unit<Vector3<f64>>,
    /// Index of the facet in its group.
    pub(super) facet: Option<usize>,
    /// Position in the facet's fan: −1 at its first beam, 1 at its last.
    pub(super) along: f64,
    pub(super) sights: Vec<Sight>,
}

/// The result of step 3 for a facet: distances of some of its beams, which share one error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BareFacet {
    /// Direction and measured distance to the bare structure.
    pub(super) distances: Vec<(Unit<Vector3<f64>>, f64)>,
    pub(super) thickness: f64,
    /// Mean error per standard deviation of each common error, and 1σ of the error that the facet shares with no other.
    pub(super) common: RowDVector<f64>,
    pub(super) sd: f64,
}

/// A facet by its index in the session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Facet {
    pub(super) facet: usize,
    pub(super) bare: BareFacet,
}

/// Facets and all boards that any of them sees, or one board in front of undeflected beams.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Group {
    pub(super) facets: Vec<Facet>,
    pub(super) boards: Vec<Board>,
    pub(super) elements: Vec<JointElement>,
}

impl Group {
    /// Index of a board's first parameter among the group's own.
    pub(super) fn board_column(&self, board: usize) -> usize {
        self.facets.len() * FACET_PARAMETERS + board * BOARD_ERRORS
    }

    /// Number of own parameters.
    pub(super) fn own_dimension(&self) -> usize {
        self.board_column(self.boards.len())
    }
}
