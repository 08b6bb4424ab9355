//! The range equation of a deflected beam, and the codes of readings that are not ranges.

use crate::beam::Deflection;
use crate::board::BoardPlane;
use serde::{Deserialize, Serialize};

/// A range as the scanner reports it, including biases, in meters.
///
/// The paper writes r(x̂) before and after Eq. (3); here these are different types.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct RawRange(pub f64);

/// A range after Eq. (3), with biases subtracted, in meters.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd, Serialize, Deserialize)]
pub struct CorrectedRange(pub f64);

/// Range of a deflected beam to a plane, in meters: r = d + s — Cooper, Eq. (6).
///
/// `None` if the outgoing ray does not hit the plane.
#[doc(alias = "r")]
pub fn predict(deflection: &Deflection, beam_azimuth: f64, board: &BoardPlane) -> Option<f64> {
    let s = board.distance_along(
        &deflection.deflection_point(beam_azimuth),
        &deflection.exit_direction(beam_azimuth),
    )?;
    Some(deflection.distance + s)
}

/// The ROS codes of a reading that is not a range (REP-117): too close is −∞, no return is +∞, invalid is NaN.
pub const TOO_CLOSE: f64 = f64::NEG_INFINITY;
/// No object, too far, or too dark.
pub const NO_RETURN: f64 = f64::INFINITY;
/// The scanner marks the reading as unusable.
pub const INVALID: f64 = f64::NAN;

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Unit, Vector3};

    #[test]
    fn a_45_degree_mirror_adds_its_two_legs() {
        // Forward beam, mirror at 1.25 m turning it to the left, wall 2.5 m to the left.
        let deflection = Deflection {
            azimuth: std::f64::consts::FRAC_PI_2,
            elevation: 0.0,
            distance: 1.25,
        };
        let wall = BoardPlane::new(Point3::new(0.0, 2.5, 0.0), Unit::new_normalize(-Vector3::y()));
        let r = predict(&deflection, 0.0, &wall).expect("it meets the wall");
        assert!((r - 3.75).abs() < 1e-15);
    }
}
