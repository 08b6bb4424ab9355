//! Honesty of the stated covariance: whether errors are as large as stated, judged by NEES and coverage together.

use super::Score;
use serde::Serialize;

/// Mean NEES above which, and coverage below which, a covariance is reported as too small without failing the score.
const OVER_CONFIDENT: (f64, f64) = (2.0, 0.85);
/// Mean NEES below which a covariance is reported as too large: if all elements share one error, an honest covariance is
/// below it in one run of ten.
const UNDER_CONFIDENT_NEES: f64 = 0.1;
/// Error below which only rounding is to blame, in degrees.
pub(super) const NEGLIGIBLE_DEG: f64 = 1e-6;

/// First words of the warnings.
pub(super) const OVER: &str = "over-confident";
pub(super) const UNDER: &str = "under-confident";

/// Whether errors are as large as the stated covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Honesty {
    /// They are, as far as one run can show.
    Honest,
    /// They are larger.
    OverConfident,
    /// They are much smaller.
    UnderConfident,
}

impl Honesty {
    /// The words used in tables and on pages.
    pub fn words(self) -> &'static str {
        match self {
            Self::Honest => "honest",
            Self::OverConfident => OVER,
            Self::UnderConfident => UNDER,
        }
    }
}

/// Judges the honesty of a score; `None` without a covariance, or if the errors are only numerical.
pub(super) fn of(score: &Score) -> Option<Honesty> {
    let (nees, coverage) = (score.nees_mean, score.coverage_95);
    if nees.is_nan() {
        None
    } else if nees > OVER_CONFIDENT.0 || coverage < OVER_CONFIDENT.1 {
        Some(Honesty::OverConfident)
    } else if score.per_axis_rms_deg <= NEGLIGIBLE_DEG {
        None
    } else if nees < UNDER_CONFIDENT_NEES {
        Some(Honesty::UnderConfident)
    } else {
        Some(Honesty::Honest)
    }
}

/// Describes how over-confident a score is.
pub(super) fn over_confident(score: &Score) -> String {
    let percent = 100.0 * score.coverage_95;
    if score.nees_mean.is_finite() {
        format!(
            "{OVER}: errors are {:.1} times what it states; the mean normalized squared error is {:.2} where 1 is honest, and {percent:.0} % of the errors are inside their 95 % ellipses",
            score.nees_mean.sqrt(),
            score.nees_mean
        )
    } else {
        format!(
            "{OVER}: it rules out errors that were made; {percent:.0} % of the errors are inside their 95 % ellipses"
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
