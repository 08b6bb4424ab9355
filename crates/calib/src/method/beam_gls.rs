//! `beam-gls`: generalized least squares per element, Gauss–Newton weighted by the covariance Σ of all believed errors.
//!
//! Δx = (HᵀΣ⁻¹H)⁻¹HᵀΣ⁻¹(z − r̂), with drift, markers, biases, d and the mounting in Σ ([`crate::covariance`]). Of all
//! estimates of one element alone it has the minimum variance. Its covariance is the bound if Σ has an inverse.
//!
//! Unlike the paper, whose sum gives every reading the same weight, this weights by the inverse of Σ.

use super::row::{Row, Scope};
use crate::element::solve::{Solution, determined_step};
use crate::element::solver::{Solver, Task};
use crate::judge::levers::libm_cos;
use nalgebra::DVector;

/// Smallest variance, in square meters: that of one micrometer. Keeps Σ invertible where no error is believed in.
const MIN_VARIANCE: f64 = 1e-12;

pub(super) const ROW: Row = Row {
    name: "beam-gls",
    about: "Each element individually, weighted by the covariance of all errors",
    scope: Scope::Element(&GENERALIZED),
};

pub(crate) const GENERALIZED: Solver = Solver {
    single_readings: false,
    solve: generalized,
    residuals: |budget| {
        budget
            .residual_covariance_at_bound()
            .or_else(|| budget.residual_covariance())
    },
    covariance: |_, _, budget| budget.bound().or_else(|| budget.sandwich()),
};

/// The estimate from a start; `None` if the ray misses a board during the iteration.
fn generalized(task: &Task) -> Option<Solution> {
    let (element, options) = (task.element, task.options());
    let mut at = element.place(task.from.azimuth, task.from.elevation);
    for iteration in 1..=options.max_iterations {
        let budget = task.attempt.budget(&at, element.observations)?;
        let residuals = DVector::from_vec(element.residuals(&at)?);
        let (information, right) = budget.weighted(&residuals)?;
        // Per board and in square meters, so that the square root is a lever arm.
        let boards = residuals.len() as f64;
        let unit = (budget.covariance.trace() / boards).max(MIN_VARIANCE) / boards;
        let step = determined_step(&(information * unit), &(right * unit), libm_cos(at.elevation));
        at = element.place(at.azimuth + step.x, at.elevation + step.y);
        if step.norm() < options.step_tolerance_rad {
            return element.finish(&at, iteration, true);
        }
    }
    element.finish(&at, options.max_iterations, false)
}
