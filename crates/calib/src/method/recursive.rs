//! `recursive`: recursive least squares per element, reading after reading, which is what the paper names. It ends where
//! `beam` ends, with its covariance.

use super::row::{Row, Scope};
use crate::element::recursive::recursive;
use crate::element::solve::{self, Solution};
use crate::element::solver::{Solver, Task};
use crate::judge::covariance::Budget;

pub(super) const ROW: Row = Row {
    name: "recursive",
    about: "The same, one reading after the other: recursive least squares",
    scope: Scope::Element(&Solver {
        single_readings: true,
        solve: over_readings,
        residuals: Budget::residual_covariance,
        covariance: |_, _, budget| budget.sandwich(),
    }),
};

fn over_readings(task: &Task) -> Option<Solution> {
    let readings: Vec<Vec<f64>> = task
        .poses
        .iter()
        .map(|p| task.attempt.single_readings(*p))
        .collect();
    // Where the readings leave a direction open there is nothing to recurse on; the batch says which.
    recursive(task.element, &readings, task.from, task.options())
        .or_else(|| solve::batch(task.element, task.from, task.options()))
}
