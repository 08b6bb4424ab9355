//! Gates over independent trials, with the exact bounds of χ² and of Clopper and Pearson.
//!
//! ```text
//! ANEES       A = Σ eᵀP⁻¹e / 2n      2nA is χ² with 2n degrees of freedom if P is honest; two-sided
//! coverage    hits / n               the nominal share is inside the interval of Clopper and Pearson; two-sided
//! efficiency  E = 2n / Σ eᵀC⁻¹e      fails if 2n·least/E exceeds the χ² quantile: E is significantly below `least`
//! ```

use super::trial::Drawn;
use super::{Failure, Significance, Trial};
use crate::study::{mean_bounds, share_bounds};

/// Gate on the mean normalized squared error under the stated covariance.
#[derive(Debug, Clone, Copy)]
pub struct Anees<'t>(&'t [Trial]);

/// Gate on the share of the errors inside their stated ellipses.
#[derive(Debug, Clone, Copy)]
pub struct Coverage<'t> {
    trials: &'t [Trial],
    share: f64,
}

/// Gate on how close the errors are to the Cramér–Rao bound; 1 is optimal.
#[derive(Debug, Clone, Copy)]
pub struct Efficiency<'t>(&'t [Trial]);

/// Squared errors, and the seed and beam of the largest one.
struct Sample {
    squares: Vec<f64>,
    worst: (u64, usize),
}

impl Sample {
    fn of(
        trials: &[Trial],
        square: impl Fn(u64, &Drawn) -> Result<Option<f64>, Failure>,
    ) -> Result<Self, Failure> {
        let mut sample = Self {
            squares: Vec::new(),
            worst: (0, 0),
        };
        let mut largest = f64::NEG_INFINITY;
        for trial in trials {
            let Some(drawn) = &trial.drawn else { continue };
            let Some(square) = square(trial.seed, drawn)? else {
                continue;
            };
            // NaN counts as ruled out by the covariance.
            let square = if square.is_nan() { f64::INFINITY } else { square };
            if square > largest {
                largest = square;
                sample.worst = (trial.seed, drawn.beam);
            }
            sample.squares.push(square);
        }
        if sample.squares.is_empty() {
            return Err(Failure::Nothing(format!(
                "none of {} trials has an element to judge",
                trials.len()
            )));
        }
        Ok(sample)
    }

    fn stated(trials: &[Trial]) -> Result<Self, Failure> {
        Self::of(trials, |seed, d| match d.stated {
            Some(square) => Ok(Some(square)),
            None => Err(Failure::NoCovariance { seed, beam: d.beam }),
        })
    }

    fn mean(&self) -> f64 {
        self.squares.iter().sum::<f64>() / (2.0 * self.squares.len() as f64)
    }

    fn judge(
        &self,
        what: &'static str,
        found: f64,
        [low, high]: [f64; 2],
        significance: Significance,
        meaning: impl Fn(bool) -> &'static str,
    ) -> Result<f64, Failure> {
        if low <= found && found <= high {
            return Ok(found);
        }
        let (seed, beam) = self.worst;
        Err(Failure::Gate {
            what,
            found,
            low,
            high,
            trials: self.squares.len(),
            significance,
            meaning: meaning(found < low),
            seed,
            beam,
        })
    }
}

impl<'t> Anees<'t> {
    /// The gate over some trials.
    pub fn over(trials: &'t [Trial]) -> Self {
        Self(trials)
    }

    /// Returns the figure if it is consistent with an honest covariance.
    ///
    /// # Errors
    /// [`Failure::Gate`] if it is too large (over-confident) or too small (under-confident); [`Failure::NoCovariance`],
    /// [`Failure::Nothing`] if it cannot be computed.
    pub fn gate(self, significance: Significance) -> Result<f64, Failure> {
        let sample = Sample::stated(self.0)?;
        let bounds = mean_bounds(sample.squares.len(), 1.0 - significance.rate());
        let meaning = |low| {
            if low {
                "under-confident: the errors are smaller than stated"
            } else {
                "over-confident: the errors are larger than stated"
            }
        };
        sample.judge("ANEES", sample.mean(), bounds, significance, meaning)
    }

    /// Same as [`gate`](Self::gate), but panics.
    ///
    /// # Panics
    /// With the text of the failure.
    #[track_caller]
    pub fn assert(self, significance: Significance) {
        if let Err(failure) = self.gate(significance) {
            panic!("{failure}");
        }
    }
}

impl<'t> Coverage<'t> {
    /// Coverage of the ellipses that should contain a share of all errors, such as 0.95, over some trials.
    pub fn over(trials: &'t [Trial], share: f64) -> Self {
        Self { trials, share }
    }

    /// Returns the observed share if it is consistent with an honest covariance.
    ///
    /// # Errors
    /// Same as [`Anees::gate`]; the bounds of the failure are the confidence interval of the share inside the ellipses,
    /// and `found` is the nominal share.
    pub fn gate(self, significance: Significance) -> Result<f64, Failure> {
        let sample = Sample::stated(self.trials)?;
        // The quantile of χ² with two degrees of freedom is −2·ln(1 − p).
        let limit = -2.0 * libm::log(1.0 - self.share);
        let (n, hits) = (
            sample.squares.len(),
            sample.squares.iter().filter(|s| **s <= limit).count(),
        );
        let bounds = share_bounds(hits, n, 1.0 - significance.rate());
        let meaning = |low| {
            if low {
                "under-confident: the ellipses contain more errors than they should"
            } else {
                "over-confident: the ellipses contain fewer errors than they should"
            }
        };
        sample.judge(
            "the nominal share inside the ellipses",
            self.share,
            bounds,
            significance,
            meaning,
        )?;
        Ok(hits as f64 / n as f64)
    }

    /// Same as [`gate`](Self::gate), but panics.
    ///
    /// # Panics
    /// With the text of the failure.
    #[track_caller]
    pub fn assert(self, significance: Significance) {
        if let Err(failure) = self.gate(significance) {
            panic!("{failure}");
        }
    }
}

impl<'t> Efficiency<'t> {
    /// The gate over some trials.
    pub fn over(trials: &'t [Trial]) -> Self {
        Self(trials)
    }

    /// Returns the efficiency unless it is significantly below `least`. Trials without a bound are omitted.
    ///
    /// # Errors
    /// [`Failure::Gate`] if it is significantly below; [`Failure::Nothing`] if it cannot be computed.
    pub fn gate(self, least: f64, significance: Significance) -> Result<f64, Failure> {
        let sample = Sample::of(self.0, |_, d| Ok(d.bound))?;
        // One-sided: the upper of two bounds of twice the significance.
        let [_, upper] = mean_bounds(sample.squares.len(), 1.0 - 2.0 * significance.rate());
        let bounds = [least / upper, f64::INFINITY];
        let meaning = |_| "inefficient: the data allow smaller errors";
        sample.judge("efficiency", 1.0 / sample.mean(), bounds, significance, meaning)
    }

    /// Same as [`gate`](Self::gate), but panics.
    ///
    /// # Panics
    /// With the text of the failure.
    #[track_caller]
    pub fn assert(self, least: f64, significance: Significance) {
        if let Err(failure) = self.gate(least, significance) {
            panic!("{failure}");
        }
    }
}
