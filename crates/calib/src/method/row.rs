//! What there is to say of a method.

use crate::element::solver::Solver;
use crate::joint::Extent;

/// One method.
pub(crate) struct Row {
    /// The word that files and commands use.
    pub(super) name: &'static str,
    /// What it is, in a line.
    pub(super) about: &'static str,
    /// What it needs, and how it solves.
    pub(super) scope: Scope,
}

/// What is solved at once.
pub(crate) enum Scope {
    /// Nothing: it needs no board.
    Drawing,
    /// Each element by itself: it needs boards enough of its own.
    Element(&'static Solver),
    /// Elements that share facets: each needs one board.
    Together(Extent),
}
