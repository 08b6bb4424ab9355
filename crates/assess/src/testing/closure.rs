//! Closure test: without errors, the estimate of every deflected element equals the truth.

use super::Failure;
use super::trial::Experiment;
use crate::score::wrap;
use catoptric_calib::Calibrator;
use catoptric_model::{Calibration, Status};
use catoptric_sim::truth::BeamClass;
use catoptric_sim::{Scene, Truth};

/// Simulates a scene, which should be [without errors](super::without_errors), calibrates it, and compares both angles of
/// every deflected element with the truth. Returns the largest error, in radians.
///
/// ```
/// use catoptric_calib::Method;
/// use catoptric_assess::testing::{closure, without_errors};
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let scene = without_errors(toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?);
/// assert!(closure(&scene, 1, &Method::Beam, 1e-9)? < 1e-9);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Failure::Unsolved`], [`Failure::False`] or [`Failure::Off`] for the worst element; any failure of the experiment.
pub fn closure(
    scene: &Scene,
    seed: u64,
    calibrator: &(impl Calibrator + ?Sized),
    within_rad: f64,
) -> Result<f64, Failure> {
    let experiment = Experiment::of(scene, seed)?;
    let calibration = experiment.calibrate(calibrator)?;
    closure_of(&experiment.truth, &calibration, within_rad)
}

/// Same as [`closure`], for an existing calibration, such as one from a file.
///
/// # Errors
/// Same as [`closure`].
pub fn closure_of(truth: &Truth, calibration: &Calibration, within_rad: f64) -> Result<f64, Failure> {
    let seed = truth.seed;
    let mut worst: Option<(f64, usize, String)> = None;
    for known in &truth.beams {
        let found = calibration.beam(known.beam);
        let is_solved = found.is_some_and(|f| f.status == Status::Solved);
        if known.status == BeamClass::Direct && is_solved {
            let beam = known.beam;
            return Err(Failure::False { seed, beam });
        }
        let (BeamClass::Deflected, Some(actual)) = (known.status, known.deflection()) else {
            continue;
        };
        let facet = known.facets.first().cloned().unwrap_or_default();
        let Some(estimate) = found.filter(|_| is_solved).and_then(|f| f.deflection()) else {
            let found = found.map_or_else(
                || "is missing".to_owned(),
                |f| {
                    let reason = f.reason.as_deref().unwrap_or("no reason given");
                    format!("has no direction: {}, {reason}", f.status.word())
                },
            );
            return Err(Failure::Unsolved {
                seed,
                beam: known.beam,
                facet,
                found,
            });
        };
        let across = wrap(estimate.azimuth - actual.azimuth).abs();
        let off = across.max((estimate.elevation - actual.elevation).abs());
        // NaN is worse than any number.
        let off = if off.is_nan() { f64::INFINITY } else { off };
        if worst.as_ref().is_none_or(|(w, ..)| off > *w) {
            worst = Some((off, known.beam, facet));
        }
    }
    let Some((off_rad, beam, facet)) = worst else {
        return Err(Failure::Nothing("the truth has no deflected element".to_owned()));
    };
    if off_rad <= within_rad {
        return Ok(off_rad);
    }
    Err(Failure::Off {
        seed,
        beam,
        facet,
        off_rad,
        within_rad,
    })
}

/// Same as [`closure`], but panics.
///
/// # Panics
/// With the text of the failure.
#[track_caller]
pub fn assert_closure(scene: &Scene, seed: u64, calibrator: &(impl Calibrator + ?Sized), within_rad: f64) {
    if let Err(failure) = closure(scene, seed, calibrator, within_rad) {
        panic!("{failure}");
    }
}

/// Same as [`closure_of`], but panics.
///
/// # Panics
/// With the text of the failure.
#[track_caller]
pub fn assert_closure_of(truth: &Truth, calibration: &Calibration, within_rad: f64) {
    if let Err(failure) = closure_of(truth, calibration, within_rad) {
        panic!("{failure}");
    }
}
