//! What is solved together: facets, the boards that any of them sees, and the elements that read them.

use catoptric_model::Pose;
use nalgebra::{Point3, RowDVector, Unit, Vector3};

/// Own parameters of a board: drift, offset and two tilts of its plane.
pub(super) const BOARD_ERRORS: usize = 4;

/// Orders of the polynomial along the fan by which a facet's normal departs from its mean.
pub(super) const FIGURE_ORDERS: usize = 3;

/// Own parameters of a facet's figure: every order about two axes.
pub(super) const FIGURE: usize = 2 * FIGURE_ORDERS;

/// Own parameters of a facet: two tilts and the offset of its plane, then its figure.
pub(super) const FACET_PARAMETERS: usize = 3 + FIGURE;

/// Blocks of a facet's parameters: normal, offset, figure.
pub(super) const FACET_BLOCKS: usize = 3;

/// A board as tracked, once for each pose.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Board {
    /// Index of the stretch in the dataset, and its number.
    pub(super) pose: usize,
    pub(super) number: usize,
    /// The board's place in the rig, as tracked.
    pub(super) rig_from_board: Pose,
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
    /// Standard deviation by what no other reading shares, in metres.
    pub(super) sd: f64,
    pub(super) count: usize,
}

/// An element and what it read; without a facet it is an undeflected beam.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) beam: usize,
    pub(super) azimuth: f64,
    pub(super) u: Unit<Vector3<f64>>,
    /// Index of the facet in its group.
    pub(super) facet: Option<usize>,
    /// Place along the facet's fan, −1 at its first beam and 1 at its last.
    pub(super) along: f64,
    pub(super) sights: Vec<Sight>,
}

/// What step 3 says of a facet: distances of some of its beams, all off by one error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BareFacet {
    /// Direction and measured distance to the bare structure.
    pub(super) distances: Vec<(Unit<Vector3<f64>>, f64)>,
    pub(super) thickness: f64,
    /// Mean error by one standard deviation of each of the common errors, and 1σ of what the facet shares with no other.
    pub(super) common: RowDVector<f64>,
    pub(super) sd: f64,
}

/// A facet by its index in the session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Facet {
    pub(super) facet: usize,
    pub(super) bare: BareFacet,
}

/// Facets, and all boards that any of them sees; or one board before undeflected beams.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Group {
    pub(super) facets: Vec<Facet>,
    pub(super) boards: Vec<Board>,
    pub(super) elements: Vec<Element>,
}

impl Group {
    /// Where the parameters of a board begin among the group's own.
    pub(super) fn board_column(&self, board: usize) -> usize {
        self.facets.len() * FACET_PARAMETERS + board * BOARD_ERRORS
    }

    /// Number of own parameters.
    pub(super) fn own_dimension(&self) -> usize {
        self.board_column(self.boards.len())
    }
}
