//! The joint problem solved: with facets as plane as they are believed to be, and with what the readings say of that.
//!
//! Figure σ and departure τ maximize the restricted likelihood, what is left of it when all other parameters are
//! integrated out:
//!
//! ```text
//! L(σ, τ) = ‖f‖² + ln det(JᵀJ) + Σ ln det(I + τ²HᵀH)      least at (σ̂, τ̂);  L(0, 0) − L(σ̂, τ̂) tests planeness
//! ```

use super::problem::{BOARD_ERRORS, FACET_BLOCKS, FIGURE, Flatness, Group, Joint};
use crate::least_squares::{self, Block, Point, Prior, ProblemError, Solution, State, WithPriors};
use catoptric_model::MirrorPlane;
use nalgebra::{DVector, Matrix2};

/// Departures that are tried first, in radians: 0.003° to 1.8°.
const TRIED: [f64; 7] = [5e-5, 1.5e-4, 5e-4, 1.5e-3, 5e-3, 1.5e-2, 3.2e-2];

/// Ratio of the two sides of a bracket at which the search ends: L is flat there.
const BRACKET: f64 = 1.15;

/// The golden section.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A solution, and how plane the facets are.
pub(super) struct Fit {
    pub(super) solution: Solution,
    /// L(0, 0) − L(σ̂, τ̂), never negative.
    pub(super) departure_statistic: f64,
}

impl Joint<'_> {
    /// Solves with the present τ from a state; `prior_mean` is what is believed of w.
    pub(super) fn solve(
        &self,
        start: State,
        prior_mean: &DVector<f64>,
        options: &least_squares::Options,
    ) -> Result<Solution, ProblemError> {
        let problem = self.with_priors(prior_mean);
        least_squares::minimize(&problem, start, options)
    }

    /// The problem with what is believed of w, of the boards' errors and of the facets' figures, all in their own σ.
    fn with_priors(&self, prior_mean: &DVector<f64>) -> WithPriors<'_, Self> {
        let standard = |block: usize, mean: DVector<f64>| {
            let sd = vec![1.0; mean.len()];
            Prior::independent(block, Block::Vector(mean), &sd)
        };
        let of_group = |group: &Group| {
            let figures = (0..group.facets.len()).map(|f| standard(FACET_BLOCKS * f + 2, DVector::zeros(FIGURE)));
            let boards = DVector::zeros(group.boards.len() * BOARD_ERRORS);
            figures
                .chain([standard(FACET_BLOCKS * group.facets.len(), boards)])
                .collect()
        };
        WithPriors {
            problem: self,
            shared: vec![standard(0, prior_mean.clone())],
            own: self.groups.iter().map(of_group).collect(),
        }
    }

    /// Solves; σ and τ are estimated if beams are allowed to depart from their planes.
    pub(super) fn fit(
        &mut self,
        start: State,
        prior_mean: &DVector<f64>,
        departing: bool,
    ) -> Result<Fit, ProblemError> {
        let exact = least_squares::Options::default();
        let rough = least_squares::Options {
            reduction_tolerance: 1e-6,
            ..exact
        };
        self.flatness = Flatness::default();
        if !departing {
            return Ok(Fit {
                solution: self.solve(start, prior_mean, &exact)?,
                departure_statistic: 0.0,
            });
        }
        let state = self.solve(start, prior_mean, &rough)?.state;
        let at = |joint: &mut Self, flatness: Flatness| {
            joint.flatness = flatness;
            joint.likelihood(&state, prior_mean)
        };
        let plane = at(self, Flatness::default())?;
        let (figure, _) = search(plane, |figure| at(self, Flatness { figure, tau: 0.0 }))?;
        let (tau, least) = {
            let none = at(self, Flatness { figure, tau: 0.0 })?;
            search(none, |tau| at(self, Flatness { figure, tau }))?
        };
        let (figure, least) = if tau > 0.0 {
            // What departs beam by beam is no longer taken for a figure.
            let none = at(self, Flatness { figure: 0.0, tau })?;
            search(none, |figure| at(self, Flatness { figure, tau }))?
        } else {
            (figure, least)
        };
        self.flatness = Flatness { figure, tau };
        Ok(Fit {
            solution: self.solve(state, prior_mean, &exact)?,
            departure_statistic: (plane - least).max(0.0),
        })
    }

    /// L at the minimum, as the problem linearized at a state has it.
    fn likelihood(&self, state: &State, prior_mean: &DVector<f64>) -> Result<f64, ProblemError> {
        let linear = least_squares::linearize(&self.with_priors(prior_mean), state)?;
        let mut sum = linear.least_sum_of_squares + linear.information.log_determinant();
        for (number, group) in self.groups.iter().enumerate() {
            let own = state.own(number);
            let departing = group.elements.iter().filter(|e| self.departure(e) > 0.0);
            let Some(boards) = self.boards(group, &state.shared, own) else {
                continue;
            };
            for element in departing {
                let tau = self.departure(element);
                if let Some(linear) = self.element(group, element, &state.shared, own, &boards, false) {
                    let inner = Matrix2::identity() + linear.h.transpose() * &linear.h * (tau * tau);
                    sum += libm::log(inner.determinant());
                }
            }
        }
        Ok(sum)
    }

    /// The state to begin with: w as believed, boards as tracked, facets at the given planes.
    pub(super) fn state(&self, prior_mean: &DVector<f64>, planes: &[MirrorPlane]) -> State {
        State {
            shared: Point {
                blocks: vec![Block::Vector(prior_mean.clone())],
            },
            own: self.groups.iter().map(|g| Self::start(g, planes)).collect(),
        }
    }
}

/// The σ of least L and that L; 0 unless some σ beats `none`, L without it.
fn search(
    none: f64,
    mut at: impl FnMut(f64) -> Result<f64, ProblemError>,
) -> Result<(f64, f64), ProblemError> {
    let mut best: Option<usize> = None;
    let mut least = none;
    for (i, sd) in TRIED.iter().enumerate() {
        let found = at(*sd)?;
        if found < least {
            (best, least) = (Some(i), found);
        } else if i > 1 {
            // Past the minimum, or risen twice without one.
            break;
        }
    }
    let Some(i) = best else {
        return Ok((0.0, none));
    };
    let beside = |i: Option<usize>, beyond: f64| libm::log(i.and_then(|i| TRIED.get(i)).copied().unwrap_or(beyond));
    let mut low = beside(i.checked_sub(1), 0.3 * TRIED[0]);
    let mut high = beside(Some(i + 1), 2.0 * TRIED[TRIED.len() - 1]);
    let (mut a, mut b) = (high - GOLDEN * (high - low), low + GOLDEN * (high - low));
    let (mut at_a, mut at_b) = (at(libm::exp(a))?, at(libm::exp(b))?);
    while high - low > libm::log(BRACKET) {
        if at_a < at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - GOLDEN * (high - low);
            at_a = at(libm::exp(a))?;
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + GOLDEN * (high - low);
            at_b = at(libm::exp(b))?;
        }
    }
    Ok(if at_a < at_b {
        (libm::exp(a), at_a)
    } else {
        (libm::exp(b), at_b)
    })
}
