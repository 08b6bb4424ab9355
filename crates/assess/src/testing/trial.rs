//! Independent trials: an experiment, its calibration, and one element drawn from it.

use super::Failure;
use crate::score::{ElementError, mahalanobis_squared, score};
use crate::study::drawn;
use crate::validate::{Severity, validate_for};
use catoptric_calib::Calibrator;
use catoptric_model::{Calibration, Dataset, Unreadable};
use catoptric_sim::truth::BeamClass;
use catoptric_sim::{Laboratory, Scene, Truth};
use nalgebra::Vector2;
use rayon::prelude::*;

/// The part of an experiment that a gate uses.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    /// Seed of the experiment.
    pub seed: u64,
    /// One of the deflected elements that were solved, drawn by the seed; `None` if there is none.
    pub drawn: Option<Drawn>,
    /// Mean over all of them of (cos φ·δθ, δφ), in radians; `None` if there is none.
    pub mean_error: Option<[f64; 2]>,
}

/// The error of an element, normalized by its stated covariance and by its bound.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drawn {
    /// Beam.
    pub beam: usize,
    /// eᵀP⁻¹e with the stated covariance P, χ² with two degrees of freedom if P is honest; `None` without a covariance.
    pub stated: Option<f64>,
    /// eᵀC⁻¹e with the Cramér–Rao bound C, χ² with two degrees of freedom if the estimate is efficient; `None` if the
    /// experiment has no bound, as without errors.
    pub bound: Option<f64>,
}

/// An experiment with its truth.
pub(super) struct Experiment {
    seed: u64,
    pub(super) dataset: Dataset,
    pub(super) truth: Truth,
}

impl Experiment {
    pub(super) fn of(scene: &Scene, seed: u64) -> Result<Self, Failure> {
        let failed = |source| Failure::Scene { seed, source };
        let laboratory = Laboratory::new(scene, seed).map_err(failed)?;
        Ok(Self {
            seed,
            dataset: laboratory.dataset().map_err(failed)?,
            truth: laboratory.truth().map_err(failed)?,
        })
    }

    pub(super) fn calibrate(&self, calibrator: &(impl Calibrator + ?Sized)) -> Result<Calibration, Failure> {
        let failed = |e: catoptric_calib::CalibError| Failure::Calibrator {
            seed: self.seed,
            calibrator: calibrator.name().to_owned(),
            reason: e.to_string(),
        };
        calibrator.calibrate(&self.dataset).map_err(failed)
    }
}

impl Trial {
    /// Creates a trial from a dataset, its truth, and any calibration, such as a third-party one from a file.
    ///
    /// ```no_run
    /// use catoptric_assess::testing::Trial;
    /// use catoptric_files::{read_dataset, read_json};
    /// use catoptric_model::Calibration;
    /// use catoptric_sim::Truth;
    /// use std::path::Path;
    ///
    /// # fn main() -> Result<(), Box<dyn std::error::Error>> {
    /// let dataset = read_dataset(Path::new("data"))?;
    /// let truth: Truth = read_json("data/truth/truth.json")?;
    /// let calibration: Calibration = read_json("calibration.json")?;
    /// let trial = Trial::of(&dataset, &truth, &calibration)?;
    /// # let _ = trial;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`Unreadable`] if the recording of the dataset can no longer be read.
    pub fn of(dataset: &Dataset, truth: &Truth, calibration: &Calibration) -> Result<Self, Unreadable> {
        let score = score(dataset, calibration, truth)?;
        let scored: Vec<_> = score
            .elements
            .iter()
            .filter(|e| e.class == BeamClass::Deflected)
            .collect();
        let drawn = drawn(&scored, truth.seed).map(|e| Drawn {
            beam: e.beam,
            stated: e.mahalanobis_squared,
            bound: e
                .bound
                .map(|c| mahalanobis_squared(&Vector2::new(e.across, e.up), &c)),
        });
        let n = scored.len() as f64;
        let mean = |of: fn(&ElementError) -> f64| scored.iter().map(|e| of(e)).sum::<f64>() / n;
        Ok(Self {
            seed: truth.seed,
            drawn,
            mean_error: (!scored.is_empty()).then(|| [mean(|e| e.across), mean(|e| e.up)]),
        })
    }
}

/// Runs one trial per seed, in parallel; returns them in the order of the seeds.
///
/// # Errors
/// The failure of the first seed whose experiment cannot be simulated or calibrated.
pub fn trials<C: Calibrator + Sync + ?Sized>(
    scene: &Scene,
    seeds: impl IntoIterator<Item = u64>,
    calibrator: &C,
) -> Result<Vec<Trial>, Failure> {
    let seeds: Vec<u64> = seeds.into_iter().collect();
    let of_one = |seed: &u64| {
        let experiment = Experiment::of(scene, *seed)?;
        let calibration = experiment.calibrate(calibrator)?;
        let problems = validate_for(&calibration, &experiment.dataset.session);
        if let Some(problem) = problems.iter().find(|p| p.severity == Severity::Error) {
            return Err(Failure::Invalid {
                seed: *seed,
                calibrator: calibrator.name().to_owned(),
                problem: problem.to_string(),
            });
        }
        let trial = Trial::of(&experiment.dataset, &experiment.truth, &calibration);
        Ok(trial.expect("a simulated dataset is in memory"))
    };
    let all: Vec<Result<Trial, Failure>> = seeds.par_iter().map(of_one).collect();
    all.into_iter().collect()
}
