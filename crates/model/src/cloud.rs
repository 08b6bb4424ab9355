//! Point clouds: the lift of a planar scan into space, Cooper, Eqs. (9) and (10), and the cloud it gives.

use crate::beam::{self, Deflection};
use nalgebra::{Point3, Rotation3, Vector3};

crate::closed_set! {
    /// Frame of a cloud.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
    pub enum CloudFrame {
        /// The laser base frame.
        Sensor,
        /// The marker body on the superstructure.
        Rig,
        /// The frame of motion capture.
        #[default]
        Room,
    }
}

impl CloudFrame {
    /// The word used in files and commands.
    pub fn word(self) -> &'static str {
        match self {
            Self::Sensor => "sensor",
            Self::Rig => "rig",
            Self::Room => "room",
        }
    }

    /// A one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Sensor => "The laser base frame",
            Self::Rig => "The marker body on the superstructure",
            Self::Room => "The frame of motion capture",
        }
    }
}

/// A point and the reading it comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CloudPoint {
    /// Position, in meters.
    pub position: Point3<f64>,
    /// Beam.
    pub beam: usize,
    /// Index of the scan in its stretch, from 0.
    pub scan: usize,
}

/// A point cloud, with counts of the readings it omits.
#[derive(Debug, Clone, PartialEq)]
pub struct PointCloud {
    /// Its frame.
    pub frame: CloudFrame,
    /// Stretch it was made from.
    pub pose: usize,
    /// Whether the mounting was taken from the drawing because the calibration has none.
    pub mount_is_nominal: bool,
    /// The points, scan by scan.
    pub points: Vec<CloudPoint>,
    /// Number of readings that are not ranges: no return, too close, invalid.
    pub without_range: usize,
    /// Number of ranges of elements for which the calibration has no direction.
    pub without_direction: usize,
    /// Number of ranges of times for which motion capture gives the rig no pose.
    pub without_pose: usize,
    /// Number of elements for which the calibration has no direction.
    pub unsolved_elements: usize,
}

/// The rotation from the base beam's direction to the exit direction: Rz(θ_b + θ_a)·Ry(−φ)·Rz(−θ_b).
///
/// The rotation of Eq. (9), written for a right-handed frame in which positive elevation points up. The paper calls it a
/// 3-2 sequence, and it is built of three turns: the last one turns the base beam back to the x axis. A literal sequence of
/// two, Rz(θ_b + θ_a)·Ry(−φ), would turn a beam that is not along x elsewhere.
pub fn rotation(deflection: &Deflection, beam_azimuth: f64) -> Rotation3<f64> {
    Rotation3::from_axis_angle(&Vector3::z_axis(), beam_azimuth + deflection.azimuth)
        * Rotation3::from_axis_angle(&Vector3::y_axis(), -deflection.elevation)
        * Rotation3::from_axis_angle(&Vector3::z_axis(), -beam_azimuth)
}

/// The point measured by a range of a deflected beam, in the sensor frame: PC = R·(P_0 − P_L1) + P_L1 — Eq. (9).
///
/// P_0 is the point at that range in the scan plane. A range shorter than the distance to the mirror stays in the
/// plane: it is a reading of the structure.
///
/// ```
/// use catoptric_model::{cloud, Deflection};
/// let up = Deflection { azimuth: 0.0, elevation: std::f64::consts::FRAC_PI_2, distance: 0.07 };
/// let point = cloud::lift(&up, 0.0, 2.07);
/// assert!((point.z - 2.0).abs() < 1e-12 && (point.x - 0.07).abs() < 1e-12);
/// ```
#[doc(alias = "PC_1")]
pub fn lift(deflection: &Deflection, beam_azimuth: f64, range: f64) -> Point3<f64> {
    let p_0 = Point3::from(beam::direction(beam_azimuth).into_inner() * range);
    if range <= deflection.distance {
        return p_0;
    }
    let p_l1 = deflection.deflection_point(beam_azimuth);
    p_l1 + rotation(deflection, beam_azimuth) * (p_0 - p_l1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equation_9_is_the_exit_ray() {
        for (theta_b, theta_a, phi, r) in [
            (1.2, 0.3, 0.8, 2.0),
            (-2.0, -1.0, -1.1, 0.6),
            (0.4, 2.5, 0.2, 9.0),
        ] {
            let deflection = Deflection {
                azimuth: theta_a,
                elevation: phi,
                distance: 0.07,
            };
            let along = deflection.deflection_point(theta_b)
                + deflection.exit_direction(theta_b).into_inner() * (r - deflection.distance);
            assert!((lift(&deflection, theta_b, r) - along).norm() < 1e-14);
        }
    }

    /// Two turns alone would put the exit of a beam at the side in another place, by meters at the range of a room.
    #[test]
    fn a_literal_sequence_of_two_turns_is_another_rotation() {
        let deflection = Deflection {
            azimuth: 0.3,
            elevation: 0.8,
            distance: 0.07,
        };
        let theta_b = 1.4;
        let beam = beam::direction(theta_b);
        let exit = deflection.exit_direction(theta_b);
        assert!((rotation(&deflection, theta_b) * beam.into_inner() - exit.into_inner()).norm() < 1e-15);
        let two = Rotation3::from_axis_angle(&Vector3::z_axis(), theta_b + deflection.azimuth)
            * Rotation3::from_axis_angle(&Vector3::y_axis(), -deflection.elevation);
        assert!(4.0 * (two * beam.into_inner() - exit.into_inner()).norm() > 3.0);
    }
}
