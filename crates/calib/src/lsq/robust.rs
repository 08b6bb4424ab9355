//! Fits that outliers do not spoil: reweighted least squares, and graduated non-convexity.
//!
//! Reweighting (IRLS; Holland, Welsch 1977) minimizes Σ ρ(r/s) by turns: weights from residuals, then a weighted fit. The
//! scale s begins at the spread of the residuals (1.4826·median|r|), so that at first nearly all count, and shrinks with
//! it down to `least_scale`.
//!
//! Graduated non-convexity (Blake, Zisserman 1987; Zach 2014; Yang et al. 2020) begins with a loss that is all but convex
//! and hardens it step by step (μ) into truncated squares or Geman–McClure, with an outlier beyond the gate c:
//!
//! ```text
//! truncated      w = 0 for r² ≥ c²(μ+1)/μ, 1 for r² ≤ c²μ/(μ+1), else (c/|r|)√(μ(μ+1)) − μ;   μ₀ = c²/(2r²ₘₐₓ − c²), ·1.4
//! Geman–McClure  w = (μc²/(r² + μc²))²;                                                      μ₀ = 2r²ₘₐₓ/c², ÷1.4 to 1
//! ```

use super::loss::Loss;
use super::manifold::Point;
use super::minimize::{Options, Solution, minimize};
use super::problem::{GroupJacobian, GroupedProblem, ProblemError, State};
use nalgebra::{DMatrix, DVector};

/// Ratio of the standard deviation to the median of |r| of a normal distribution.
const MEDIAN_TO_SD: f64 = 1.482602218505602;

/// Step of μ from round to round (Yang et al. 2020).
const HARDENING: f64 = 1.4;

/// How a robust fit goes about it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobustOptions {
    /// Of each weighted fit.
    pub fit: Options,
    /// Smallest scale of [`minimize_robust`]: the standard deviation of a good residual, 1 if they are in its units.
    pub least_scale: f64,
    /// Rounds of weighting, at most.
    pub max_rounds: usize,
    /// Change of every weight below which the weights have settled.
    pub weight_tolerance: f64,
}

impl Default for RobustOptions {
    fn default() -> Self {
        Self {
            fit: Options::default(),
            least_scale: 1.0,
            max_rounds: 200,
            weight_tolerance: 1e-10,
        }
    }
}

/// What a graduated loss hardens into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Surrogate {
    /// min(r², c²): each residual is in or out.
    TruncatedSquares,
    /// c²r²/(c² + r²).
    GemanMcClure,
}

/// A robust fit.
#[derive(Debug, Clone, PartialEq)]
pub struct RobustSolution {
    /// The last weighted fit. Its residuals, information and sum of squares are the weighted ones: rows times √w, and the
    /// weights taken as given.
    pub solution: Solution,
    /// Weight of every row of each group, between 0 and 1; 1 for rows that are no measurements.
    pub weights: Vec<DVector<f64>>,
    /// Residuals of each group without weights, at the solution.
    pub residuals: Vec<DVector<f64>>,
    /// The last scale s; of a graduated fit, the gate c.
    pub scale: f64,
    /// Rounds of weighting used.
    pub rounds: usize,
    /// Whether the weights settled.
    pub settled: bool,
}

/// A problem whose rows are multiplied by √w.
struct Weighted<'a, P> {
    problem: &'a P,
    roots: Vec<DVector<f64>>,
}

/// Minimizes Σ ρ(r/s) by reweighting, with a scale that shrinks; see the module.
///
/// # Errors
///
/// As [`minimize`].
///
/// # Panics
///
/// If `least_scale` is not positive.
pub fn minimize_robust<P: GroupedProblem>(
    problem: &P,
    start: impl Into<State>,
    loss: Loss,
    options: &RobustOptions,
) -> Result<RobustSolution, ProblemError> {
    assert!(options.least_scale > 0.0, "a positive scale");
    let start = start.into();
    let first = residuals(problem, &start)?;
    let mut scale = options.least_scale.max(spread(problem, &first));
    let weigh = move |residuals: &[DVector<f64>], _round: usize| {
        scale = scale.min(spread(problem, residuals).max(options.least_scale));
        let weights = weights(problem, residuals, |r| loss.weight(r / scale));
        Weighing {
            weights,
            scale,
            hardened: true,
        }
    };
    reweight(problem, start, first, weigh, options)
}

/// Minimizes a hardening loss by graduated non-convexity; see the module.
///
/// `gate` is c in the units of the residuals: [`gate`](super::gate) of a probability if they are in units of their
/// standard deviations.
///
/// # Errors
///
/// As [`minimize`].
///
/// # Panics
///
/// If the gate is not positive.
pub fn minimize_graduated<P: GroupedProblem>(
    problem: &P,
    start: impl Into<State>,
    surrogate: Surrogate,
    gate: f64,
    options: &RobustOptions,
) -> Result<RobustSolution, ProblemError> {
    assert!(gate > 0.0, "a positive gate");
    let plain = minimize(problem, start, &options.fit)?;
    let c2 = gate * gate;
    let largest = measured(problem, &plain.residuals)
        .iter()
        .fold(0.0_f64, |m, r| m.max(r * r));
    let mut mu = match surrogate {
        // Nothing beyond the gate: hard from the beginning.
        Surrogate::TruncatedSquares if largest <= c2 => f64::INFINITY,
        Surrogate::TruncatedSquares => c2 / (2.0 * largest - c2),
        Surrogate::GemanMcClure => (2.0 * largest / c2).max(1.0),
    };
    let weigh = move |residuals: &[DVector<f64>], round: usize| {
        if round > 0 {
            mu = match surrogate {
                Surrogate::TruncatedSquares => mu * HARDENING,
                Surrogate::GemanMcClure => (mu / HARDENING).max(1.0),
            };
        }
        let weights = weights(problem, residuals, |r| surrogate.weight(r * r / c2, mu));
        let hardened = match surrogate {
            Surrogate::TruncatedSquares => weights
                .iter()
                .flat_map(|w| w.iter())
                .all(|w| *w == 0.0 || *w == 1.0),
            Surrogate::GemanMcClure => mu <= 1.0,
        };
        Weighing {
            weights,
            scale: gate,
            hardened,
        }
    };
    let at_plain = plain.residuals;
    reweight(problem, plain.state, at_plain, weigh, options)
}

struct Weighing {
    weights: Vec<DVector<f64>>,
    scale: f64,
    hardened: bool,
}

fn reweight<P: GroupedProblem>(
    problem: &P,
    start: State,
    first: Vec<DVector<f64>>,
    mut weigh: impl FnMut(&[DVector<f64>], usize) -> Weighing,
    options: &RobustOptions,
) -> Result<RobustSolution, ProblemError> {
    let mut weighing = weigh(&first, 0);
    let mut state = start;
    let mut round = 0;
    loop {
        round += 1;
        let weighted = Weighted {
            problem,
            roots: weighing.weights.iter().map(|w| w.map(f64::sqrt)).collect(),
        };
        let solution = minimize(&weighted, state, &options.fit)?;
        let plain = residuals(problem, &solution.state)?;
        let next = weigh(&plain, round);
        let change = next
            .weights
            .iter()
            .zip(&weighing.weights)
            .map(|(a, b)| if a.is_empty() { 0.0 } else { (a - b).amax() })
            .fold(0.0, f64::max);
        let settled = change <= options.weight_tolerance && next.hardened && weighing.hardened;
        if settled || round >= options.max_rounds {
            return Ok(RobustSolution {
                weights: weighing.weights,
                residuals: plain,
                scale: weighing.scale,
                rounds: round,
                settled,
                solution,
            });
        }
        state = solution.state;
        weighing = next;
    }
}

impl Surrogate {
    /// Weight of a residual, r²/c² given.
    fn weight(self, squared: f64, mu: f64) -> f64 {
        match self {
            Self::TruncatedSquares => {
                // μ/(μ+1) and (μ+1)/μ, which tend to 1 as μ grows without limit.
                let inside = 1.0 - 1.0 / (mu + 1.0);
                let outside = 1.0 + 1.0 / mu;
                if squared <= inside {
                    1.0
                } else if squared >= outside {
                    0.0
                } else {
                    ((mu * (mu + 1.0) / squared).sqrt() - mu).clamp(0.0, 1.0)
                }
            }
            Self::GemanMcClure => (mu / (squared + mu)).powi(2),
        }
    }
}

fn residuals<P: GroupedProblem>(problem: &P, state: &State) -> Result<Vec<DVector<f64>>, ProblemError> {
    (0..problem.groups())
        .map(|group| {
            problem
                .residuals(group, &state.shared, state.own(group))
                .ok_or(ProblemError::Undefined {
                    group,
                    place: "point reached",
                })
        })
        .collect()
}

/// The measured rows of all groups.
fn measured<P: GroupedProblem>(problem: &P, residuals: &[DVector<f64>]) -> Vec<f64> {
    residuals
        .iter()
        .enumerate()
        .flat_map(|(group, r)| r.as_slice()[..problem.measured_rows(group, r.len())].to_vec())
        .collect()
}

/// 1.4826·median|r| of the measured rows; 0 without any.
fn spread<P: GroupedProblem>(problem: &P, residuals: &[DVector<f64>]) -> f64 {
    let mut sizes: Vec<f64> = measured(problem, residuals).iter().map(|r| r.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let half = sizes.len() / 2;
    match sizes.len() {
        0 => 0.0,
        n if n % 2 == 1 => MEDIAN_TO_SD * sizes[half],
        _ => MEDIAN_TO_SD * 0.5 * (sizes[half - 1] + sizes[half]),
    }
}

fn weights<P: GroupedProblem>(
    problem: &P,
    residuals: &[DVector<f64>],
    weight: impl Fn(f64) -> f64,
) -> Vec<DVector<f64>> {
    residuals
        .iter()
        .enumerate()
        .map(|(group, r)| {
            let doubted = problem.measured_rows(group, r.len());
            DVector::from_fn(r.len(), |i, _| if i < doubted { weight(r[i]) } else { 1.0 })
        })
        .collect()
}

fn multiplied(matrix: &DMatrix<f64>, roots: &DVector<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * roots[i])
}

impl<P: GroupedProblem> GroupedProblem for Weighted<'_, P> {
    fn groups(&self) -> usize {
        self.problem.groups()
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        let rows = self.problem.residuals(group, shared, own)?;
        Some(rows.component_mul(&self.roots[group]))
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        let part = self.problem.jacobian(group, shared, own)?;
        Some(GroupJacobian {
            shared: multiplied(&part.shared, &self.roots[group]),
            own: multiplied(&part.own, &self.roots[group]),
        })
    }
}
