//! `beam`: batch Gauss–Newton per element over all readings alike, Eqs. (7)–(8): what the paper prints and calls RLS. Its
//! covariance is the sandwich: what that sum makes of all errors believed in.

use super::row::{Row, Scope};
use crate::element::solve;
use crate::element::solver::Solver;
use crate::judge::covariance::Budget;

pub(super) const ROW: Row = Row {
    name: "beam",
    about: "Each element by itself, all readings alike, Eqs. 7 and 8",
    scope: Scope::Element(&BATCH),
};

pub(crate) const BATCH: Solver = Solver {
    single_readings: false,
    solve: |task| solve::batch(task.element, task.from, task.options()),
    residuals: Budget::residual_covariance,
    covariance: |_, _, budget| budget.sandwich(),
};
