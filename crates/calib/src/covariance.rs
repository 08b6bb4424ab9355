//! The error budget of one element: how far its direction can be off under every error the experimenter believes in.
//!
//! Per board: white noise σ²/N, a drift constant, the board's markers (one offset and two tilts of its plane). Common
//! to all boards: the nodes of E_r, A_a, E_c of each color, the distance d, and the mounting of the sensor. They make
//! Σ (K × K); the estimate x̂ = (HᵀWH)⁻¹HᵀW·(z − r) then has the sandwich covariance, and no unbiased estimate can
//! have less than the bound (HᵀΣ⁻¹H)⁻¹.

use crate::common::CommonErrors;
use crate::jacobian;
use crate::observations::BoardView;
use catoptric_model::{Deflection, Session, range};
use nalgebra::{DMatrix, DVector, Dyn, Matrix2, Matrix3, Matrix6, OMatrix, Point3, U2, U6, Vector3};

/// How well the mounting of the sensor is known: small motions of the sensor about its own axes, three shifts in
/// metres, three turns in radians.
///
/// The mounting was found with the same range biases that the elements are found with. The two errors are therefore
/// correlated, and partly cancel; `common` carries that.
#[derive(Debug, Clone, PartialEq)]
pub struct MountUncertainty {
    /// Covariance from errors that no element shares.
    pub independent: Matrix6<f64>,
    /// Motion caused by one standard deviation of each of the [`CommonErrors`]; no columns if unknown.
    pub common: OMatrix<f64, U6, Dyn>,
}

/// The linearized measurement of one element and its error.
#[derive(Debug, Clone, PartialEq)]
pub struct Budget {
    /// H: one row (∂r/∂θ_a, ∂r/∂φ) per board, in metres per radian.
    #[doc(alias = "H")]
    pub jacobian: DMatrix<f64>,
    /// Σ: covariance of z − r over the boards, in square metres.
    #[doc(alias = "Sigma")]
    pub covariance: DMatrix<f64>,
    /// Readings of each board, the weights of the paper's unweighted sum over readings.
    pub counts: DVector<f64>,
}

impl From<Matrix6<f64>> for MountUncertainty {
    /// A covariance whose relation to the range biases is not known.
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

/// The error budget of an element that leaves as `deflection` says and reads the given boards.
///
/// `session` says what is believed, `mount` how well the sensor's place is known. `None` if the ray misses a plane.
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
    let beliefs = &session.believed;
    let common = CommonErrors::of(session);
    let (k, v) = (boards.len(), deflection.exit_direction(beam_azimuth));
    let d_sd = session.bare_structure.distance_sd_mm * 1e-3;
    let mut h = DMatrix::zeros(k, 2);
    let mut sigma = DMatrix::zeros(k, k);
    let mut shared = DMatrix::zeros(k, common.len() + 1);
    let mut moved = OMatrix::<f64, Dyn, U6>::zeros(k);
    for (row, board) in boards.iter().enumerate() {
        let gradient = jacobian::analytic(deflection, beam_azimuth, &board.plane)?;
        h.set_row(row, &gradient.angles().transpose());
        let r = range::predict(deflection, beam_azimuth, &board.plane)?;
        let hit = deflection.deflection_point(beam_azimuth) + v.into_inner() * (r - deflection.distance);
        let cos_incidence = board.plane.cos_incidence(&v);
        let mount_row = jacobian::of_mount(&hit, &board.plane.normal, &v);
        moved.set_row(row, &mount_row);
        sigma[(row, row)] = board.noise_sd.powi(2) / board.count.max(1) as f64
            + (beliefs.drift_sd_mm * 1e-3).powi(2)
            + plane_variance(board.markers, &hit, board, beliefs.marker_sd_mm * 1e-3) / cos_incidence.powi(2)
            + common.unlisted_variance(board.color);
        let mut biases = common.row(r, cos_incidence, board.color);
        if mount.common.ncols() == biases.len() {
            biases += mount_row * &mount.common;
        }
        shared.view_mut((row, 0), (1, common.len())).copy_from(&biases);
        shared[(row, common.len())] = gradient.distance * d_sd;
    }
    sigma += &shared * shared.transpose() + &moved * mount.independent * moved.transpose();
    let counts = DVector::from_iterator(k, boards.iter().map(|b| b.count as f64));
    Some(Budget {
        jacobian: h,
        covariance: sigma,
        counts,
    })
}

/// Variance of a tracked plane's height at a point of it, in square metres: σ²·aᵀ(Σ a_i a_iᵀ)⁻¹a, a = (1, x, y).
fn plane_variance(markers: &[Point3<f64>], at: &Point3<f64>, board: &BoardView, marker_sd: f64) -> f64 {
    let (a, cofactor) = plane_fit(markers, at, &board.plane.normal);
    marker_sd * marker_sd * (a.transpose() * cofactor * a)[0]
}

/// What the error of a plane through markers at a point depends on: a and (Σ a_i a_iᵀ)⁻¹, both about the centroid.
///
/// Fewer than three markers, or markers on a line, leave the plane's tilt to chance; then only their mean offset is
/// counted, since no honest number can be given for the rest.
pub(crate) fn plane_fit(
    markers: &[Point3<f64>],
    at: &Point3<f64>,
    normal: &nalgebra::Unit<Vector3<f64>>,
) -> (Vector3<f64>, Matrix3<f64>) {
    let count = markers.len().max(1) as f64;
    let centroid = markers.iter().map(|m| m.coords).sum::<Vector3<f64>>() / count;
    let across = Vector3::x() - normal.into_inner() * normal.x;
    let other = Vector3::y() - normal.into_inner() * normal.y;
    // Whichever axis is farther from the normal gives a first direction in the plane.
    let first = if across.norm() > other.norm() {
        across
    } else {
        other
    }
    .normalize();
    let second = normal.cross(&first);
    let coordinates = |p: Vector3<f64>| Vector3::new(1.0, first.dot(&p), second.dot(&p));
    let information: Matrix3<f64> = markers
        .iter()
        .map(|m| coordinates(m.coords - centroid))
        .map(|a| a * a.transpose())
        .sum();
    let spread = information[(1, 1)] + information[(2, 2)];
    let determined = information.view((1, 1), (2, 2)).determinant() > 1e-6 * spread * spread;
    let cofactor = information.try_inverse().filter(|_| determined);
    let offset_only = Matrix3::from_diagonal(&Vector3::new(1.0 / count, 0.0, 0.0));
    (coordinates(at.coords - centroid), cofactor.unwrap_or(offset_only))
}

impl Budget {
    /// Covariance of (θ_a, φ) as the paper's sum over readings estimates them: GΣGᵀ with G = (HᵀWH)⁻¹HᵀW, in rad².
    ///
    /// `None` if the boards do not determine both angles.
    pub fn sandwich(&self) -> Option<Matrix2<f64>> {
        let gain = self.gain()?;
        Some(&gain * &self.covariance * gain.transpose())
    }

    /// Covariance of the residuals that the estimate leaves, (I − HG)Σ(I − HG)ᵀ, in square metres.
    pub fn residual_covariance(&self) -> Option<DMatrix<f64>> {
        let left = DMatrix::identity(self.counts.len(), self.counts.len()) - &self.jacobian * self.gain()?;
        Some(&left * &self.covariance * left.transpose())
    }

    /// The least covariance of (θ_a, φ) that any unbiased estimate can have: (HᵀΣ⁻¹H)⁻¹, in rad².
    ///
    /// `None` if Σ is singular (errors believed to be absent) or the boards do not determine both angles.
    #[doc(alias = "CRLB")]
    pub fn bound(&self) -> Option<Matrix2<f64>> {
        let solved = self.covariance.clone().cholesky()?.solve(&self.jacobian);
        to_2(&(self.jacobian.transpose() * solved)).try_inverse()
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
mod tests {
    use super::*;
    use catoptric_model::session::*;
    use catoptric_model::{BoardPlane, PoseData, RangeBias};
    use nalgebra::{Point3, Unit};

    fn session() -> Session {
        Session {
            schema_version: SCHEMA_VERSION,
            name: String::new(),
            scanner: ScannerSheet {
                preset: String::new(),
                beams: 1081,
                step_deg: 0.25,
                scan_rate_hz: 40.0,
                range_min_m: 0.06,
                range_max_m: 20.0,
                divergence_full_mrad: 10.0,
            },
            nominal_rig_from_sensor: PoseData {
                translation_m: [0.0; 3],
                rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
            },
            mount_tolerance: MountTolerance {
                rotation_sd_deg: [1.0; 3],
                translation_sd_mm: [5.0; 3],
            },
            room: RoomSurvey {
                min_m: [-3.0; 3],
                max_m: [3.0; 3],
                color: "white".to_owned(),
            },
            believed: Beliefs {
                range_noise_sd_mm: 4.0,
                drift_sd_mm: 0.0,
                marker_sd_mm: 0.0,
                bias: RangeBias::default(),
                distance_bias_sd_mm: 0.0,
                angle_gain_sd_mm: 0.0,
                color_bias_sd_mm: 0.0,
            },
            bare_structure: BareStructure {
                mirror_thickness_mm: 0.0,
                distance_sd_mm: 0.0,
                first_beam: 0,
                distance_m: Vec::new(),
            },
            rig_markers: Vec::new(),
            facets: Vec::new(),
            boards: Vec::new(),
        }
    }

    const UP: Deflection = Deflection {
        azimuth: 0.2,
        elevation: 0.9,
        distance: 0.0,
    };

    /// Boards at s = 2 m with tilt α = 45°, spread evenly in ψ.
    fn even(count: usize, session: &Session) -> Budget {
        let v = UP.exit_direction(0.0);
        let (across, up) = catoptric_model::frame::tangent_basis(&v);
        let point = Point3::from(v.into_inner() * 2.0);
        let markers: Vec<Point3<f64>> = [(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)]
            .iter()
            .map(|(x, y)| point + across.into_inner() * (0.3 * x) + up.into_inner() * (0.3 * y))
            .collect();
        let views: Vec<BoardView> = (0..count)
            .map(|k| {
                let psi = std::f64::consts::TAU * k as f64 / count as f64;
                let psi = catoptric_model::beam::direction(psi);
                let side = across.into_inner() * psi.x + up.into_inner() * psi.y;
                BoardView {
                    plane: BoardPlane::new(point, Unit::new_normalize(side - v.into_inner())),
                    markers: &markers,
                    color: "white",
                    noise_sd: 4e-3,
                    count: 100,
                }
            })
            .collect();
        budget(session, &MountUncertainty::none(), 0.0, &UP, &views).expect("it meets the boards")
    }

    /// Standard deviation per axis of the tangent plane, in degrees.
    fn per_axis_deg(c: &Matrix2<f64>) -> f64 {
        let cos = catoptric_model::beam::direction(UP.elevation).x;
        (0.5 * (cos * cos * c[(0, 0)] + c[(1, 1)])).sqrt().to_degrees()
    }

    #[test]
    fn noise_alone_is_the_closed_form() {
        // σ_angle = σ/(s·tan α)·√(2/K) for an even spread of ψ; sandwich, bound and the paper's formula are then one.
        let budget = even(5, &session());
        let expected = (4e-4 / 2.0 * (2.0_f64 / 5.0).sqrt()).to_degrees();
        for c in [budget.bound(), budget.sandwich(), budget.noise_covariance(4e-3)] {
            assert!((per_axis_deg(&c.expect("it is determined")) / expected - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn the_sandwich_is_never_below_the_bound() {
        let mut session = session();
        session.believed.drift_sd_mm = 0.9;
        session.believed.marker_sd_mm = 0.3;
        session.believed.angle_gain_sd_mm = 5.0;
        session.bare_structure.distance_sd_mm = 0.5;
        let mut last = f64::INFINITY;
        for count in [3, 4, 6, 8] {
            let budget = even(count, &session);
            let bound = budget.bound().expect("it is determined");
            let excess = budget.sandwich().expect("it is determined") - bound;
            assert!(excess.symmetric_eigenvalues().min() > -1e-9 * bound.norm());
            assert!(bound.trace() < last, "another board must not lose information");
            last = bound.trace();
        }
    }

    #[test]
    fn an_even_spread_cancels_a_common_error() {
        let mut biased = session();
        biased.believed.angle_gain_sd_mm = 20.0;
        let (without, with) = (even(4, &session()), even(4, &biased));
        assert!((with.covariance.clone() - without.covariance.clone()).norm() > 1e-5);
        let difference =
            with.sandwich().expect("it is determined") - without.sandwich().expect("it is determined");
        assert!(difference.norm() < 1e-12);
    }

    #[test]
    fn four_markers_hold_a_plane_by_half_their_error() {
        let mut session = session();
        session.believed.marker_sd_mm = 0.4;
        let sigma = even(3, &session).covariance[(0, 0)] - 16e-8;
        // Offset σ/2, over cos 45° along the beam.
        assert!((sigma - (0.2e-3_f64).powi(2) * 2.0).abs() < 1e-14);
    }
}
