//! A problem linearized at a state, and variants of it in which some columns and priors are changed.

use super::elimination::{Elimination, Rows};
use super::information::Information;
use super::minimize::{SolverOptions, of_groups};
use super::problem::{GroupedResiduals, ProblemError, State};
use nalgebra::DVector;

/// A problem linearized at a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearized {
    /// The step to the minimum of the linear problem (Gauss–Newton).
    pub step: DVector<f64>,
    /// ‖f + J·step‖².
    pub min_sum_of_squares: f64,
    /// ln det of the covariance by which the residuals were weighted; see [`GroupRows`](super::GroupRows).
    pub log_covariance: f64,
    /// JᵀJ at the state.
    pub information: Information,
}

impl Linearized {
    /// −2 ln of the restricted likelihood, up to a constant: the likelihood of the beliefs by which the residuals are
    /// weighted, with all parameters integrated out.
    pub fn deviance(&self) -> f64 {
        self.min_sum_of_squares + self.information.log_determinant() + self.log_covariance
    }
}

/// A linearized problem reduced to triangles: changes of columns or priors start from these, whatever the number of
/// rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Reduced {
    linear: Elimination,
    sum_of_squares: f64,
    log_covariance: f64,
}

impl Reduced {
    /// Linearizes at a state.
    ///
    /// # Errors
    ///
    /// If the residuals or their derivatives are undefined there, or the shapes do not fit.
    pub fn new<P: GroupedResiduals>(problem: &P, state: &State) -> Result<Self, ProblemError> {
        Self::with_threshold(problem, state, 0.0)
    }

    fn with_threshold<P: GroupedResiduals>(
        problem: &P,
        state: &State,
        threshold: f64,
    ) -> Result<Self, ProblemError> {
        let width = state.shared.dimension();
        let all = of_groups(problem.groups(), |group| {
            let own = state.own(group);
            let at = problem
                .linearized(group, &state.shared, own)
                .filter(|l| l.residuals.norm_squared().is_finite())
                .ok_or(ProblemError::Undefined {
                    group,
                    place: "point reached",
                })?;
            let columns = [width, own.dimension()];
            let rows = Rows::of_group(group, &at.residuals, Some(at.jacobian), columns)?;
            Ok((rows, at.residuals.norm_squared(), at.log_covariance))
        })?;
        let sum_of_squares = all.iter().map(|(_, squares, _)| squares).sum();
        let log_covariance = all.iter().map(|(.., log)| log).sum();
        let rows = all.into_iter().map(|(rows, ..)| rows).collect();
        Ok(Self {
            linear: Elimination::new(rows, width, threshold),
            sum_of_squares,
            log_covariance,
        })
    }

    /// The problem with each column multiplied by a factor, and with a prior of mean 0 about the state for each
    /// parameter whose weight, one over its standard deviation, is nonzero.
    ///
    /// # Panics
    ///
    /// If the number of factors or weights differs from the number of parameters.
    pub fn changed(&self, factors: &DVector<f64>, weights: &DVector<f64>) -> Linearized {
        assert_eq!(
            factors.len(),
            self.linear.dimension(),
            "one factor for each parameter"
        );
        assert_eq!(
            weights.len(),
            self.linear.dimension(),
            "one weight for each parameter"
        );
        let linear = self
            .linear
            .changed(factors, weights, SolverOptions::default().rank_threshold);
        self.solved(linear)
    }

    fn solved(&self, linear: Elimination) -> Linearized {
        let step = linear.solve();
        Linearized {
            // Perpendicular to what the step explains.
            min_sum_of_squares: (self.sum_of_squares - linear.image_norm(&step).powi(2)).max(0.0),
            step,
            log_covariance: self.log_covariance,
            information: Information::new(linear),
        }
    }
}

/// Linearizes at a state, without moving.
///
/// # Errors
///
/// As [`minimize`](super::minimize()), of the state.
pub fn linearize<P: GroupedResiduals>(problem: &P, state: &State) -> Result<Linearized, ProblemError> {
    let reduced = Reduced::with_threshold(problem, state, SolverOptions::default().rank_threshold)?;
    Ok(reduced.solved(reduced.linear.clone()))
}
