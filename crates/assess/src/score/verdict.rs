//! What a score says in a word: its verdict, which follows from its gates, and the honesty of the stated covariance.

use super::gate::{Gate, Outcome};
use serde::Serialize;

/// First words of the warnings.
pub(super) const OVER: &str = "over-confident";
pub(super) const UNDER: &str = "under-confident";
pub(super) const DOUBTFUL: &str = "doubtful";

/// Outcome of a score.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Every gate is met.
    Pass,
    /// A gate is not met.
    Fail,
    /// No gate fails, but one cannot be judged: no covariance is stated, or nothing is deflected.
    NotJudged,
    /// There is no truth, and the residuals on boards and walls are as large as they may be.
    Blind,
    /// The calibration is not valid.
    Invalid,
}

impl Verdict {
    /// The word used in files and on pages.
    pub fn word(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::NotJudged => "not_judged",
            Self::Blind => "blind",
            Self::Invalid => "invalid",
        }
    }

    /// The worse of two verdicts: invalid, failed, not judged, then the rest.
    #[must_use]
    pub fn worse(self, other: Self) -> Self {
        let rank = |verdict: Self| match verdict {
            Self::Invalid => 3,
            Self::Fail => 2,
            Self::NotJudged => 1,
            Self::Pass | Self::Blind => 0,
        };
        if rank(other) > rank(self) { other } else { self }
    }

    /// Exit code of a program that ends with this verdict.
    pub fn exit_code(self) -> u8 {
        match self {
            Self::Pass | Self::Blind => 0,
            Self::Fail | Self::NotJudged => 1,
            Self::Invalid => 2,
        }
    }
}

/// Whether errors are as large as the stated covariance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Honesty {
    /// They are, as far as one run can show.
    Honest,
    /// They are larger than an honest covariance has them in one run of twenty, but not large enough to be sure.
    Doubtful,
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
            Self::Doubtful => DOUBTFUL,
            Self::OverConfident => OVER,
            Self::UnderConfident => UNDER,
        }
    }
}

/// The verdict that follows from some gates.
pub(super) fn verdict(gates: &[Gate], has_truth: bool) -> Verdict {
    let any = |outcome| gates.iter().any(|g| g.outcome == outcome);
    if any(Outcome::Invalid) {
        Verdict::Invalid
    } else if any(Outcome::Fail) {
        Verdict::Fail
    } else if any(Outcome::NotJudged) {
        Verdict::NotJudged
    } else if has_truth {
        Verdict::Pass
    } else {
        Verdict::Blind
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_worst_outcome_decides() {
        let gate = |outcome| Gate::without("a", outcome, "");
        for (outcomes, expected) in [
            (&[Outcome::Pass, Outcome::NotTested][..], Verdict::Pass),
            (&[Outcome::Pass, Outcome::NotJudged], Verdict::NotJudged),
            (&[Outcome::NotJudged, Outcome::Fail], Verdict::Fail),
            (&[Outcome::Fail, Outcome::Invalid], Verdict::Invalid),
        ] {
            let gates: Vec<Gate> = outcomes.iter().map(|o| gate(*o)).collect();
            assert_eq!(verdict(&gates, true), expected);
        }
        assert_eq!(verdict(&[gate(Outcome::Pass)], false), Verdict::Blind);
    }
}
