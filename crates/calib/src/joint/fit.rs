//! Solves the joint problem, first with flat facets and then with the flatness that the readings show.
//!
//! Figure σ and deviation τ maximize the restricted likelihood, in which all other parameters are integrated out:
//!
//! ```text
//! L(σ, τ) = ‖f‖² + ln det(JᵀJ) + Σ ln det(I + τ²HᵀH)   minimal at (σ̂, τ̂);  L(0, 0) − L(σ̂, τ̂) tests flatness
//! ```

use super::fan::Flatness;
use super::group::{BOARD_ERRORS, FACET_BLOCKS, FACET_PARAMETERS, FIGURE, Group};
use super::problem::Joint;
use crate::lsq::{self, ParameterBlock, Point, Prior, ProblemError, Reduced, Solution, State, WithPriors};
use catoptric_model::MirrorPlane;
use nalgebra::DVector;

/// Deviations tried first, in radians: 0.003° to 1.8°.
const TRIED: [f64; 7] = [5e-5, 1.5e-4, 5e-4, 1.5e-3, 5e-3, 1.5e-2, 3.2e-2];

/// Number of refinements toward the minimum.
const REFINEMENTS: usize = 4;

/// Step in ln σ beyond the points tried, and the smallest step worth evaluating.
const FURTHER: f64 = 1.1;
const CLOSE: f64 = 0.1;

/// Relative difference of the intervals on both sides of a point up to which they count as equal, so that rounding does
/// not decide.
const TIE: f64 = 1e-6;

/// A solution and the flatness of the facets.
pub(super) struct JointFit {
    pub(super) solution: Solution,
    /// L(0, 0) − L(σ̂, τ̂), never negative.
    pub(super) deviation_statistic: f64,
}

impl Joint<'_> {
    /// Solves from a state with the present τ.
    pub(super) fn solve(&self, start: State, options: &lsq::SolverOptions) -> Result<Solution, ProblemError> {
        let problem = self.with_priors(self);
        lsq::minimize(&problem, start, options)
    }

    /// Adds to a problem in these parameters the priors on w, on the boards' errors and on the facets' figures, each in
    /// units of its own σ.
    pub(super) fn with_priors<'p, P>(&self, problem: &'p P) -> WithPriors<'p, P> {
        let mut all = self.without_figures(problem);
        for (group, own) in self.groups.iter().zip(&mut all.own) {
            own.extend(
                (0..group.facets.len()).map(|f| standard(FACET_BLOCKS * f + 2, DVector::zeros(FIGURE))),
            );
        }
        all
    }

    /// The same without the priors on the figures.
    fn without_figures<'p, P>(&self, problem: &'p P) -> WithPriors<'p, P> {
        let of_group = |group: &Group| {
            let boards = DVector::zeros(group.boards.len() * BOARD_ERRORS);
            vec![standard(FACET_BLOCKS * group.facets.len(), boards)]
        };
        WithPriors {
            problem,
            shared: vec![standard(0, self.prior_mean.clone())],
            own: self.groups.iter().map(of_group).collect(),
        }
    }

    /// Solves with flat facets, then estimates σ and τ from that solution.
    pub(super) fn fit(&mut self, start: State) -> Result<JointFit, ProblemError> {
        let exact = lsq::SolverOptions::default();
        let rough = lsq::SolverOptions {
            reduction_tolerance: 1e-6,
            ..exact
        };
        self.flatness = Flatness::default();
        let state = self.without_figure(self.solve(start, &rough)?.state);
        let at_plane = self.with_deviations(0.0, &state)?;
        let plane = at_plane.deviance(0.0);
        let (figure, none) = search(plane, |figure| Ok(at_plane.deviance(figure)))?;
        let (tau, lowest) = search(none, |tau| {
            Ok(self.with_deviations(tau, &state)?.deviance(figure))
        })?;
        let (figure, lowest) = if tau > 0.0 {
            // Deviations of single beams no longer pass for a figure.
            let deviating = self.with_deviations(tau, &state)?;
            search(deviating.deviance(0.0), |figure| Ok(deviating.deviance(figure)))?
        } else {
            (figure, lowest)
        };
        self.flatness = Flatness { figure, tau };
        Ok(JointFit {
            solution: self.solve(state, &exact)?,
            deviation_statistic: (plane - lowest).max(0.0),
        })
    }

    /// A state with flat facets.
    fn without_figure(&self, mut state: State) -> State {
        for (group, own) in self.groups.iter().zip(&mut state.own) {
            for facet in 0..group.facets.len() {
                own.blocks[FACET_BLOCKS * facet + 2] = ParameterBlock::Vector(DVector::zeros(FIGURE));
            }
        }
        state
    }

    /// Linearizes the problem with deviations τ at a state with flat facets, for any σ.
    fn with_deviations(&mut self, tau: f64, state: &State) -> Result<Deviating, ProblemError> {
        // Without a figure, its σ is only a factor of its columns.
        self.flatness = Flatness { figure: 1.0, tau };
        let mut figures = DVector::zeros(state.dimension());
        for (number, group) in self.groups.iter().enumerate() {
            for facet in 0..group.facets.len() {
                let first = self.offset(number) + facet * FACET_PARAMETERS + FACET_PARAMETERS - FIGURE;
                figures.rows_mut(first, FIGURE).fill(1.0);
            }
        }
        Ok(Deviating {
            reduced: Reduced::new(&self.without_figures(&*self), state)?,
            figures,
        })
    }

    /// The initial state: the mounting as already found, boards as tracked, facets at the given planes.
    pub(super) fn state(&self, planes: &[MirrorPlane]) -> State {
        State {
            shared: Point {
                blocks: vec![ParameterBlock::Vector(DVector::zeros(self.shared_dimension()))],
            },
            own: self.groups.iter().map(|g| Self::start(g, planes)).collect(),
        }
    }
}

/// The linearized problem for one τ.
struct Deviating {
    reduced: Reduced,
    /// 1 for each parameter of a figure, 0 for all others.
    figures: DVector<f64>,
}

impl Deviating {
    /// L(σ, τ) of the linearized problem.
    fn deviance(&self, figure: f64) -> f64 {
        let factors = self.figures.map(|is| if is > 0.0 { figure } else { 1.0 });
        self.reduced.changed(&factors, &self.figures).deviance()
    }
}

/// A prior of independent standard normal numbers about a mean.
fn standard(block: usize, mean: DVector<f64>) -> Prior {
    let sd = vec![1.0; mean.len()];
    Prior::independent(block, ParameterBlock::Vector(mean), &sd)
}

/// The σ of minimal L, and that L. 0 unless some σ beats `none`, the L without it.
fn search(
    none: f64,
    mut at: impl FnMut(f64) -> Result<f64, ProblemError>,
) -> Result<(f64, f64), ProblemError> {
    let mut seen: Vec<(f64, f64)> = Vec::new();
    let mut lowest = none;
    for (i, sd) in TRIED.iter().enumerate() {
        let found = at(*sd)?;
        seen.push((libm::log(*sd), found));
        if found < lowest {
            lowest = found;
        } else if i > 1 {
            // Past the minimum, or rising without one.
            break;
        }
    }
    if lowest >= none {
        return Ok((0.0, none));
    }
    // L is smooth in ln σ: parabolas through the three lowest points locate its minimum accurately enough.
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
            // The parabola adds nothing: bisect the wider side.
            (Some(low), Some(high)) if near(next) => {
                let (low, middle, high) = (seen[low].0, seen[best].0, high.0);
                let wider_below = middle - low > (high - middle) * (1.0 + TIE);
                0.5 * (middle + if wider_below { low } else { high })
            }
            _ => next,
        };
        seen.push((next, at(libm::exp(next))?));
    }
    let best = seen.iter().min_by(|a, b| a.1.total_cmp(&b.1));
    Ok(best.map_or((0.0, none), |(x, found)| (libm::exp(*x), *found)))
}

/// Abscissa of the vertex of the parabola through three points, the middle one lowest.
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
    fn the_most_probable_size_is_found_and_zero_is_kept() {
        // ln σ² + s²/σ² is minimal at σ = s.
        let likelihood = |s: f64| move |sd: f64| Ok(2.0 * libm::log(sd) + (s / sd).powi(2));
        for s in [2e-4, 1e-3, 0.02] {
            let (found, _) = search(f64::INFINITY, likelihood(s)).expect("L is defined everywhere");
            assert!((found / s - 1.0).abs() < 0.15, "{found} for {s}");
        }
        assert_eq!(search(0.0, |sd: f64| Ok(sd)).expect("L is defined"), (0.0, 0.0));
    }
}
