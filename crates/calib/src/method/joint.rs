//! `joint`: facets, mounting, boards, drifts and biases are estimated at once from all boards, those before undeflected
//! beams too; a beam may depart from its facet's plane by as much as the readings say. Covariances are those of the joint
//! solution ([`crate::joint`]).

use super::row::{Row, Scope};
use crate::joint::Extent;

pub(super) const ROW: Row = Row {
    name: "joint",
    about: "Facets, mounting, boards, drifts and biases at once, beams free to depart from their facet's plane",
    scope: Scope::Together(Extent::Everything),
};
