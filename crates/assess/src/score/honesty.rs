//! Whether errors are as large as the covariance stated for them says: judged by NEES and coverage together.

use super::Score;
use serde::Serialize;

/// Mean NEES above which, and coverage below which, a covariance is called too small without failing the score.
const OVER_CONFIDENT: (f64, f64) = (2.0, 0.85);
/// Mean NEES below which a covariance is called too large: if all elements share one error, an honest one is there in
/// one run of ten.
const UNDER_CONFIDENT_NEES: f64 = 0.1;
/// Below this an error is numerical, and nothing is at fault for it, in degrees.
pub(super) const NEGLIGIBLE_DEG: f64 = 1e-6;

/// How the warnings begin.
pub(super) const OVER: &str = "over-confident";
pub(super) const UNDER: &str = "under-confident";

/// Whether errors are as large as the stated covariance says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Honesty {
    /// They are, as far as one run tells.
    Honest,
    /// They are larger.
    OverConfident,
    /// They are much smaller.
    UnderConfident,
}

impl Honesty {
    /// The words that tables and pages use.
    pub fn words(self) -> &'static str {
        match self {
            Self::Honest => "honest",
            Self::OverConfident => OVER,
            Self::UnderConfident => UNDER,
        }
    }
}

/// The honesty of a score; `None` without a covariance to judge, or if the errors are numerical.
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

/// How over-confident, in words.
pub(super) fn over_confident(score: &Score) -> String {
    let percent = 100.0 * score.coverage_95;
    if score.nees_mean.is_finite() {
        format!(
            "{OVER}: errors are {:.1} times what it states; the mean normalised squared error is {:.2} where 1 is honest, and {percent:.0} % of the errors are inside their 95 % ellipses",
            score.nees_mean.sqrt(),
            score.nees_mean
        )
    } else {
        format!(
            "{OVER}: it rules out errors that were made; {percent:.0} % of the errors are inside their 95 % ellipses"
        )
    }
}

/// How under-confident, in words.
pub(super) fn under_confident(score: &Score) -> String {
    format!(
        "{UNDER}: errors are {:.2} times what it states; the mean normalised squared error is {:.2} where 1 is honest",
        score.nees_mean.sqrt(),
        score.nees_mean
    )
}
