//! Significance: the rate of false alarms of a gate.

use std::fmt;

/// The probability that a gate fails although its hypothesis holds: the rate of false alarms per job that runs it.
///
/// At one per mille, a job that runs on every commit, 30 commits a day, has about one false alarm a month. With the same
/// seeds in every job, either all jobs fail or none until the code changes.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Significance(f64);

impl Significance {
    /// 1 in 100: for interactive use, not for CI.
    pub const PER_CENT: Self = Self(1e-2);
    /// 1 in 1000.
    pub const PER_MILLE: Self = Self(1e-3);
    /// 1 in 1 000 000: for many gates and many commits.
    pub const PER_MILLION: Self = Self(1e-6);

    /// Another rate; `None` unless it is above 0 and below 1.
    pub fn new(rate: f64) -> Option<Self> {
        (rate > 0.0 && rate < 1.0).then_some(Self(rate))
    }

    /// The rate.
    pub fn rate(self) -> f64 {
        self.0
    }

    /// Returns the significance of each of several gates if the probability of any false alarm is to be this one
    /// (Bonferroni).
    ///
    /// It holds whatever the dependence between the gates. Šidák's 1 − (1 − α)^(1/k), which is larger by a relative
    /// difference below α/2, holds for independent gates only, and gates over the same trials are not independent.
    ///
    /// ```
    /// use catoptric_assess::testing::Significance;
    /// assert_eq!(Significance::PER_CENT.among(4).rate(), 0.0025);
    /// ```
    #[must_use]
    pub fn among(self, gates: usize) -> Self {
        Self(self.0 / gates.max(1) as f64)
    }
}

impl fmt::Display for Significance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:e}", self.0)
    }
}
