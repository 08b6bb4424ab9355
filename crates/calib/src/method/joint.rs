//! `joint`: estimates facets, mounting, boards, drifts and biases at once from all boards, including those in front of
//! undeflected beams. A beam may deviate from its facet's plane by as much as the readings show. Covariances are those
//! of the joint solution ([`crate::joint`]).

use super::row::{Row, Scope};
use crate::joint::Extent;

pub(super) const ROW: Row = Row {
    name: "joint",
    about: "Facets, mounting, boards, drifts and biases at once; beams may deviate from their facet's plane",
    scope: Scope::Together(Extent::Everything),
};
