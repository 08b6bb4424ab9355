//! One element individually (steps 11 and 12): which boards it hits, its angles by the solver of a method, and whether
//! to believe them (step 13).

mod ambiguity;
pub(crate) mod attempt;
pub(crate) mod choose;
mod drawn;
mod estimate;
pub(crate) mod facet_plane;
pub mod initial;
pub mod recursive;
mod single;
pub mod solve;
pub(crate) mod solver;
mod verdict;

pub(crate) use drawn::as_drawn;
pub(crate) use estimate::estimates;
