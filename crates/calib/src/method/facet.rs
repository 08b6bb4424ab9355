//! `facet`: one rigid plane per facet, facets that share no board each by themselves, the mounting as step 5 found it.
//! Covariances are those of the facet's solution ([`crate::joint`]).

use super::row::{Row, Scope};
use crate::joint::Extent;

pub(super) const ROW: Row = Row {
    name: "facet",
    about: "One plane per facet, each facet by itself",
    scope: Scope::Together(Extent::EachFacet),
};
