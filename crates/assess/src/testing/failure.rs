//! What a test found instead of what it asks for.

use super::Significance;
use catoptric_sim::SimError;

/// Why a test failed: what was found, the bound, the significance, and the seed that reproduces it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// The scene cannot be simulated.
    #[error("seed {seed}: the scene cannot be simulated: {source}")]
    Scene {
        /// Seed of the experiment.
        seed: u64,
        /// Why.
        source: SimError,
    },
    /// The calibrator gave no calibration.
    #[error("seed {seed}: {calibrator} gives no calibration: {reason}")]
    Calibrator {
        /// Seed of the experiment.
        seed: u64,
        /// Its name.
        calibrator: String,
        /// In its words.
        reason: String,
    },
    /// A deflected element has no direction.
    #[error("seed {seed}: beam {beam} is deflected by {facet:?} and {found}")]
    Unsolved {
        /// Seed of the experiment.
        seed: u64,
        /// Beam.
        beam: usize,
        /// The facet.
        facet: String,
        /// What the calibration says of it.
        found: String,
    },
    /// A beam that no mirror deflects has a direction.
    #[error("seed {seed}: beam {beam} is direct and was solved")]
    False {
        /// Seed of the experiment.
        seed: u64,
        /// Beam.
        beam: usize,
    },
    /// A direction is too far from the truth.
    #[error("seed {seed}: beam {beam} of {facet:?} is off by {off_rad:e} rad; {within_rad:e} rad is allowed")]
    Off {
        /// Seed of the experiment.
        seed: u64,
        /// Beam, the worst of all.
        beam: usize,
        /// The facet.
        facet: String,
        /// Larger of the errors of θ_a and φ, in radians.
        off_rad: f64,
        /// What is allowed, in radians.
        within_rad: f64,
    },
    /// The truth has no deflected element, or the trials none that was solved: there is nothing to judge.
    #[error("nothing to judge: {0}")]
    Nothing(String),
    /// An element has a direction without a covariance.
    #[error("seed {seed}: beam {beam} is solved without a covariance, and a gate on honesty needs one")]
    NoCovariance {
        /// Seed of the experiment.
        seed: u64,
        /// Beam.
        beam: usize,
    },
    /// A figure over many trials is outside of its bounds.
    #[error(
        "{what} is {found:.4} over {trials} trials, outside of {low:.4} to {high:.4} (significance {significance}); {meaning}; the worst is seed {seed}, beam {beam}"
    )]
    Gate {
        /// The figure.
        what: &'static str,
        /// Its value.
        found: f64,
        /// Least value allowed.
        low: f64,
        /// Greatest value allowed.
        high: f64,
        /// Trials that it is over.
        trials: usize,
        /// Chance of this although all is well.
        significance: Significance,
        /// What it means.
        meaning: &'static str,
        /// Seed of the trial that contributes most.
        seed: u64,
        /// Beam of that trial.
        beam: usize,
    },
    /// Two runs on the same data differ.
    #[error("seed {seed}: {what}")]
    Different {
        /// Seed of the experiment.
        seed: u64,
        /// Where they first differ.
        what: String,
    },
}
