//! The errors that remain after calibration: their bound, and those of simulated experiments.

use crate::layout::Accuracy;
use catoptric_assess::study::{Contestant, Job, Run, Study, run};
use catoptric_calib::Method;
use catoptric_sim::{Scene, SimError};
use serde::Serialize;

/// The smallest error that any unbiased calibration from the scene's own boards can have, over several structures.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Bounds {
    /// Number of structures with a bound.
    pub structures: usize,
    /// Number of structures without.
    pub without: usize,
    /// Root mean square over elements and structures, in degrees per axis.
    pub per_axis_deg: Option<f64>,
    /// The same as an angle between directions, in degrees: √2 times the per-axis value.
    pub direction_rms_deg: Option<f64>,
    /// Largest bound of an element, in degrees per axis.
    pub worst_per_axis_deg: Option<f64>,
    /// Maximum number of elements of a structure that the boards leave open.
    pub open_worst: Option<usize>,
}

/// Errors of simulated experiments, calibrated by `joint`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibrated {
    /// Number of structures that could be calibrated.
    pub structures: usize,
    /// Number of structures that could not.
    pub failed: usize,
    /// Root mean square over elements and structures, in degrees per axis.
    pub per_axis_deg: Option<f64>,
    /// The same as an angle between directions, in degrees.
    pub direction_rms_deg: Option<f64>,
    /// The bound of the same experiments, in degrees per axis.
    pub bound_per_axis_deg: Option<f64>,
    /// Mean over the structures of error² over bound².
    pub ratio: Option<f64>,
    /// Its standard error; `None` for a single structure.
    pub ratio_se: Option<f64>,
}

/// Simulates the scene's experiment on the structure as built under a seed, calibrates it by `joint` and scores it.
///
/// # Errors
/// A scene that cannot be set up. A failed calibration is a result, not an error.
pub fn calibrate(scene: &Scene, seed: u64) -> Result<Run, SimError> {
    let study = Study::of_scene(scene.clone(), 1, vec![Contestant::Method(Method::Joint)]);
    let runs = run(&study, Job { cell: 0, seed })?;
    // One contestant makes one run.
    Ok(runs[0].clone())
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (count, sum) = values.fold((0.0, 0.0), |(n, sum), v| (n + 1.0, sum + v));
    (count > 0.0).then(|| sum / count)
}

impl Bounds {
    /// Combines the predictions for several structures.
    pub fn of(predicted: &[Accuracy]) -> Self {
        let bounds = || predicted.iter().filter_map(|a| a.per_axis_deg);
        let per_axis_deg = mean(bounds().map(|b| b * b)).map(f64::sqrt);
        Self {
            structures: bounds().count(),
            without: predicted.len() - bounds().count(),
            per_axis_deg,
            direction_rms_deg: per_axis_deg.map(|b| b * std::f64::consts::SQRT_2),
            worst_per_axis_deg: predicted
                .iter()
                .filter_map(|a| a.worst_per_axis_deg)
                .reduce(f64::max),
            open_worst: predicted.iter().map(|a| a.open).max(),
        }
    }
}

impl Calibrated {
    /// Combines the results for several structures.
    pub fn of(runs: &[Run]) -> Self {
        let solved = || runs.iter().filter(|r| r.square.is_finite());
        let root = |of: fn(&Run) -> f64| mean(solved().map(of)).map(|square| square.sqrt().to_degrees());
        let per_axis_deg = root(|r| r.square);
        let ratios: Vec<f64> = solved().map(|r| r.square / r.bound_square).collect();
        let ratio = mean(ratios.iter().copied());
        let spread = |ratio: f64| {
            let squares: f64 = ratios.iter().map(|r| (r - ratio).powi(2)).sum();
            let n = ratios.len() as f64;
            (n > 1.0).then(|| (squares / (n - 1.0) / n).sqrt())
        };
        Self {
            structures: solved().count(),
            failed: runs.len() - solved().count(),
            per_axis_deg,
            direction_rms_deg: per_axis_deg.map(|e| e * std::f64::consts::SQRT_2),
            bound_per_axis_deg: root(|r| r.bound_square),
            ratio,
            ratio_se: ratio.and_then(spread),
        }
    }
}
