//! Honesty of the stated covariance: whether errors are as large as stated.
//!
//! Elements share errors, so one run shows little: each label has a false-alarm rate that holds however they depend on
//! each other, and what is in between is called doubtful.

use super::bound::bounds;
use super::gate::{ENOUGH, mean_limit, worst_limit};
use super::verdict::{DOUBTFUL, Honesty, OVER, UNDER};
use super::{ElementError, Score};

/// Mean NEES above which a covariance is doubtful: −ln 0.05. An honest one exceeds it in at most one run of twenty.
const DOUBTFUL_NEES: f64 = 2.995_732_273_553_991;
/// Mean NEES below which a covariance is reported as too large: if all elements share one error, an honest covariance is
/// below it in one run of ten.
const UNDER_CONFIDENT_NEES: f64 = 0.1;
/// Mean NEES from which on a covariance below the limit of the experiment counts as too small.
const BEYOND_LIMIT_NEES: f64 = 2.0;
/// Smallest standard deviation that a calibration can honestly state, relative to the limit of the experiment: beliefs
/// may be off, but hardly by a factor of two.
pub(super) const LEAST_CLAIM: f64 = 0.5;
/// Error below which only rounding is to blame, in degrees.
pub(super) const NEGLIGIBLE_DEG: f64 = 1e-6;

/// Judges the honesty of a score; `None` unless nearly all that is scored states a covariance, or if the errors are only
/// numerical.
pub(super) fn of(score: &Score) -> Option<Honesty> {
    let nees = score.nees_mean;
    if nees.is_nan() || score.stated < ENOUGH {
        None
    } else if nees > mean_limit(2.0)
        || worst(score).is_some_and(|(m, limit, _)| m > limit)
        || claims_too_much(score)
    {
        Some(Honesty::OverConfident)
    } else if score.per_axis_rms_deg <= NEGLIGIBLE_DEG {
        None
    } else if nees < UNDER_CONFIDENT_NEES {
        Some(Honesty::UnderConfident)
    } else if nees > DOUBTFUL_NEES {
        Some(Honesty::Doubtful)
    } else {
        Some(Honesty::Honest)
    }
}

/// The largest eᵀP⁻¹e of the scored elements, the largest one allowed, and its element.
pub(super) fn worst(score: &Score) -> Option<(f64, f64, &ElementError)> {
    let stated = || score.scored().filter_map(|e| Some((e.mahalanobis_squared?, e)));
    let (square, element) = stated().max_by(|(a, _), (b, _)| a.total_cmp(b))?;
    Some((square, worst_limit(2.0, stated().count()), element))
}

/// Stated standard deviation over the limit of the experiment, as root mean squares; NaN without either.
pub(super) fn claim(score: &Score) -> f64 {
    let (mut stated, mut limit) = (0.0, 0.0);
    for e in score.scored() {
        if let (Some([across, up]), Some(bound)) = (e.sigma, e.bound.filter(bounds)) {
            stated += across * across + up * up;
            limit += bound.trace();
        }
    }
    (stated / limit).sqrt()
}

/// Whether less than half of the smallest possible uncertainty is stated, and the errors are larger than that.
pub(super) fn claims_too_much(score: &Score) -> bool {
    claim(score) < LEAST_CLAIM && score.nees_mean > BEYOND_LIMIT_NEES
}

/// Describes how over-confident a score is.
pub(super) fn over_confident(score: &Score) -> String {
    format!("{OVER}: {}", size(score))
}

/// Describes how doubtful a score is, with the largest probability that an honest covariance has such errors.
pub(super) fn doubtful(score: &Score) -> String {
    format!(
        "{DOUBTFUL}: {}; an honest covariance has such errors in at most {:.1} % of all runs, so judge it over seeds",
        size(score),
        100.0 * libm::exp(-score.nees_mean)
    )
}

fn size(score: &Score) -> String {
    let percent = 100.0 * score.coverage_95;
    if score.nees_mean.is_finite() {
        format!(
            "errors are {:.1} times what it states; the mean normalized squared error is {:.2} where 1 is honest, and {percent:.0} % of the errors are inside their 95 % ellipses",
            score.nees_mean.sqrt(),
            score.nees_mean
        )
    } else {
        format!(
            "it rules out errors that were made; {percent:.0} % of the errors are inside their 95 % ellipses"
        )
    }
}

/// Describes how under-confident a score is.
pub(super) fn under_confident(score: &Score) -> String {
    format!(
        "{UNDER}: errors are {:.2} times what it states; the mean normalized squared error is {:.2} where 1 is honest",
        score.nees_mean.sqrt(),
        score.nees_mean
    )
}
