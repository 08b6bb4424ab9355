//! `closed-form`: linear in the exit direction, without iteration, with the covariance that range errors cause.

use super::row::{Row, Scope};
use crate::element::initial;
use crate::element::solve::Solution;
use crate::element::solver::{Solver, Task};
use crate::judge::covariance::Budget;
use catoptric_model::Deflection;

pub(super) const ROW: Row = Row {
    name: "closed-form",
    about: "Each element individually, without iteration",
    scope: Scope::Element(&Solver {
        single_readings: false,
        solve: without_iteration,
        residuals: Budget::residual_covariance,
        covariance: |element, at, budget| {
            initial::covariance(at, element.azimuth, element.observations, budget)
        },
    }),
};

/// The closed form as the result, with mirror and biases from the estimate that the boards were chosen with.
fn without_iteration(task: &Task) -> Option<Solution> {
    let (element, at) = (task.element, task.at);
    let found = initial::closed_form(at, element.azimuth, element.observations, element.bias)?;
    let at = Deflection::from_exit(element.azimuth, &found.direction, at.distance);
    element.finish(&element.place(at.azimuth, at.elevation), 0, true)
}
