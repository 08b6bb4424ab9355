//! A start without a guess: 1/s_k = (n_k/(n_k·(c_k − P_L1)))·v is linear in the exit direction v.

use crate::judge::covariance::Budget;
use crate::judge::levers::libm_cos;
use crate::readings::observations::Observation;
use catoptric_model::{Deflection, RangeBias, frame};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Matrix3xX, SymmetricEigen, Unit, Vector3};

/// Smallest ratio of singular values at which the linear system has rank three.
const MIN_CONDITION: f64 = 1e-2;

/// Distance from the drawing beyond which a start in closed form is noise, in radians.
pub(crate) const FARTHEST_START: f64 = 0.35;

/// Iterations in which a bias is looked up at the range corrected by it: biases change by less than a hundredth of the
/// range, so each iteration adds two digits.
const CORRECTIONS: usize = 7;

/// A direction found in closed form.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedForm {
    /// The exit direction v.
    pub direction: Unit<Vector3<f64>>,
    /// |v| − 1 before v was normalized: nothing in the linear system makes it zero except the truth.
    pub excess: f64,
}

/// Least squares for v over at least three boards. The nominal deflection only places P_L1 and the biases.
///
/// `None` if the boards do not determine v.
pub fn closed_form(
    nominal: &Deflection,
    beam_azimuth: f64,
    observations: &[Observation],
    bias: &RangeBias,
) -> Option<ClosedForm> {
    let from = nominal.deflection_point(beam_azimuth);
    let v = nominal.exit_direction(beam_azimuth);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for o in observations {
        let plane = &o.board.plane;
        let cos_incidence = plane.cos_incidence(&v);
        let range = (0..CORRECTIONS).fold(o.mean.0, |range, _| {
            bias.correct(o.mean, range, cos_incidence, o.board.color).0
        });
        let s = range - nominal.distance;
        // Multiplied by s, so that every row weights its range error equally: s·q·v = 1.
        let row = plane.normal.into_inner() * (s / plane.normal.dot(&(plane.point - from)));
        normal += row * row.transpose();
        right += row;
    }
    let values = SymmetricEigen::new(normal).eigenvalues;
    if observations.len() < 3 || values.min() < MIN_CONDITION * MIN_CONDITION * values.max() {
        return None;
    }
    let found = normal.try_inverse()? * right;
    Some(ClosedForm {
        direction: Unit::try_new(found, f64::MIN_POSITIVE)?,
        excess: found.norm() - 1.0,
    })
}

/// Covariance of (θ_a, φ) in closed form, from the covariance Σ of the ranges, in rad².
///
/// An error δz of a range changes its row's s·q·v by δz/s, so v by −(Σqqᵀ)⁻¹q·δz/s with q as in [`closed_form`]. Of
/// this, the part perpendicular to v remains when v is normalized.
pub(crate) fn covariance(
    at: &Deflection,
    beam_azimuth: f64,
    observations: &[Observation],
    budget: &Budget,
) -> Option<Matrix2<f64>> {
    let (from, v) = (at.deflection_point(beam_azimuth), at.exit_direction(beam_azimuth));
    let mut normal = Matrix3::zeros();
    let mut gain = Matrix3xX::zeros(observations.len());
    for (mut column, o) in gain.column_iter_mut().zip(observations) {
        let plane = &o.board.plane;
        let s = plane.distance_along(&from, &v)?;
        let row = plane.normal.into_inner() * (s / plane.normal.dot(&(plane.point - from)));
        normal += row * row.transpose();
        column.copy_from(&(row / s));
    }
    let (across, up) = frame::tangent_basis(&v);
    let cos_elevation = libm_cos(at.elevation);
    let onto = Matrix2x3::from_rows(&[across.transpose() / cos_elevation, up.transpose()]);
    let gain = onto * normal.try_inverse()? * gain;
    Some(&gain * &budget.covariance * gain.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::observations::BoardView;
    use catoptric_model::{BoardPlane, RawRange, beam, range};
    use nalgebra::Point3;

    fn found(normals: [[f64; 3]; 3]) -> Option<ClosedForm> {
        let truth = Deflection {
            azimuth: 0.2,
            elevation: 0.9,
            distance: 0.07,
        };
        let observations = normals.map(|n| {
            let plane = BoardPlane::new(Point3::new(1.0, 0.4, 1.4), Unit::new_normalize(Vector3::from(n)));
            Observation {
                board: BoardView {
                    plane,
                    markers: &[],
                    color: "white",
                    noise_sd: 0.0,
                    count: 1,
                },
                mean: RawRange(range::predict(&truth, 0.3, &plane).expect("the beam hits the board")),
            }
        });
        let guess = Deflection {
            azimuth: -0.4,
            elevation: 0.3,
            distance: 0.07,
        };
        let found = closed_form(&guess, 0.3, &observations, &RangeBias::default())?;
        assert!(beam::angle_between(&found.direction, &truth.exit_direction(0.3)) < 1e-10);
        Some(found)
    }

    #[test]
    fn exact_data_need_no_guess_and_give_a_unit_vector() {
        let found = found([[-0.9, 0.0, -0.4], [-0.5, 0.6, -0.6], [-0.5, -0.6, -0.6]]);
        assert!(found.expect("three orientations suffice").excess.abs() < 1e-12);
    }

    #[test]
    fn a_hinge_gives_no_start() {
        assert_eq!(
            found([[-0.9, 0.0, -0.4], [-0.6, 0.0, -0.6], [-0.2, 0.0, -0.9]]),
            None
        );
    }
}
