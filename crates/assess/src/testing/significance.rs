//! How often a gate may be wrong about a calibrator that is right.

use std::fmt;

/// The chance that a gate fails although what it tests holds: the rate of false alarms, one per job in which it runs.
///
/// A job on every commit, 30 commits a day, is alarmed for nothing about once a month at one per mille. Seeds that are
/// the same in every job fail in all or in none until the code changes.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Significance(f64);

impl Significance {
    /// 1 in 100: for a look, not for CI.
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

    /// What is left for each of several gates if the chance that any of them is wrong shall be this one (Bonferroni).
    ///
    /// It holds however the gates depend on one another. Šidák's 1 − (1 − α)^(1/k), which is larger by less than
    /// α/2 in proportion, holds for independent ones, and gates over the same trials are not.
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
