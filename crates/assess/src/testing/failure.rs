//! Failures of the tests of a calibrator, with everything needed to reproduce them.

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
    /// The calibrator returned no calibration.
    #[error("seed {seed}: {calibrator} returned no calibration: {reason}")]
    Calibrator {
        /// Seed of the experiment.
        seed: u64,
        /// Name of the calibrator.
        calibrator: String,
        /// Its error message.
        reason: String,
    },
    /// The calibration is not valid.
    #[error("seed {seed}: {calibrator} returned a calibration that is not valid: {problem}")]
    Invalid {
        /// Seed of the experiment.
        seed: u64,
        /// Name of the calibrator.
        calibrator: String,
        /// The first problem.
        problem: String,
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
        /// The entry of the calibration, as text.
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
        /// The worst beam.
        beam: usize,
        /// The facet.
        facet: String,
        /// The larger of the errors of θ_a and φ, in radians.
        off_rad: f64,
        /// The allowed error, in radians.
        within_rad: f64,
    },
    /// The truth has no deflected element, or no trial has a solved one: there is nothing to judge.
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
    /// A figure over many trials is outside its bounds.
    #[error(
        "{what} is {found:.4} over {trials} trials, outside {low:.4} to {high:.4} (significance {significance}); {meaning}; the worst is seed {seed}, beam {beam}"
    )]
    Gate {
        /// The figure.
        what: &'static str,
        /// Its value.
        found: f64,
        /// Minimum value allowed.
        low: f64,
        /// Maximum value allowed.
        high: f64,
        /// Number of trials.
        trials: usize,
        /// Probability of this failure although the hypothesis holds.
        significance: Significance,
        /// Interpretation.
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
