//! Where the sensor sits in the rig (step 5), from boards in front of beams that no mirror deflects.
//!
//! The tracked board predicts the range of a beam from the origin, r = n·c/(n·u), for any mounting `rig_from_sensor`;
//! Gauss–Newton over small motions of the sensor fits the predictions to the corrected ranges. The readings of one
//! board share its drift and its markers' error, so each board is weighted by its full covariance (Woodbury), not
//! reading by reading.

use crate::judge::covariance::MountUncertainty;
use crate::mount::mount_data::{DirectBoard, Selection, Selector};
use catoptric_model::session::MountTolerance;
use catoptric_model::{Dataset, Pose, PoseData, Summary, calibration::MountEstimate};
use nalgebra::{
    DMatrix, Dyn, Matrix6, OMatrix, SymmetricEigen, Translation3, U6, UnitQuaternion, Vector3, Vector6,
};

/// A step shorter than this (in meters and in radians) ends the iteration: some roundings of a pose.
const STEP_TOLERANCE: f64 = 1e-14;

/// Below this length a step that no longer shrinks is rounding, and the iteration has ended.
const ROUNDING_STEP: f64 = 1e-11;

/// Maximum number of steps of one iteration.
const MAX_STEPS: usize = 50;

/// Maximum number of rounds of selecting beams and solving.
const MAX_ROUNDS: usize = 12;

/// Smallest tolerance used as a prior, in radians and meters: a drawing is never better than 0.1° and 1 mm.
const MIN_TOLERANCE: [f64; 2] = [1.745e-3, 1e-3];

/// Tolerance of a mounting that was measured and is known, in radians and meters.
const NO_TOLERANCE: f64 = 1e-9;

/// The mounting of the sensor as estimated.
#[derive(Debug, Clone, PartialEq)]
pub struct Mount {
    /// Transforms coordinates from the sensor frame to the rig as tracked.
    pub rig_from_sensor: Pose,
    /// Its uncertainty.
    pub uncertainty: MountUncertainty,
    /// Number of boards used.
    pub boards: usize,
    /// Number of means used, each of a beam over a board.
    pub sightings: usize,
    /// Number of motions, of six, that the boards did not determine better than the mount tolerance, which then
    /// replaces them.
    pub undetermined: usize,
    /// The boards and the beams on them.
    pub(crate) selection: Vec<DirectBoard>,
}

/// Sums of the weighted least squares at one mounting.
struct NormalEquations {
    information: Matrix6<f64>,
    right: Vector6<f64>,
    /// JᵀΣ⁻¹ times the change of the residuals by one standard deviation of each common error.
    common: OMatrix<f64, U6, Dyn>,
}

/// The mounting by the drawing, used only along motions that the boards leave open.
pub(crate) struct MountPrior {
    pub(crate) nominal: Pose,
    /// 1σ of each motion: shifts, then rotations.
    pub(crate) sd: Vector6<f64>,
}

/// Estimates the mounting from the poses recorded for it; `summaries` holds every pose's statistics by beam.
///
/// Without boards, or along motions that they do not determine, the result is the nominal mounting with the session's
/// tolerance, and its covariance reflects that. A well-determined mounting is not pulled toward the nominal one.
pub fn estimate(dataset: &Dataset, summaries: &[Vec<Summary>]) -> Mount {
    let session = &dataset.session;
    let prior = MountPrior::of(
        &Pose::from(&session.nominal_rig_from_sensor),
        &session.mount_tolerance,
    );
    let selector = Selector::new(dataset, summaries);
    let mut rig_from_sensor = prior.nominal;
    let mut selection = selector.select(&rig_from_sensor, &Selection::initial(&session.mount_tolerance));
    let mut stage = Selection::initial(&session.mount_tolerance);
    for _ in 0..MAX_ROUNDS {
        rig_from_sensor = solve(&selection, &rig_from_sensor, &prior, &selector);
        stage = stage.narrower();
        let next = selector.select(&rig_from_sensor, &stage);
        let same = same_beams(&next, &selection);
        selection = next;
        if same && stage.is_narrowest() {
            break;
        }
    }
    rig_from_sensor = solve(&selection, &rig_from_sensor, &prior, &selector);
    let sums = normal_equations(&selection, &rig_from_sensor, &selector);
    let (information, undetermined) = prior.complete(&sums.information);
    // Positive definite: completed along every motion that the boards leave open.
    let independent = information.try_inverse().unwrap_or_else(|| prior.covariance());
    let common = -(independent * sums.common);
    Mount {
        rig_from_sensor,
        uncertainty: MountUncertainty { independent, common },
        boards: selection.len(),
        sightings: selection.iter().map(|b| b.rays.len()).sum(),
        undetermined,
        selection,
    }
}

impl Mount {
    /// The mounting in the form of the calibration file.
    pub fn to_file(&self) -> MountEstimate {
        let data = PoseData::from(&self.rig_from_sensor);
        let total = self.uncertainty.total();
        let mut covariance = [[0.0; 6]; 6];
        for (row, values) in covariance.iter_mut().enumerate() {
            for (column, value) in values.iter_mut().enumerate() {
                // Mean of both sides of the diagonal: symmetric bit for bit.
                *value = 0.5 * (total[(row, column)] + total[(column, row)]);
            }
        }
        MountEstimate {
            translation_m: data.translation_m,
            rotation_xyzw: data.rotation_xyzw,
            covariance: Some(covariance),
        }
    }
}

/// The mounting moved by a small motion of the sensor about its own axes.
pub fn moved(rig_from_sensor: &Pose, motion: &Vector6<f64>) -> Pose {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(motion[3], motion[4], motion[5]));
    let mut pose =
        rig_from_sensor * Pose::from_parts(Translation3::new(motion[0], motion[1], motion[2]), turn);
    pose.rotation.renormalize();
    pose
}

/// The small motion from one mounting to another, about the first one's axes.
pub fn motion_between(from: &Pose, to: &Pose) -> Vector6<f64> {
    let between = from.inverse() * to;
    let (t, w) = (between.translation.vector, between.rotation.scaled_axis());
    Vector6::new(t.x, t.y, t.z, w.x, w.y, w.z)
}

/// Whether two selections hold the same beams of the same poses.
pub(crate) fn same_beams(a: &[DirectBoard], b: &[DirectBoard]) -> bool {
    let beams = |s: &[DirectBoard]| -> Vec<(usize, usize)> {
        s.iter()
            .flat_map(|board| board.rays.iter().map(|r| (board.pose, r.beam)))
            .collect()
    };
    beams(a) == beams(b)
}

/// Gauss–Newton over a fixed selection of beams.
fn solve(selection: &[DirectBoard], start: &Pose, prior: &MountPrior, selector: &Selector) -> Pose {
    let mut pose = *start;
    let mut last = f64::INFINITY;
    for _ in 0..MAX_STEPS {
        let sums = normal_equations(selection, &pose, selector);
        let step = prior.step(&sums, &pose);
        pose = moved(&pose, &step);
        let length = step.norm();
        if length < STEP_TOLERANCE || (length < ROUNDING_STEP && length >= last) {
            break;
        }
        last = length;
    }
    pose
}

fn normal_equations(
    selection: &[DirectBoard],
    rig_from_sensor: &Pose,
    selector: &Selector,
) -> NormalEquations {
    let width = selector.common.len();
    let mut sums = NormalEquations {
        information: Matrix6::zeros(),
        right: Vector6::zeros(),
        common: OMatrix::<f64, U6, Dyn>::zeros(width),
    };
    for board in selection {
        let Some(block) = selector.linearize(board, rig_from_sensor) else {
            continue;
        };
        let mut right_side = DMatrix::zeros(block.sightings.len(), 7 + width);
        right_side.columns_mut(0, 6).copy_from(&block.jacobian);
        for (row, seen) in block.sightings.iter().enumerate() {
            right_side[(row, 6)] = selector.corrected(seen, &block.color).0 - seen.distance;
            let common = selector
                .common
                .row(seen.distance, seen.cos_incidence, &block.color);
            right_side.view_mut((row, 7), (1, width)).copy_from(&common);
        }
        let products = block.jacobian.transpose() * block.weighted(&right_side);
        sums.information += products.fixed_view::<6, 6>(0, 0);
        sums.right += products.column(6);
        sums.common += products.columns(7, width);
    }
    sums
}

impl MountPrior {
    pub(crate) fn of(nominal: &Pose, tolerance: &MountTolerance) -> Self {
        // A tolerance of zero means that the mounting is known, not that it was drawn with care.
        let floored = |sd: f64, floor: f64| if sd == 0.0 { NO_TOLERANCE } else { sd.max(floor) };
        let shift = tolerance
            .translation_sd_mm
            .map(|mm| floored(mm * 1e-3, MIN_TOLERANCE[1]));
        let turn = tolerance
            .rotation_sd_deg
            .map(|deg| floored(deg.to_radians(), MIN_TOLERANCE[0]));
        Self {
            nominal: *nominal,
            sd: Vector6::new(shift[0], shift[1], shift[2], turn[0], turn[1], turn[2]),
        }
    }

    fn covariance(&self) -> Matrix6<f64> {
        Matrix6::from_diagonal(&self.sd.component_mul(&self.sd))
    }

    /// Projector, in units of the tolerance, onto the motions that the boards determine less well than the drawing.
    fn open_motions(&self, information: &Matrix6<f64>) -> (Matrix6<f64>, usize) {
        let scale = Matrix6::from_diagonal(&self.sd);
        let eigen = SymmetricEigen::new(scale * information * scale);
        let mut projector = Matrix6::zeros();
        let mut count = 0;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value < 1.0 {
                projector += vector * vector.transpose();
                count += 1;
            }
        }
        (projector, count)
    }

    /// The information with the prior's added along open motions, and the number of these motions.
    fn complete(&self, information: &Matrix6<f64>) -> (Matrix6<f64>, usize) {
        let (projector, count) = self.open_motions(information);
        let unscale = Matrix6::from_diagonal(&self.sd.map(|sd| 1.0 / sd));
        (information + unscale * projector * unscale, count)
    }

    fn step(&self, sums: &NormalEquations, pose: &Pose) -> Vector6<f64> {
        let (projector, _) = self.open_motions(&sums.information);
        let scale = Matrix6::from_diagonal(&self.sd);
        let deviation = motion_between(&self.nominal, pose).component_div(&self.sd);
        let information = scale * sums.information * scale + projector;
        let right = scale * sums.right - projector * deviation;
        let solved = information
            .cholesky()
            .map_or_else(Vector6::zeros, |c| c.solve(&right));
        scale * solved
    }
}
