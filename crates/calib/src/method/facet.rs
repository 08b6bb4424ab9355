//! `facet`: one plane per facet, each set of facets that share boards separately, the mounting from step 5. Beams may
//! deviate from their plane by as much as all facets together show. Covariances are those of the facet's solution
//! ([`crate::joint`]).

use super::row::{Row, Scope};
use crate::joint::Extent;

pub(super) const ROW: Row = Row {
    name: "facet",
    about: "One plane per facet, each facet separately",
    scope: Scope::Together(Extent::EachFacet),
};
