//! One experiment: simulated, calibrated by every contestant, scored.

use super::oracle::Oracle;
use super::{Contestant, ElementAngles, Job, Study};
use crate::score::{ElementError, Knowable, Verdict, knowable, score_by};
use catoptric_calib::{Calibrator, Method, calibrate_until};
use catoptric_model::bias::DistanceBias;
use catoptric_model::{Calibration, Dataset, Deflection, RangeBias, Stop};
use catoptric_sim::truth::BeamClass;
use catoptric_sim::{Laboratory, SimError, Truth};
use std::time::Instant;

/// Result of one contestant in one experiment. Angles are in radians; figures that do not exist are NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Index of the cell.
    pub cell: usize,
    /// Seed.
    pub seed: u64,
    /// Name of the contestant.
    pub method: String,
    /// Deflected, unsplit elements that were solved.
    pub solved: usize,
    /// Such elements with a reason instead of a result.
    pub abstained: usize,
    /// Such elements with neither.
    pub missed: usize,
    /// Solved elements that are not deflected.
    pub wrong: usize,
    /// Mean square per-axis error in the sensor frame, in rad².
    pub square: f64,
    /// Mean square per-axis error in the room frame, in rad².
    pub room_square: f64,
    /// Mean of the limit on `square`, over the same elements.
    pub bound_square: f64,
    /// Mean over the elements of eᵀP⁻¹e/2.
    pub nees: f64,
    /// Beam of one element, selected by the seed.
    pub beam: usize,
    /// Its error cos φ·δθ.
    pub across: f64,
    /// Its error δφ.
    pub up: f64,
    /// Its eᵀP⁻¹e.
    pub mahalanobis_squared: f64,
    /// Share of all its elements that are inside their stated 95 % ellipses.
    pub inside_95: f64,
    /// The warnings of the calibration, one after the other.
    pub warnings: String,
    /// Why there is no calibration; empty otherwise.
    pub failure: String,
    /// Duration, in milliseconds; not part of tables that are compared.
    pub milliseconds: f64,
}

/// Runs every contestant on one experiment.
///
/// # Errors
/// The scene cannot be set up. A contestant that fails is a result, not an error.
pub fn run(study: &Study, job: Job) -> Result<Vec<Run>, SimError> {
    Ok(run_with_elements(study, job)?.0)
}

/// Same as [`run`], and the angles of every scored element.
///
/// # Errors
/// Same as [`run`].
pub fn run_with_elements(study: &Study, job: Job) -> Result<(Vec<Run>, Vec<ElementAngles>), SimError> {
    let experiment = Experiment::of(study, job)?;
    let mut runs = Vec::with_capacity(study.contestants.len());
    let mut elements = Vec::new();
    for contestant in &study.contestants {
        let begin = Instant::now();
        let calibration = experiment.calibrate(contestant, &study.stop);
        let milliseconds = begin.elapsed().as_secs_f64() * 1e3;
        let (run, angles) = experiment.judge(contestant, job, calibration, milliseconds);
        runs.push(run);
        elements.extend(angles);
    }
    Ok((runs, elements))
}

/// Why no recording can fail to be read.
const IN_MEMORY: &str = "a simulated dataset is in memory";

struct Experiment {
    /// Records the dataset for programs.
    #[cfg(feature = "recording")]
    laboratory: Laboratory,
    dataset: Dataset,
    truth: Truth,
    knowable: Knowable,
}

impl Experiment {
    fn of(study: &Study, job: Job) -> Result<Self, SimError> {
        let laboratory = Laboratory::new(&study.cells[job.cell].scene, job.seed)?;
        let (dataset, truth) = (laboratory.dataset_until(&study.stop)?, laboratory.truth()?);
        study.stop.check()?;
        Ok(Self {
            knowable: knowable(&dataset, &truth).expect(IN_MEMORY),
            #[cfg(feature = "recording")]
            laboratory,
            dataset,
            truth,
        })
    }

    fn calibrate(&self, contestant: &Contestant, stop: &Stop) -> Result<Calibration, String> {
        let words = |e: catoptric_calib::CalibError| e.to_string();
        let options = catoptric_calib::Options::default();
        let by_method = |method: Method, dataset: &Dataset| {
            calibrate_until(dataset, method, &options, stop).map_err(words)
        };
        stop.check().map_err(|e| e.to_string())?;
        match contestant {
            Contestant::Method(method) => by_method(*method, &self.dataset),
            Contestant::Uncorrected(method) => {
                let mut dataset = self.dataset.clone();
                let believed = &mut dataset.session.believed;
                // Without corrections, the believed standard deviations must cover the biases themselves.
                let nodes = &believed.bias.distance.error_mm;
                let largest = nodes.iter().fold(0.0, |l: f64, e| l.max(e.abs()));
                believed.distance_bias_sd_mm = libm::hypot(believed.distance_bias_sd_mm, largest);
                believed.angle_gain_sd_mm =
                    libm::hypot(believed.angle_gain_sd_mm, believed.bias.angle.gain_mm);
                believed.bias = RangeBias {
                    distance: DistanceBias {
                        error_mm: vec![0.0; nodes.len()],
                        ..believed.bias.distance.clone()
                    },
                    ..RangeBias::default()
                };
                // The bare distances were corrected by the biases of step 1: they share no error with readings that are not.
                dataset.session.bare_structure.scanned = false;
                by_method(*method, &dataset)
            }
            Contestant::Oracle => {
                let truth = self.truth.clone();
                Oracle { truth }.calibrate(&self.dataset).map_err(words)
            }
            #[cfg(feature = "recording")]
            Contestant::Program(program) => program.calibrate(&self.laboratory, stop),
            Contestant::Own(calibrator) => calibrator.calibrate(&self.dataset).map_err(words),
        }
    }

    fn judge(
        &self,
        contestant: &Contestant,
        job: Job,
        calibration: Result<Calibration, String>,
        milliseconds: f64,
    ) -> (Run, Vec<ElementAngles>) {
        let mut run = Run {
            cell: job.cell,
            seed: job.seed,
            method: contestant.name(),
            solved: 0,
            abstained: 0,
            missed: 0,
            wrong: 0,
            square: f64::NAN,
            room_square: f64::NAN,
            bound_square: f64::NAN,
            nees: f64::NAN,
            beam: 0,
            across: f64::NAN,
            up: f64::NAN,
            mahalanobis_squared: f64::NAN,
            inside_95: f64::NAN,
            warnings: String::new(),
            failure: String::new(),
            milliseconds,
        };
        let calibration = match calibration {
            Ok(calibration) => calibration,
            Err(failure) => {
                run.failure = failure;
                return (run, Vec::new());
            }
        };
        let known = Some((&self.truth, &self.knowable));
        let score = score_by(&self.dataset, &calibration, known).expect(IN_MEMORY);
        if score.verdict == Verdict::Invalid {
            run.failure = score.reasons().join("; ");
            return (run, Vec::new());
        }
        run.inside_95 = score.coverage_95;
        run.warnings = calibration.warnings.join("; ");
        run.solved = score.beams.solved;
        run.abstained = score.beams.abstained;
        run.missed = score.beams.missed.unwrap_or_default();
        run.wrong = score.beams.wrong.unwrap_or_default();
        run.square = score.per_axis_rms_deg.to_radians().powi(2);
        run.room_square = score.per_axis_rms_room_deg.to_radians().powi(2);
        run.bound_square = score.crlb_per_axis_deg.to_radians().powi(2);
        run.nees = score.nees_mean;
        let scored: Vec<&ElementError> = score
            .elements
            .iter()
            .filter(|e| e.class == BeamClass::Deflected)
            .collect();
        if let Some(one) = drawn(&scored, job.seed) {
            run.beam = one.beam;
            run.across = one.across;
            run.up = one.up;
            run.mahalanobis_squared = one.mahalanobis_squared.unwrap_or(f64::NAN);
        }
        let pair = |d: &Deflection| [d.azimuth.to_degrees(), d.elevation.to_degrees()];
        let angles = |e: &&ElementError| ElementAngles {
            cell: job.cell,
            seed: job.seed,
            method: run.method.clone(),
            beam: e.beam,
            estimate: pair(&e.estimate),
            truth: pair(&e.truth),
        };
        let elements = scored.iter().map(angles).collect();
        (run, elements)
    }
}

/// Selects one element by the seed: a multiple of the golden ratio, so that successive seeds cover the whole scan.
pub(crate) fn drawn<'e>(scored: &[&'e ElementError], seed: u64) -> Option<&'e ElementError> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    // The result is below the number of elements.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let place = ((seed as f64 * GOLDEN).fract() * scored.len() as f64) as usize;
    scored.get(place).copied()
}
