//! Levenberg–Marquardt with a trust region (Levenberg 1944, Marquardt 1963, Moré 1978; "lmder" of MINPACK).
//!
//! D holds the maximum length of each column of J so far (monotone scaling), so the result does not depend on the units
//! of the parameters. A step is accepted if it lowers ‖f‖² by at least 10⁻⁴ of the reduction that the linear model
//! predicts; the ratio of the two widens or narrows the region.

use super::elimination::{Elimination, Rows};
use super::information::Information;
use super::problem::{GroupedResiduals, ProblemError, State};
use super::trust_region;
use nalgebra::DVector;
use rayon::prelude::*;

/// Columns of which less than this fraction of their length is independent are left out of a step.
const STEP_THRESHOLD: f64 = 1e-14;

/// Minimum fraction of the predicted reduction that a step must achieve.
const MIN_GAIN: f64 = 1e-4;

/// Cosine of f with a column of J up to which a point counts as stationary. Converged iterations end below 10⁻⁷, stalled
/// ones above 10⁻³.
const NO_SLOPE: f64 = 1e-5;

/// Slope of ‖f‖², relative to it, per relative change of a parameter that runs to infinity, and how many times its first
/// size such a parameter has reached: ‖f‖² is then as low as it gets.
const NO_SLOPE_AFAR: f64 = 1e-7;
const AFAR: f64 = 1e3;

/// ‖f‖ relative to the scaled parameters, in roundings, below which f is rounding and its direction means nothing.
const ROUNDINGS: f64 = 1000.0;

/// When to stop, and what counts as dependent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SolverOptions {
    /// Relative reduction of ‖f‖², predicted and actual, that is not worth another step.
    pub reduction_tolerance: f64,
    /// Radius of the trust region, relative to the scaled parameters, that is not worth another step.
    pub step_tolerance: f64,
    /// Cosine of the angle between f and the columns of J at which f counts as perpendicular to all of them.
    pub gradient_tolerance: f64,
    /// Maximum number of evaluations of the residuals.
    pub max_evaluations: usize,
    /// Radius of the first trust region, relative to the scaled parameters.
    pub first_radius: f64,
    /// Fraction of a column's length that other columns leave of it, below which it depends on them.
    pub rank_threshold: f64,
}

impl Default for SolverOptions {
    fn default() -> Self {
        Self {
            reduction_tolerance: 1e-15,
            step_tolerance: 1e-14,
            gradient_tolerance: 1e-15,
            max_evaluations: 2000,
            first_radius: 1.0,
            rank_threshold: 1e-11,
        }
    }
}

/// Why the iteration ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Termination {
    /// The residuals are zero, or perpendicular to every column of the Jacobian.
    Gradient,
    /// A step brings no reduction worth having.
    Reduction,
    /// The steps have become short.
    Step,
    /// Rounding hides any further reduction, although a tolerance asks for it.
    Rounding,
    /// Steps have become short, or bring nothing, where ‖f‖² still has a slope: not a minimum.
    Stalled,
    /// `max_evaluations` reached: not a minimum.
    Limit,
}

impl Termination {
    /// Whether the iteration converged: to a point where ‖f‖² has no slope.
    pub fn converged(self) -> bool {
        !matches!(self, Self::Stalled | Self::Limit)
    }
}

/// A minimum of ‖f‖² and its properties.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The parameters.
    pub state: State,
    /// f of each group.
    pub residuals: Vec<DVector<f64>>,
    /// ‖f‖².
    pub sum_of_squares: f64,
    /// Why the iteration ended.
    pub stop: Termination,
    /// Linearizations used.
    pub iterations: usize,
    /// Evaluations of the residuals used.
    pub evaluations: usize,
    /// Largest |cos| of the angle between f and a column of J at the solution; 0 for f = 0.
    pub gradient_cosine: f64,
    /// JᵀJ at the solution, undamped: rank, open directions, covariance.
    pub information: Information,
}

impl Solution {
    /// Number of residuals minus the rank.
    pub fn degrees_of_freedom(&self) -> usize {
        let rows: usize = self.residuals.iter().map(|r| r.len()).sum();
        rows.saturating_sub(self.information.rank())
    }
}

/// Minimizes ‖f(x)‖² from a start.
///
/// # Errors
///
/// If the residuals are undefined at the start, or their derivatives at a point reached, or the shapes do not fit.
///
/// # Panics
///
/// If the state has own parameters for more groups than the problem has.
pub fn minimize<P: GroupedResiduals>(
    problem: &P,
    start: impl Into<State>,
    options: &SolverOptions,
) -> Result<Solution, ProblemError> {
    let start = start.into();
    assert!(start.own.len() <= problem.groups(), "own parameters need a group");
    let mut search = Search::begin(problem, start)?;
    let sizes = search.state.extent();
    let stop = search.run(options)?;
    let rows = rows(problem, &search.state, &search.residuals)?;
    let slope = Slope::of(&rows, search.state.shared.dimension(), search.norm);
    let linear = Elimination::new(rows, search.state.shared.dimension(), options.rank_threshold);
    let stationary = slope.is_none(linear.scale(), [&sizes, &search.state.extent()], search.norm);
    let stop = match stop {
        Termination::Reduction | Termination::Step | Termination::Rounding if !stationary => {
            Termination::Stalled
        }
        stop => stop,
    };
    Ok(Solution {
        gradient_cosine: slope.cosine(linear.scale(), search.norm),
        sum_of_squares: search.norm * search.norm,
        state: search.state,
        residuals: search.residuals,
        stop,
        iterations: search.iterations,
        evaluations: search.evaluations,
        information: Information::new(linear),
    })
}

struct Search<'a, P> {
    problem: &'a P,
    state: State,
    residuals: Vec<DVector<f64>>,
    norm: f64,
    iterations: usize,
    evaluations: usize,
}

/// Jᵀf.
struct Slope(DVector<f64>);

impl<'a, P: GroupedResiduals> Search<'a, P> {
    fn begin(problem: &'a P, state: State) -> Result<Self, ProblemError> {
        let residuals = evaluate(problem, &state).map_err(|group| ProblemError::Undefined {
            group,
            place: "start",
        })?;
        Ok(Self {
            problem,
            norm: norm(&residuals),
            state,
            residuals,
            iterations: 0,
            evaluations: 1,
        })
    }

    /// Returns an error if the caller has stopped the search.
    fn look_up(&self) -> Result<(), ProblemError> {
        if self.problem.is_stopped() {
            return Err(ProblemError::Stopped);
        }
        Ok(())
    }

    fn run(&mut self, options: &SolverOptions) -> Result<Termination, ProblemError> {
        let width = self.state.shared.dimension();
        let mut d = DVector::zeros(0);
        let (mut radius, mut size, mut damping) = (0.0, 0.0, 0.0);
        loop {
            self.look_up()?;
            let rows = rows(self.problem, &self.state, &self.residuals)?;
            self.iterations += 1;
            let slope = Slope::of(&rows, width, self.norm);
            let linear = Elimination::new(rows, width, STEP_THRESHOLD);
            let first = d.is_empty();
            if first {
                d = linear.scale().clone();
            }
            let cosine = slope.cosine(linear.scale(), self.norm);
            if cosine <= options.gradient_tolerance {
                return Ok(Termination::Gradient);
            }
            d = d.zip_map(linear.scale(), f64::max);
            if first {
                size = d.component_mul(&self.state.extent()).norm();
                radius = options.first_radius * if size > 0.0 { size } else { 1.0 };
            }
            loop {
                self.look_up()?;
                let tried = trust_region::step(&linear, &slope.0, &d, radius, damping);
                damping = tried.damping;
                let length = d.component_mul(&tried.step).norm();
                if self.iterations == 1 {
                    radius = radius.min(length);
                }
                let next = self.state.retract(&tried.step);
                self.evaluations += 1;
                let outcome = evaluate(self.problem, &next).ok();
                let next_norm = outcome.as_ref().map_or(f64::INFINITY, |r| norm(r));
                let actual = if 0.1 * next_norm < self.norm {
                    1.0 - (next_norm / self.norm).powi(2)
                } else {
                    -1.0
                };
                let linear_part = (linear.image_norm(&tried.step) / self.norm).powi(2);
                let damped_part = damping * (length / self.norm).powi(2);
                let promised = linear_part + 2.0 * damped_part;
                let ratio = if promised > 0.0 { actual / promised } else { 0.0 };
                if ratio <= 0.25 {
                    let descent = -(linear_part + damped_part);
                    let shrink = if actual >= 0.0 {
                        0.5
                    } else {
                        0.5 * descent / (descent + 0.5 * actual)
                    };
                    let shrink = if 0.1 * next_norm >= self.norm || shrink < 0.1 {
                        0.1
                    } else {
                        shrink
                    };
                    radius = shrink * radius.min(length / 0.1);
                    damping /= shrink;
                } else if damping == 0.0 || ratio >= 0.75 {
                    radius = 2.0 * length;
                    damping *= 0.5;
                }
                let taken = ratio >= MIN_GAIN;
                if let (true, Some(residuals)) = (taken, outcome) {
                    self.state = next;
                    self.residuals = residuals;
                    self.norm = next_norm;
                    size = d.component_mul(&self.state.extent()).norm();
                }
                let little =
                    |tolerance: f64| actual.abs() <= tolerance && promised <= tolerance && 0.5 * ratio <= 1.0;
                if little(options.reduction_tolerance) {
                    return Ok(Termination::Reduction);
                }
                if radius <= options.step_tolerance * size {
                    return Ok(Termination::Step);
                }
                if little(f64::EPSILON) || radius <= f64::EPSILON * size || radius < f64::MIN_POSITIVE {
                    return Ok(Termination::Rounding);
                }
                if self.evaluations >= options.max_evaluations {
                    return Ok(Termination::Limit);
                }
                if taken {
                    break;
                }
            }
        }
    }
}

impl Slope {
    /// Jᵀf, from rows whose right side is −f.
    fn of(rows: &[Rows], shared_width: usize, norm: f64) -> Self {
        let mut shared = DVector::zeros(shared_width);
        let mut own = Vec::new();
        if norm > 0.0 {
            for group in rows {
                shared -= group.shared.transpose() * &group.right;
                own.extend(group.own.column_iter().map(|c| -c.dot(&group.right)));
            }
        } else {
            own.resize(rows.iter().map(|g| g.own.ncols()).sum(), 0.0);
        }
        own.splice(0..0, shared.iter().copied());
        Self(DVector::from_vec(own))
    }

    /// Whether a point is stationary, given the lengths of the columns of J and the size of each parameter at the start
    /// and there.
    fn is_none(&self, lengths: &DVector<f64>, [first, sizes]: [&DVector<f64>; 2], norm: f64) -> bool {
        // The size of a parameter that has run away does not show how large f may be by rounding.
        let afar = |first: f64, size: f64| first > 0.0 && size > AFAR * first;
        let near = sizes.zip_map(first, |size, first| if afar(first, size) { first } else { size });
        if norm <= ROUNDINGS * f64::EPSILON * lengths.component_mul(&near).norm() {
            return true;
        }
        (0..self.0.len()).all(|i| {
            let slope = self.0[i].abs();
            let flat_afar = afar(first[i], sizes[i]) && slope * sizes[i] <= NO_SLOPE_AFAR * norm * norm;
            slope <= NO_SLOPE * lengths[i] * norm || flat_afar
        })
    }

    fn cosine(&self, lengths: &DVector<f64>, norm: f64) -> f64 {
        if norm > 0.0 {
            (self.0.component_div(lengths) / norm).amax()
        } else {
            0.0
        }
    }
}

pub(super) fn norm(residuals: &[DVector<f64>]) -> f64 {
    residuals.iter().map(|r| r.norm_squared()).sum::<f64>().sqrt()
}

/// Evaluates a function for all groups in parallel; of several errors, returns that of the first group.
pub(super) fn of_groups<T: Send, E: Send>(
    groups: usize,
    one: impl Fn(usize) -> Result<T, E> + Send + Sync,
) -> Result<Vec<T>, E> {
    if groups < 2 {
        return (0..groups).map(one).collect();
    }
    let all: Vec<Result<T, E>> = (0..groups).into_par_iter().with_max_len(1).map(one).collect();
    all.into_iter().collect()
}

/// Residuals of all groups, or the group where they are undefined or not finite.
fn evaluate<P: GroupedResiduals>(problem: &P, state: &State) -> Result<Vec<DVector<f64>>, usize> {
    of_groups(problem.groups(), |group| {
        problem
            .residuals(group, &state.shared, state.own(group))
            .filter(|r| r.norm_squared().is_finite())
            .ok_or(group)
    })
}

/// Rows of all groups, with −f on the right.
fn rows<P: GroupedResiduals>(
    problem: &P,
    state: &State,
    residuals: &[DVector<f64>],
) -> Result<Vec<Rows>, ProblemError> {
    of_groups(residuals.len(), |group| {
        let own = state.own(group);
        let jacobian = problem.jacobian(group, &state.shared, own);
        let columns = [state.shared.dimension(), own.dimension()];
        Rows::of_group(group, &residuals[group], jacobian, columns)
    })
}
