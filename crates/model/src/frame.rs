//! Frames and poses: their names, their form in files, interpolation, and small rotations.
//!
//! `room_from_sensor * sensor_from_board` is `room_from_board`: the inner names cancel.

use crate::limits;
use nalgebra::{Isometry3, Quaternion, Translation3, Unit, UnitQuaternion, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rigid transform named `a_from_b`: it takes coordinates in frame b to coordinates in frame a.
pub type Pose = Isometry3<f64>;

/// A pose as stored in files: meters and a unit quaternion, scalar last (the order of ROS messages).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PoseData {
    /// Origin of b in frame a, in meters.
    #[schemars(inner(range(min = -limits::FAR_M, max = limits::FAR_M)))]
    pub translation_m: [f64; 3],
    /// Rotation from b to a as a unit quaternion (x, y, z, w).
    #[schemars(inner(range(min = -limits::UNIT, max = limits::UNIT)))]
    pub rotation_xyzw: [f64; 4],
}

impl From<&Pose> for PoseData {
    fn from(pose: &Pose) -> Self {
        let q = pose.rotation.quaternion();
        Self {
            translation_m: pose.translation.vector.into(),
            rotation_xyzw: [q.i, q.j, q.k, q.w],
        }
    }
}

impl From<&PoseData> for Pose {
    /// The quaternion is normalized because files round it.
    fn from(data: &PoseData) -> Self {
        let [x, y, z, w] = data.rotation_xyzw;
        Isometry3::from_parts(
            Translation3::from(Vector3::from(data.translation_m)),
            UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z)),
        )
    }
}

/// The rotation by yaw about z, then pitch about the new y, then roll about the new x (3-2-1), angles in radians.
///
/// Positive pitch lowers the x axis.
pub fn yaw_pitch_roll(yaw: f64, pitch: f64, roll: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_euler_angles(roll, pitch, yaw)
}

/// Spherical linear interpolation (slerp) between two attitudes along the shorter arc.
///
/// `share` is 0 at `from`, 1 at `to`, and may be outside of [0, 1]. Equal attitudes give exactly that attitude; between
/// attitudes half a turn apart, either arc may be taken.
pub fn slerp(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>, share: f64) -> UnitQuaternion<f64> {
    Arc::new(from, to).at(share)
}

/// The interpolation of [`slerp`] between two attitudes, for repeated evaluation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Arc {
    from: UnitQuaternion<f64>,
    /// Axis and angle of the rotation; `None` between equal attitudes.
    turn: Option<(Option<Unit<Vector3<f64>>>, f64)>,
}

impl Arc {
    /// The shorter arc from one attitude to another.
    pub fn new(from: &UnitQuaternion<f64>, to: &UnitQuaternion<f64>) -> Self {
        let turn = || from.inverse() * to;
        Self {
            from: *from,
            turn: (from != to).then(turn).map(|turn| (turn.axis(), turn.angle())),
        }
    }

    /// The attitude at a share of the arc.
    pub fn at(&self, share: f64) -> UnitQuaternion<f64> {
        let Some((axis, angle)) = &self.turn else {
            return self.from;
        };
        let turn = axis.map_or_else(UnitQuaternion::identity, |axis| {
            UnitQuaternion::from_axis_angle(&axis, angle * share)
        });
        UnitQuaternion::new_normalize((self.from * turn).into_inner())
    }
}

/// Two unit vectors `(across, up)` that span the plane perpendicular to a direction.
///
/// `across` is horizontal and points to increasing azimuth, `up` to increasing elevation; `(direction, across, up)` is
/// right-handed. Direction errors are expressed along them: (cos φ·δθ, δφ). For vertical directions, whose azimuth is
/// undefined, `across` is the y axis.
pub fn tangent_basis(direction: &Unit<Vector3<f64>>) -> (Unit<Vector3<f64>>, Unit<Vector3<f64>>) {
    let horizontal = libm::hypot(direction.x, direction.y);
    let across = if horizontal > 0.0 {
        Vector3::new(-direction.y / horizontal, direction.x / horizontal, 0.0)
    } else {
        Vector3::y()
    };
    let across = Unit::new_normalize(across);
    (across, Unit::new_normalize(direction.cross(&across)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    #[test]
    fn pose_survives_its_file_form() {
        let pose = Pose::from_parts(Translation3::new(0.1, -2.0, 3.5), yaw_pitch_roll(0.3, -0.2, 1.1));
        let back = Pose::from(&PoseData::from(&pose));
        let p = Point3::new(4.0, 5.0, -6.0);
        assert!((pose * p - back * p).norm() < 1e-14);
    }

    #[test]
    fn slerp_turns_at_a_constant_rate_along_the_shorter_arc() {
        let at = |angle: f64| yaw_pitch_roll(angle, 0.0, 0.0);
        for (from, to, share, expected) in [
            (0.2, 1.2, 0.25, 0.45),
            (0.2, 1.2, 1.5, 1.7),
            (3.0, -3.0, 0.5, std::f64::consts::PI),
        ] {
            assert!(slerp(&at(from), &at(to), share).angle_to(&at(expected)) < 1e-15);
        }
        let q = yaw_pitch_roll(0.3, -0.2, 1.1);
        assert_eq!(slerp(&q, &q, 0.37), q);
    }

    #[test]
    fn tangent_basis_is_right_handed_and_orthonormal() {
        for v in [
            Vector3::new(0.3, -0.8, 0.2),
            Vector3::z(),
            -Vector3::z(),
            Vector3::x(),
        ] {
            let v = Unit::new_normalize(v);
            let (across, up) = tangent_basis(&v);
            assert!(
                across.dot(&v).abs() < 1e-15 && up.dot(&v).abs() < 1e-15 && across.dot(&up).abs() < 1e-15
            );
            assert!((v.cross(&across) - up.into_inner()).norm() < 1e-15);
            assert!(across.z == 0.0);
        }
    }
}
