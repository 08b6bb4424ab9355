//! The step within a trust region: min ‖J·p + f‖ subject to ‖D·p‖ ≤ Δ (Moré 1978, "lmpar" of MINPACK).
//!
//! p(μ) = −(JᵀJ + μD²)⁻¹Jᵀf; μ is 0 if the Gauss–Newton step is inside, else the root of φ(μ) = ‖D·p(μ)‖ − Δ, which a
//! safeguarded Newton iteration on 1/φ finds to 10 %: μ ← μ + (φ/Δ)·(‖D·p‖/‖z‖)², with Rᵀz = D²p and R of [J; √μ·D].

use super::elimination::Elimination;
use nalgebra::DVector;

/// Relative error of ‖D·p‖ that is accepted.
const SLACK: f64 = 0.1;

/// Maximum number of Newton steps for μ.
const MAX_STEPS: usize = 10;

/// A step and its damping.
pub(super) struct DampedStep {
    pub(super) step: DVector<f64>,
    pub(super) damping: f64,
}

/// The step for a radius; the search starts at `damping`.
pub(super) fn step(
    linear: &Elimination,
    gradient: &DVector<f64>,
    d: &DVector<f64>,
    radius: f64,
    damping: f64,
) -> DampedStep {
    let mut step = linear.solve();
    let mut length = d.component_mul(&step).norm();
    let mut excess = length - radius;
    if excess <= SLACK * radius {
        return DampedStep { step, damping: 0.0 };
    }
    let full_rank = linear.rank() == linear.dimension();
    let mut lower = if full_rank {
        newton(linear, d, &step, length, excess, radius)
    } else {
        0.0
    };
    let slope = gradient.component_div(d).norm();
    let mut upper = slope / radius;
    if upper == 0.0 {
        upper = f64::MIN_POSITIVE / radius.min(SLACK);
    }
    let mut damping = damping.max(lower).min(upper);
    if damping == 0.0 {
        damping = slope / length;
    }
    for iteration in 1..=MAX_STEPS {
        if damping == 0.0 {
            damping = (1e-3 * upper).max(f64::MIN_POSITIVE);
        }
        let damped = linear.damped(damping, d);
        step = damped.solve();
        length = d.component_mul(&step).norm();
        let before = excess;
        excess = length - radius;
        let stuck = lower == 0.0 && excess <= before && before < 0.0;
        if excess.abs() <= SLACK * radius || stuck || iteration == MAX_STEPS {
            break;
        }
        let correction = newton(&damped, d, &step, length, excess, radius);
        if excess > 0.0 {
            lower = lower.max(damping);
        } else {
            upper = upper.min(damping);
        }
        damping = lower.max(damping + correction);
    }
    DampedStep { step, damping }
}

fn newton(
    linear: &Elimination,
    d: &DVector<f64>,
    step: &DVector<f64>,
    length: f64,
    excess: f64,
    radius: f64,
) -> f64 {
    let direction = d.component_mul(d).component_mul(step) / length;
    excess / radius / linear.half_solve(&direction).norm_squared()
}
