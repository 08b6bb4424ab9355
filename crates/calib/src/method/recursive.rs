//! `recursive`: recursive least squares per element, reading by reading, which is what the paper names. It reaches the
//! same estimate as `beam`, with the same covariance.

use super::row::{Row, Scope};
use crate::element::recursive::recursive;
use crate::element::solve::{self, Solution};
use crate::element::solver::{Solver, Task};
use crate::judge::covariance::Budget;

pub(super) const ROW: Row = Row {
    name: "recursive",
    about: "The same, reading by reading: recursive least squares",
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
    // If the readings leave a direction open, the recursion cannot start; the batch solution shows which direction.
    recursive(task.element, &readings, task.from, task.options())
        .or_else(|| solve::batch(task.element, task.from, task.options()))
}
