//! Beams of the bare scanner and their deflection by a mirror: base direction, deflection, exit direction.

use nalgebra::{Point3, Unit, Vector3};
use serde::{Deserialize, Serialize};

/// Direction of an undeflected beam: (cos θ_b, sin θ_b, 0).
pub fn direction(azimuth: f64) -> Unit<Vector3<f64>> {
    let (sin, cos) = libm::sincos(azimuth);
    Unit::new_unchecked(Vector3::new(cos, sin, 0.0))
}

/// Direction with the given azimuth and elevation: (cos φ·cos α, cos φ·sin α, sin φ).
pub fn spherical(azimuth: f64, elevation: f64) -> Unit<Vector3<f64>> {
    let (sin_a, cos_a) = libm::sincos(azimuth);
    let (sin_e, cos_e) = libm::sincos(elevation);
    Unit::new_unchecked(Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e))
}

/// What the mirror does to one beam: the three numbers that a calibration determines.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Deflection {
    /// Azimuth added by the mirror, in radians.
    #[doc(alias = "theta_a")]
    pub azimuth: f64,
    /// Elevation of the outgoing ray above the scan plane, in radians.
    #[doc(alias = "phi")]
    pub elevation: f64,
    /// Distance from the sensor origin to the deflection point, in meters.
    #[doc(alias = "d")]
    pub distance: f64,
}

impl Deflection {
    /// The deflection of an undeflected beam.
    pub const NONE: Self = Self {
        azimuth: 0.0,
        elevation: 0.0,
        distance: 0.0,
    };

    /// Direction v of the outgoing ray in the sensor frame.
    pub fn exit_direction(&self, beam_azimuth: f64) -> Unit<Vector3<f64>> {
        spherical(beam_azimuth + self.azimuth, self.elevation)
    }

    /// The point P_L1 = d·(cos θ_b, sin θ_b, 0) at which the beam leaves the scan plane, in the sensor frame.
    #[doc(alias = "P_L1")]
    pub fn deflection_point(&self, beam_azimuth: f64) -> Point3<f64> {
        Point3::from(direction(beam_azimuth).into_inner() * self.distance)
    }

    /// The deflection of a beam that exits in a given direction; the added azimuth is within (−π, π].
    pub fn from_exit(beam_azimuth: f64, exit: &Unit<Vector3<f64>>, distance: f64) -> Self {
        // In a frame rotated by θ_b, the added azimuth is read off directly, without wrap-around.
        let (sin, cos) = libm::sincos(beam_azimuth);
        let along = exit.x * cos + exit.y * sin;
        let across = exit.y * cos - exit.x * sin;
        Self {
            azimuth: libm::atan2(across, along),
            elevation: libm::atan2(exit.z, libm::hypot(exit.x, exit.y)),
            distance,
        }
    }
}

/// Angle between two directions, in radians: accurate for small angles, unlike an arc cosine.
pub fn angle_between(a: &Unit<Vector3<f64>>, b: &Unit<Vector3<f64>>) -> f64 {
    libm::atan2(a.cross(b).norm(), a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn from_exit_inverts_exit_direction() {
        for (theta_b, theta_a, phi) in [(2.3, 1.0, 0.7), (-2.3, -2.9, -1.2), (0.0, 3.1, 0.1)] {
            let given = Deflection {
                azimuth: theta_a,
                elevation: phi,
                distance: 0.07,
            };
            let back = Deflection::from_exit(theta_b, &given.exit_direction(theta_b), 0.07);
            assert!((back.azimuth - theta_a).abs() < 1e-14 && (back.elevation - phi).abs() < 1e-14);
        }
    }
}
