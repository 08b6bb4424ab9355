//! Gates: what a score has to meet, each with what was found and what is allowed.
//!
//! A gate on a statistic states its false-alarm rate: the largest probability, over all dependences between elements,
//! that a calibration with honest covariances does not meet it. The elements of one experiment share errors, in the worst
//! case all of them one and the same; the mean of their normalized squares is then a single χ²/k with k degrees of
//! freedom, and no dependence gives the mean a heavier upper tail. For the worst of n elements the bound is Bonferroni's.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF};

/// False-alarm rate of each gate on a statistic: one in two hundred.
pub const SIGNIFICANCE: f64 = 0.005;

/// Share of the elements that are scored which must state a covariance, and a distance.
pub const ENOUGH: f64 = 0.9;

/// Share of the knowable elements that must be solved unless another is given.
pub const MIN_SOLVED: f64 = 0.9;

/// What became of a gate.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// It is met.
    Pass,
    /// It is not met.
    Fail,
    /// It cannot be judged, because the calibration does not state what it takes.
    NotJudged,
    /// It does not apply.
    NotTested,
    /// The calibration is not valid.
    Invalid,
}

/// One gate.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Gate {
    /// Its name: a word, or the figure that was required.
    pub name: String,
    /// Whether it is met.
    pub outcome: Outcome,
    /// What was found; NaN here and `null` in JSON if there is no number.
    pub found: f64,
    /// Largest value allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_most: Option<f64>,
    /// Smallest value allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub at_least: Option<f64>,
    /// Largest probability that an honest calibration does not meet it; `None` for what is not a statistic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarm_rate: Option<f64>,
    /// What was found and what is allowed, as text.
    pub message: String,
}

impl Gate {
    /// A gate that is met or not.
    pub(super) fn of(name: &str, met: bool, found: f64, message: String) -> Self {
        Self {
            name: name.to_owned(),
            outcome: if met { Outcome::Pass } else { Outcome::Fail },
            found,
            at_most: None,
            at_least: None,
            false_alarm_rate: None,
            message,
        }
    }

    /// A gate that is met up to a largest value, infinity included; NaN meets none.
    pub(super) fn at_most(name: &str, found: f64, limit: f64, message: String) -> Self {
        Self {
            at_most: Some(limit),
            ..Self::of(name, found <= limit, found, message)
        }
    }

    /// A gate that is met from a smallest value on.
    pub(super) fn at_least(name: &str, found: f64, limit: f64, message: String) -> Self {
        Self {
            at_least: Some(limit),
            ..Self::of(name, found >= limit, found, message)
        }
    }

    /// A gate with another outcome.
    pub(super) fn without(name: &str, outcome: Outcome, message: impl Into<String>) -> Self {
        Self {
            outcome,
            ..Self::of(name, true, f64::NAN, message.into())
        }
    }

    pub(super) fn with_rate(mut self, rate: f64) -> Self {
        self.false_alarm_rate = Some(rate);
        self
    }

    /// The sentence for a reader if it is not met: how it counts, and why.
    pub(super) fn sentence(&self) -> Option<String> {
        let counts = match self.outcome {
            Outcome::Pass | Outcome::NotTested => return None,
            Outcome::Fail => "fails",
            Outcome::NotJudged => "not judged",
            Outcome::Invalid => "invalid",
        };
        Some(format!("{counts}: {}", self.message))
    }
}

/// The value that the mean of normalized squared errors, each with mean 1 and `freedom` degrees of freedom, exceeds with
/// probability [`SIGNIFICANCE`] if all of them are one and the same error.
pub fn mean_limit(freedom: f64) -> f64 {
    exceeded(freedom, SIGNIFICANCE) / freedom
}

/// The value that the largest of n squared errors, each χ² with `freedom` degrees of freedom, exceeds with at most
/// probability [`SIGNIFICANCE`], however they depend on each other.
pub fn worst_limit(freedom: f64, n: usize) -> f64 {
    exceeded(freedom, SIGNIFICANCE / n.max(1) as f64)
}

/// The value that the median of squared errors of one degree of freedom exceeds with at most probability
/// [`SIGNIFICANCE`]: at least half of them have to (Markov).
pub fn median_limit() -> f64 {
    worst_median_limit(1)
}

/// The same for the largest of n medians.
pub fn worst_median_limit(n: usize) -> f64 {
    exceeded(1.0, 0.5 * SIGNIFICANCE / n.max(1) as f64)
}

/// The value that χ² exceeds with some probability.
fn exceeded(freedom: f64, probability: f64) -> f64 {
    ChiSquared::new(freedom).map_or(f64::NAN, |d| d.inverse_cdf(1.0 - probability))
}

/// A gate on the share of the scored elements that state something; without any there is nothing to judge.
pub(super) fn shares(name: &str, what: &str, with: usize, scored: usize) -> Gate {
    let words = |with: usize| {
        format!(
            "{with} of {scored} scored elements state {what}; at least {:.0} % are required",
            100.0 * ENOUGH
        )
    };
    match (with, scored) {
        (_, 0) => Gate::without(name, Outcome::NotTested, "no element is scored"),
        (0, _) => Gate {
            found: 0.0,
            at_least: Some(ENOUGH),
            ..Gate::without(name, Outcome::NotJudged, words(0))
        },
        (with, scored) => Gate::at_least(name, with as f64 / scored as f64, ENOUGH, words(with)),
    }
}

/// "1 element is", "2 elements are".
pub fn elements(count: usize, one: &str, many: &str) -> String {
    if count == 1 {
        format!("1 element {one}")
    } else {
        format!("{count} elements {many}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_the_quantiles_of_the_tables() {
        // −ln 0.005 for two degrees of freedom; χ² of 1 and 6 at 99.5 %: 7.879 and 18.548.
        assert!((mean_limit(2.0) - 5.298).abs() < 1e-3);
        assert!((mean_limit(1.0) - 7.879).abs() < 1e-3);
        assert!((6.0 * mean_limit(6.0) - 18.548).abs() < 1e-3);
        // −2·ln(0.005/400).
        assert!((worst_limit(2.0, 400) - 22.580).abs() < 1e-2);
        assert!((median_limit() - 9.141).abs() < 1e-3);
        // A two-sided tail of 0.0025/8 = 0.0003125: the square of the normal quantile 3.6049 at 0.99984375.
        assert!((worst_median_limit(8) - 12.995).abs() < 1e-2);
    }
}
