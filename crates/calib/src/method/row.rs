//! The description of a method: its name, what it needs, and how it solves.

use crate::element::solver::Solver;
use crate::joint::Extent;

/// One method.
pub(crate) struct Row {
    /// The name used in files and commands.
    pub(super) name: &'static str,
    /// One-line description.
    pub(super) about: &'static str,
    /// What the method needs, and how it solves.
    pub(super) scope: Scope,
}

/// What is solved at once.
pub(crate) enum Scope {
    /// Nothing: it needs no board.
    Drawing,
    /// Each element individually: it needs enough boards of its own.
    Element(&'static Solver),
    /// Elements that share facets: each needs one board.
    Together(Extent),
}
