//! The adjustment: mounting and biases together, by generalized least squares.

use super::design::Design;
use crate::error::CalibError;
use crate::mount::mount_data::{DirectBoard, Selector};
use crate::mount::pose::{motion_between, moved};
use catoptric_model::calibration::MountEstimate;
use catoptric_model::characterization::Fit;
use catoptric_model::{Pose, PoseData, Session};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

/// A step of the mounting shorter than this, in meters and in radians, ends the iteration.
const STEP_TOLERANCE: f64 = 1e-12;

/// Maximum number of steps: the problem is nearly linear.
const MAX_STEPS: usize = 30;

/// Pivot of the scaled normal matrix below which the boards leave a combination open.
const MIN_PIVOT: f64 = 1e-10;

/// What is known of the mounting before any board is read.
pub(super) struct RigPrior {
    nominal: Pose,
    /// 1σ of each motion, three shifts and three rotations; 0 for one that is known exactly.
    sd: Vector6<f64>,
}

/// The estimated mounting and biases.
pub(super) struct Adjustment {
    pub(super) rig_from_sensor: Pose,
    /// In the order of the design's terms.
    pub(super) values: DVector<f64>,
    pub(super) covariance: DMatrix<f64>,
    mount_covariance: Matrix6<f64>,
    pub(super) fit: Fit,
}

impl RigPrior {
    /// The drawing's tolerance, and the uncertainty of the rig in motion capture.
    pub(super) fn of(session: &Session) -> Self {
        let markers: Vec<Vector3<f64>> = session.rig_markers.iter().map(|m| m.position().coords).collect();
        let count = markers.len().max(1) as f64;
        let center = markers.iter().sum::<Vector3<f64>>() / count;
        let marker = session.believed.marker_sd_mm * 1e-3;
        let tolerance = &session.mount_tolerance;
        let sd = |motion: usize| {
            let axis = motion % 3;
            if motion < 3 {
                libm::hypot(tolerance.translation_sd_mm[axis] * 1e-3, marker / count.sqrt())
            } else {
                // A rotation about an axis moves the markers by their distance from it.
                let lever = |m: &Vector3<f64>| (m - center).norm_squared() - (m - center)[axis].powi(2);
                let levers = markers.iter().map(lever).sum::<f64>();
                let tracked = if levers > 0.0 { marker / levers.sqrt() } else { 0.0 };
                libm::hypot(tolerance.rotation_sd_deg[axis].to_radians(), tracked)
            }
        };
        Self {
            nominal: Pose::from(&session.nominal_rig_from_sensor),
            sd: Vector6::from_fn(|motion, _| sd(motion)),
        }
    }
}

impl Adjustment {
    /// The mounting in the form of the files.
    pub(super) fn mount(&self) -> MountEstimate {
        let data = PoseData::from(&self.rig_from_sensor);
        let c = &self.mount_covariance;
        MountEstimate {
            translation_m: data.translation_m,
            rotation_xyzw: data.rotation_xyzw,
            covariance: Some(std::array::from_fn(|i| {
                std::array::from_fn(|j| c[(i.min(j), i.max(j))])
            })),
        }
    }
}

/// Adjusts the mounting, from `start` on, and the numbers of a design to selected readings.
///
/// # Errors
/// [`CalibError::Characterization`] without readings, or if they leave a combination of the numbers open.
pub(super) fn adjust(
    selector: &Selector,
    chosen: &[DirectBoard],
    design: &Design,
    prior: &RigPrior,
    start: &Pose,
) -> Result<Adjustment, CalibError> {
    let fail = |what: &str| CalibError::Characterization {
        what: what.to_owned(),
    };
    if chosen.is_empty() || design.terms.is_empty() {
        return Err(fail("no board is read by beams that nothing deflects"));
    }
    // Motions that are known exactly are not solved for.
    let free: Vec<usize> = (0..6).filter(|m| prior.sd[*m] > 0.0).collect();
    let width = free.len() + design.terms.len();
    let mut mount = *start;
    let mut step = 0;
    loop {
        let mut normal = DMatrix::zeros(width, width);
        let mut right = DVector::zeros(width);
        let (mut squares, mut means) = (0.0, 0);
        for board in chosen {
            let Some(block) = selector.linearize(board, &mount) else {
                continue;
            };
            let rows = block.sightings.len();
            // Columns: the free motions, the terms, and the residuals without any bias.
            let mut system = DMatrix::zeros(rows, width + 1);
            for (column, motion) in free.iter().enumerate() {
                system.set_column(column, &block.jacobian.column(*motion));
            }
            for (row, seen) in block.sightings.iter().enumerate() {
                let terms = design.row(seen.distance, seen.cos_incidence, &block.color);
                system
                    .view_mut((row, free.len()), (1, terms.len()))
                    .copy_from(&terms);
                system[(row, width)] = seen.mean.0 - seen.distance - design.held.error(seen.cos_incidence);
            }
            let products = system.transpose() * block.weighted(&system);
            normal += products.view((0, 0), (width, width));
            right += products.view((0, width), (width, 1));
            squares += products[(width, width)];
            means += rows;
        }
        let deviation = motion_between(&prior.nominal, &mount);
        for (column, motion) in free.iter().enumerate() {
            let weight = prior.sd[*motion].powi(-2);
            normal[(column, column)] += weight;
            right[column] -= weight * deviation[*motion];
            squares += weight * deviation[*motion] * deviation[*motion];
        }
        let scale = DVector::from_iterator(width, normal.diagonal().iter().map(|d| 1.0 / d.sqrt()));
        let scaled = DMatrix::from_diagonal(&scale) * &normal * DMatrix::from_diagonal(&scale);
        let factor = scaled
            .cholesky()
            .filter(|c| c.l_dirty().diagonal().iter().all(|p| p * p > MIN_PIVOT))
            .ok_or_else(|| fail("the boards do not separate the distance, angle and color errors"))?;
        let covariance = DMatrix::from_diagonal(&scale) * factor.inverse() * DMatrix::from_diagonal(&scale);
        let solution = &covariance * &right;
        let mut motion = Vector6::zeros();
        for (column, m) in free.iter().enumerate() {
            motion[*m] = solution[column];
        }
        let settled = motion.norm() < STEP_TOLERANCE || step == MAX_STEPS;
        mount = moved(&mount, &motion);
        step += 1;
        if settled {
            let first = free.len();
            let terms = design.terms.len();
            let mut mount_covariance = Matrix6::zeros();
            for (row, i) in free.iter().enumerate() {
                for (column, j) in free.iter().enumerate() {
                    mount_covariance[(*i, *j)] = covariance[(row, column)];
                }
            }
            return Ok(Adjustment {
                rig_from_sensor: mount,
                values: solution.rows(first, terms).into_owned(),
                covariance: covariance.view((first, first), (terms, terms)).into_owned(),
                mount_covariance,
                fit: Fit {
                    chi_squared: squares - right.dot(&solution),
                    // The prior's equations and the motions cancel.
                    degrees_of_freedom: means.saturating_sub(terms),
                },
            });
        }
    }
}
