//! Errors of directions and points, from estimated and true rays in one frame.

use super::statistics::{best_rotation, largest, percentile, rms, rotation_angle};
use super::{ElementError, PointError, Spread};
use catoptric_model::frame::Pose;
use catoptric_model::{Deflection, ScanGeometry, beam};
use nalgebra::{Rotation3, Unit, Vector3};

/// Distances behind the mirror at which point errors are computed, in meters.
pub const POINT_RANGES_M: [f64; 3] = [1.0, 4.0, 10.0];

/// Errors of directions and points.
pub(super) struct Directions {
    errors: Vec<f64>,
    pub(super) per_axis_deg: f64,
    pub(super) common_mode_deg: f64,
    pub(super) differential_deg: f64,
    pub(super) point_mm: PointError,
}

impl Directions {
    pub(super) fn of(
        scan: &ScanGeometry,
        scored: &[&ElementError],
        believed_from_sensor: &Pose,
        actual_from_sensor: &Pose,
    ) -> Self {
        let ray = |beam: usize, deflection: &Deflection, pose: &Pose| {
            let azimuth = scan.azimuth(beam);
            let exit = deflection.exit_direction(azimuth);
            (
                pose * deflection.deflection_point(azimuth),
                Unit::new_unchecked(pose * exit.into_inner()),
            )
        };
        let rays: Vec<_> = scored
            .iter()
            .map(|e| {
                (
                    ray(e.beam, &e.truth, actual_from_sensor),
                    ray(e.beam, &e.estimate, believed_from_sensor),
                )
            })
            .collect();
        let pairs: Vec<_> = rays.iter().map(|((_, v), (_, found))| (*v, *found)).collect();
        let rotation = best_rotation(&pairs);
        let undo =
            |r: &Rotation3<f64>, v: &Unit<Vector3<f64>>| Unit::new_unchecked(r.inverse() * v.into_inner());
        let point_at = |s: f64| {
            1e3 * rms(rays.iter().map(|((p, v), (p_found, v_found))| {
                ((p_found + v_found.into_inner() * s) - (p + v.into_inner() * s)).norm()
            }))
        };
        let [near, middle, far] = POINT_RANGES_M.map(point_at);
        Self {
            errors: pairs
                .iter()
                .map(|(v, found)| beam::angle_between(v, found))
                .collect(),
            per_axis_deg: per_axis(pairs.iter().copied()).to_degrees(),
            common_mode_deg: rotation.as_ref().map_or(f64::NAN, rotation_angle).to_degrees(),
            differential_deg: rotation
                .map_or(f64::NAN, |r| {
                    per_axis(pairs.iter().map(|(v, found)| (*v, undo(&r, found))))
                })
                .to_degrees(),
            point_mm: PointError {
                at_1m: near,
                at_4m: middle,
                at_10m: far,
            },
        }
    }

    pub(super) fn spread_deg(&self) -> Spread {
        Spread {
            rms: rms(self.errors.iter().copied()).to_degrees(),
            median: percentile(&self.errors, 0.5).to_degrees(),
            p95: percentile(&self.errors, 0.95).to_degrees(),
            max: largest(self.errors.iter().copied()).to_degrees(),
        }
    }
}

/// Per-axis error of pairs (true, found), in radians: the length of the error in the tangent plane divided by √2.
///
/// Agrees with (cos φ·δθ, δφ) for small errors, but unlike it is not singular at φ = 90°.
fn per_axis(pairs: impl Iterator<Item = (Unit<Vector3<f64>>, Unit<Vector3<f64>>)>) -> f64 {
    rms(pairs.map(|(v, found)| beam::angle_between(&v, &found))) / std::f64::consts::SQRT_2
}
