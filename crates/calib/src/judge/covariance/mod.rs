//! The error budget of one element: how far its direction can be off under all errors that the experimenter believes
//! in.
//!
//! Per board: white noise σ²/N, a drift constant, the board's markers (one offset and two tilts of its plane). Common
//! to all boards: the nodes of E_r, A_a, E_c of each color, the distance d, and the mounting of the sensor. A d that
//! the scanner ranged contains errors of E_r and A_a, which partly cancel those of the readings. Together they make Σ
//! (K × K); the estimate x̂ = (HᵀWH)⁻¹HᵀW·(z − r) then has the sandwich covariance, and no unbiased estimate can be
//! better than the bound (HᵀΣ⁻¹H)⁻¹.

mod plane;

use crate::judge::common::CommonErrors;
use crate::readings::jacobian;
use crate::readings::observations::BoardView;
use catoptric_model::{Deflection, Session, beam, range};
use nalgebra::{DMatrix, DVector, Dyn, Matrix2, Matrix6, OMatrix, RowDVector, RowVector6, U2, U6, Vector2};

pub(crate) use plane::PlaneFit;
use plane::plane_variance;

/// Error that keeps Σ invertible where no error is believed in, in meters.
const MIN_ERROR: f64 = 1e-6;

/// Uncertainty of the mounting of the sensor, as small motions of the sensor about its own axes: three shifts in
/// meters, three rotations in radians.
///
/// The mounting was estimated with the same range biases as the elements. The two errors are therefore correlated, and
/// partly cancel; `common` holds that part.
#[derive(Debug, Clone, PartialEq)]
pub struct MountUncertainty {
    /// Covariance from errors that no element shares.
    pub independent: Matrix6<f64>,
    /// Motion caused by one standard deviation of each uncertain number of the believed biases; no columns if unknown.
    pub common: OMatrix<f64, U6, Dyn>,
}

/// The linearized measurement of one element and its error.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// H: one row (∂r/∂θ_a, ∂r/∂φ) per board, in meters per radian.
    #[doc(alias = "H")]
    pub jacobian: DMatrix<f64>,
    /// Σ: covariance of z − r over the boards, in square meters.
    #[doc(alias = "Sigma")]
    pub covariance: DMatrix<f64>,
    /// Readings of each board, the weights of the paper's unweighted sum over readings.
    pub counts: DVector<f64>,
}

impl From<Matrix6<f64>> for MountUncertainty {
    /// A covariance with an unknown relation to the range biases.
    fn from(independent: Matrix6<f64>) -> Self {
        Self {
            independent,
            common: OMatrix::<f64, U6, Dyn>::zeros(0),
        }
    }
}

impl MountUncertainty {
    /// A mounting known exactly.
    pub fn none() -> Self {
        Matrix6::zeros().into()
    }

    /// The whole covariance.
    pub fn total(&self) -> Matrix6<f64> {
        self.independent + &self.common * self.common.transpose()
    }
}

/// The error budget of an element with the given deflection that reads the given boards.
///
/// `session` holds the beliefs, `mount` the uncertainty of the mounting. `None` if the ray misses a plane.
///
/// ```
/// use catoptric_calib::covariance::{self, MountUncertainty};
/// use catoptric_calib::observations::BoardView;
/// use catoptric_model::{BoardPlane, Deflection, Session};
/// use nalgebra::{Point3, Unit, Vector3};
///
/// fn bound_deg(session: &Session, boards: &[BoardView]) -> Option<f64> {
///     let up = Deflection { azimuth: 0.2, elevation: 0.9, distance: 0.07 };
///     let budget = covariance::budget(session, &MountUncertainty::none(), 0.3, &up, boards)?;
///     Some(budget.bound()?.trace().sqrt().to_degrees())
/// }
/// ```
pub fn budget(
    session: &Session,
    mount: &MountUncertainty,
    beam_azimuth: f64,
    deflection: &Deflection,
    boards: &[BoardView],
) -> Option<Budget> {
    let common = CommonErrors::of(session);
    let k = boards.len();
    let mut h = DMatrix::zeros(k, 2);
    let mut sigma = DMatrix::zeros(k, k);
    let mut shared = DMatrix::zeros(k, common.len() + 1);
    let mut moved = OMatrix::<f64, Dyn, U6>::zeros(k);
    for (row, board) in boards.iter().enumerate() {
        let sighting = Sighting::new(session, &common, mount, beam_azimuth, deflection, board)?;
        h.set_row(row, &sighting.angles.transpose());
        sigma[(row, row)] = sighting.own;
        shared.set_row(row, &sighting.shared);
        moved.set_row(row, &sighting.mount);
    }
    sigma += &shared * shared.transpose() + &moved * mount.independent * moved.transpose();
    let counts = DVector::from_iterator(k, boards.iter().map(|b| b.count as f64));
    Some(Budget {
        jacobian: h,
        covariance: sigma,
        counts,
    })
}

/// One board's range of one element linearized, with its errors.
pub(crate) struct Sighting {
    /// (∂r/∂θ_a, ∂r/∂φ), in meters per radian.
    pub(crate) angles: Vector2<f64>,
    /// Variance of the errors of this board alone: noise of the mean, drift, markers, in square meters.
    pub(crate) own: f64,
    /// Error per standard deviation of each of the [`CommonErrors`], and last of d, in meters.
    pub(crate) shared: RowDVector<f64>,
    /// ∂r/∂(motion of the sensor).
    pub(crate) mount: RowVector6<f64>,
}

impl Sighting {
    /// `None` if the ray misses the plane.
    pub(crate) fn new(
        session: &Session,
        common: &CommonErrors,
        mount: &MountUncertainty,
        beam_azimuth: f64,
        deflection: &Deflection,
        board: &BoardView,
    ) -> Option<Self> {
        let beliefs = &session.believed;
        let v = deflection.exit_direction(beam_azimuth);
        let gradient = jacobian::analytic(deflection, beam_azimuth, &board.plane)?;
        let r = range::predict(deflection, beam_azimuth, &board.plane)?;
        let hit = deflection.deflection_point(beam_azimuth) + v.into_inner() * (r - deflection.distance);
        let cos_incidence = board.plane.cos_incidence(&v);
        let mount_row = jacobian::of_mount(&hit, &board.plane.normal, &v);
        let own = board.noise_sd.powi(2) / board.count.max(1) as f64
            + (beliefs.drift_sd_mm * 1e-3).powi(2)
            + (beliefs.element_sd_mm * 1e-3).powi(2)
            + plane_variance(board.markers, &hit, board, beliefs.marker_sd_mm * 1e-3) / cos_incidence.powi(2)
            + common.unlisted_variance(board.color);
        let mut biases = common.row(r, cos_incidence, board.color);
        if mount.common.ncols() == biases.len() {
            biases += mount_row * &mount.common;
        }
        // An error of the bare distance counts as part of the path.
        let bare_cos = (0.5 * (1.0 - beam::direction(beam_azimuth).dot(&v)))
            .max(0.0)
            .sqrt();
        biases -= common.bare_row(deflection.distance, bare_cos) * gradient.distance;
        let mut shared = RowDVector::zeros(common.len() + 1);
        shared.columns_mut(0, common.len()).copy_from(&biases);
        let own_distance = session.bare_structure.noise_sd_mm * 1e-3;
        let distance_sd = libm::hypot(common.bare_sd(deflection.distance, bare_cos), own_distance);
        shared[common.len()] = gradient.distance * distance_sd;
        Some(Self {
            angles: gradient.angles(),
            own,
            shared,
            mount: mount_row,
        })
    }
}

impl Budget {
    /// Covariance of (θ_a, φ) for the paper's estimate, a sum over readings: GΣGᵀ with G = (HᵀWH)⁻¹HᵀW, in rad².
    ///
    /// `None` if the boards do not determine both angles.
    pub fn sandwich(&self) -> Option<Matrix2<f64>> {
        let gain = self.gain()?;
        Some(&gain * &self.covariance * gain.transpose())
    }

    /// Covariance of the residuals of that estimate, (I − HG)Σ(I − HG)ᵀ, in square meters.
    pub fn residual_covariance(&self) -> Option<DMatrix<f64>> {
        let left = DMatrix::identity(self.counts.len(), self.counts.len()) - &self.jacobian * self.gain()?;
        Some(&left * &self.covariance * left.transpose())
    }

    /// The minimum covariance of (θ_a, φ) of any unbiased estimate: (HᵀΣ⁻¹H)⁻¹, in rad².
    ///
    /// `None` if Σ is singular (errors believed to be absent) or the boards do not determine both angles.
    #[doc(alias = "CRLB")]
    pub fn bound(&self) -> Option<Matrix2<f64>> {
        let solved = self.covariance.clone().cholesky()?.solve(&self.jacobian);
        to_2(&(self.jacobian.transpose() * solved)).try_inverse()
    }

    /// Covariance of the residuals of the minimum-variance estimate, Σ − H(HᵀΣ⁻¹H)⁻¹Hᵀ, in square meters.
    pub fn residual_covariance_at_bound(&self) -> Option<DMatrix<f64>> {
        Some(&self.covariance - &self.jacobian * self.bound()? * self.jacobian.transpose())
    }

    /// HᵀΣ⁻¹H and HᵀΣ⁻¹e: the normal equations of generalized least squares for residuals e, in meters.
    ///
    /// If all errors are believed to be absent, a micrometer is added to Σ: error-free data satisfy any weights.
    pub fn weighted(&self, residuals: &DVector<f64>) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let k = residuals.len();
        let floor = DMatrix::identity(k, k) * MIN_ERROR.powi(2);
        let factor = (&self.covariance + floor).cholesky()?;
        let weighted = factor.solve(&self.jacobian).transpose();
        let right = &weighted * residuals;
        Some((
            to_2(&(weighted * &self.jacobian)),
            Vector2::new(right[0], right[1]),
        ))
    }

    /// The paper's covariance of (θ_a, φ), σ²(HᵀH)⁻¹ over all readings with noise alone, in rad².
    pub fn noise_covariance(&self, noise_sd: f64) -> Option<Matrix2<f64>> {
        Some(self.normal_matrix().try_inverse()? * (noise_sd * noise_sd))
    }

    /// Σ N_k h_k h_kᵀ: HᵀH over all readings.
    pub fn normal_matrix(&self) -> Matrix2<f64> {
        to_2(&(self.jacobian.transpose() * DMatrix::from_diagonal(&self.counts) * &self.jacobian))
    }

    fn gain(&self) -> Option<OMatrix<f64, U2, Dyn>> {
        let inverse = self.normal_matrix().try_inverse()?;
        Some(inverse * self.jacobian.transpose() * DMatrix::from_diagonal(&self.counts))
    }
}

fn to_2(m: &DMatrix<f64>) -> Matrix2<f64> {
    Matrix2::new(m[(0, 0)], m[(0, 1)], m[(1, 0)], m[(1, 1)])
}

#[cfg(test)]
mod tests;
