//! A solver for one element alone: its angles from a start, and the effect of range errors on them.

use crate::element::attempt::Attempt;
use crate::element::solve::{SoleElement, Solution};
use crate::judge::covariance::Budget;
use crate::options::Options;
use catoptric_model::Deflection;
use nalgebra::{DMatrix, Matrix2};

/// One method of solving an element.
pub(crate) struct Solver {
    /// Whether it goes through the readings one by one, which have to be in memory then.
    pub(crate) single_readings: bool,
    /// The angles; `None` if the ray misses a board on the way.
    pub(crate) solve: fn(&Task) -> Option<Solution>,
    /// Covariance of the residuals that the solution leaves.
    pub(crate) residuals: fn(&Budget) -> Option<DMatrix<f64>>,
    /// Covariance of (θ_a, φ) at the solution.
    pub(crate) covariance: fn(&SoleElement, &Deflection, &Budget) -> Option<Matrix2<f64>>,
}

/// The problem to be solved.
pub(crate) struct Task<'a> {
    pub(crate) attempt: &'a Attempt<'a>,
    pub(crate) element: &'a SoleElement<'a>,
    /// The stretches whose boards are used, in the order of the element's observations.
    pub(crate) poses: &'a [usize],
    /// Start of the iteration.
    pub(crate) from: &'a Deflection,
    /// The estimate that the boards were chosen with.
    pub(crate) at: &'a Deflection,
}

impl<'a> Task<'a> {
    pub(crate) fn options(&self) -> &'a Options {
        self.attempt.work.options
    }
}
