//! `beam`: batch Gauss–Newton per element with equal weights for all readings, Eqs. (7)–(8), which the paper prints and
//! calls RLS. Its covariance is the sandwich: the effect of all believed errors on that estimate.

use super::row::{Row, Scope};
use crate::element::solve;
use crate::element::solver::Solver;
use crate::judge::covariance::Budget;

pub(super) const ROW: Row = Row {
    name: "beam",
    about: "Each element individually, all readings with equal weight, Eqs. (7)–(8)",
    scope: Scope::Element(&BATCH),
};

pub(crate) const BATCH: Solver = Solver {
    single_readings: false,
    solve: |task| solve::batch(task.element, task.from, task.options()),
    residuals: Budget::residual_covariance,
    covariance: |_, _, budget| budget.sandwich(),
};
