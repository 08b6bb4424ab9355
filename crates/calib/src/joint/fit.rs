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

/// Points that close in on the minimum.
const REFINEMENTS: usize = 4;

/// Step in ln σ beyond the points tried, and one that is too short to learn from.
const FURTHER: f64 = 1.1;
const CLOSE: f64 = 0.1;

/// A solution, and how plane the facets are.
pub(super) struct Fit {
    pub(super) solution: Solution,
    /// L(0, 0) − L(σ̂, τ̂), never negative.
    pub(super) departure_statistic: f64,
}

impl Joint<'_> {
    /// Solves with the present τ from a state.
    pub(super) fn solve(
        &self,
        start: State,
        options: &least_squares::Options,
    ) -> Result<Solution, ProblemError> {
        let problem = self.with_priors(self);
        least_squares::minimize(&problem, start, options)
    }

    /// A problem in these parameters with what is believed of w, of the boards' errors and of the facets' figures, all in
    /// their own σ.
    pub(super) fn with_priors<'p, P>(&self, problem: &'p P) -> WithPriors<'p, P> {
        let standard = |block: usize, mean: DVector<f64>| {
            let sd = vec![1.0; mean.len()];
            Prior::independent(block, Block::Vector(mean), &sd)
        };
        let of_group = |group: &Group| {
            let figures =
                (0..group.facets.len()).map(|f| standard(FACET_BLOCKS * f + 2, DVector::zeros(FIGURE)));
            let boards = DVector::zeros(group.boards.len() * BOARD_ERRORS);
            figures
                .chain([standard(FACET_BLOCKS * group.facets.len(), boards)])
                .collect()
        };
        WithPriors {
            problem,
            shared: vec![standard(0, self.prior_mean.clone())],
            own: self.groups.iter().map(of_group).collect(),
        }
    }

    /// Solves with facets that are plane, and estimates σ and τ from where that ends.
    pub(super) fn fit(&mut self, start: State) -> Result<Fit, ProblemError> {
        let exact = least_squares::Options::default();
        let rough = least_squares::Options {
            reduction_tolerance: 1e-6,
            ..exact
        };
        self.flatness = Flatness::default();
        let state = self.solve(start, &rough)?.state;
        let at = |joint: &mut Self, flatness: Flatness| {
            joint.flatness = flatness;
            joint.likelihood(&state)
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
            solution: self.solve(state, &exact)?,
            departure_statistic: (plane - least).max(0.0),
        })
    }

    /// L at the minimum, as the problem linearized at a state has it.
    fn likelihood(&self, state: &State) -> Result<f64, ProblemError> {
        let linear = least_squares::linearize(&self.with_priors(self), state)?;
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

    /// The state to begin with: the mounting as already found, boards as tracked, facets at the given planes.
    pub(super) fn state(&self, planes: &[MirrorPlane]) -> State {
        State {
            shared: Point {
                blocks: vec![Block::Vector(DVector::zeros(self.shared_dimension()))],
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
    let mut seen: Vec<(f64, f64)> = Vec::new();
    let mut least = none;
    for (i, sd) in TRIED.iter().enumerate() {
        let found = at(*sd)?;
        seen.push((libm::log(*sd), found));
        if found < least {
            least = found;
        } else if i > 1 {
            // Past the minimum, or risen without one.
            break;
        }
    }
    if least >= none {
        return Ok((0.0, none));
    }
    // L is smooth in ln σ: parabolas through the three lowest points find its minimum as closely as it matters.
    for _ in 0..REFINEMENTS {
        seen.sort_by(|a, b| a.0.total_cmp(&b.0));
        let best = (0..seen.len())
            .min_by(|a, b| seen[*a].1.total_cmp(&seen[*b].1))
            .unwrap_or(0);
        let next = match (
            best.checked_sub(1).map(|i| seen[i]),
            seen[best],
            seen.get(best + 1),
        ) {
            (Some(low), middle, Some(high)) => vertex(low, middle, *high),
            (None, middle, _) => middle.0 - FURTHER,
            (_, middle, None) => middle.0 + FURTHER,
        };
        let near = |x: f64| seen.iter().any(|(known, _)| (known - x).abs() < CLOSE);
        let next = match (best.checked_sub(1), seen.get(best + 1)) {
            // The parabola has nothing to add: the wider side is halved.
            (Some(low), Some(high)) if near(next) => {
                let (low, middle, high) = (seen[low].0, seen[best].0, high.0);
                0.5 * (middle + if middle - low > high - middle { low } else { high })
            }
            _ => next,
        };
        seen.push((next, at(libm::exp(next))?));
    }
    let best = seen.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.map_or((0.0, none), |(x, found)| (libm::exp(*x), *found)))
}

/// Where the parabola through three points, the middle one lowest, is lowest.
fn vertex(low: (f64, f64), middle: (f64, f64), high: (f64, f64)) -> f64 {
    let (left, right) = (middle.0 - low.0, high.0 - middle.0);
    let (rise_left, rise_right) = (low.1 - middle.1, high.1 - middle.1);
    let bend = rise_left * right + rise_right * left;
    if bend > 0.0 {
        middle.0 + 0.5 * (rise_left * right * right - rise_right * left * left) / bend
    } else {
        middle.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertex_of_a_parabola_is_found() {
        let of = |x: f64| (x, 2.0 * (x - 0.7) * (x - 0.7) + 1.0);
        assert!((vertex(of(0.0), of(0.5), of(2.0)) - 0.7).abs() < 1e-15);
    }

    #[test]
    fn the_likeliest_size_is_found_and_none_is_kept() {
        // ln σ² + s²/σ² is least at σ = s.
        let likelihood = |s: f64| move |sd: f64| Ok(2.0 * libm::log(sd) + (s / sd).powi(2));
        for s in [2e-4, 1e-3, 0.02] {
            let (found, _) = search(f64::INFINITY, likelihood(s)).expect("it is defined everywhere");
            assert!((found / s - 1.0).abs() < 0.15, "{found} for {s}");
        }
        assert_eq!(search(0.0, |sd: f64| Ok(sd)).expect("it is defined"), (0.0, 0.0));
    }
}
