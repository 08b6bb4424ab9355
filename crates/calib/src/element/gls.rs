//! Generalized least squares per element: Gauss–Newton weighted by the covariance Σ of all errors believed in.
//!
//! Δx = (HᵀΣ⁻¹H)⁻¹HᵀΣ⁻¹(z − r̂), with drift, markers, biases, d and the mounting in Σ ([`crate::covariance`]). It has the
//! least variance of all estimates of one element by itself. Unlike the paper, whose sum gives every reading the same
//! weight.

use crate::element::attempt::Attempt;
use crate::element::solve::{Element, Solution, determined_step};
use crate::judge::levers::libm_cos;
use catoptric_model::Deflection;
use nalgebra::DVector;

/// Variance that stands for none, in square metres: a micrometre's.
const LEAST_VARIANCE: f64 = 1e-12;

/// The estimate from a start; `None` if the ray misses a board on the way.
pub(crate) fn generalized(attempt: &Attempt, element: &Element, start: &Deflection) -> Option<Solution> {
    let options = attempt.work.options;
    let mut at = element.place(start.azimuth, start.elevation);
    for iteration in 1..=options.max_iterations {
        let budget = attempt.budget(&at, element.observations)?;
        let residuals = DVector::from_vec(element.residuals(&at)?);
        let (information, right) = budget.weighted(&residuals)?;
        // Per board and in square metres, so that a lever arm is one.
        let boards = residuals.len() as f64;
        let unit = (budget.covariance.trace() / boards).max(LEAST_VARIANCE) / boards;
        let step = determined_step(&(information * unit), &(right * unit), libm_cos(at.elevation));
        at = element.place(at.azimuth + step.x, at.elevation + step.y);
        if step.norm() < options.step_tolerance_rad {
            return element.finish(&at, iteration, true);
        }
    }
    element.finish(&at, options.max_iterations, false)
}
