//! Calibrations to judge: the truth itself, with noise, with a turn.

use super::Noise;
use catoptric_model::calibration::{MountEstimate, SCHEMA_VERSION};
use catoptric_model::{BeamEstimate, Calibration, Deflection, Status, beam};
use catoptric_sim::Truth;
use catoptric_sim::truth::{BeamClass, TrueBeam};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// The truth as a submission: every deflected beam solved, split ones rejected.
pub(crate) fn perfect(truth: &Truth) -> Calibration {
    let estimate = |b: &TrueBeam| {
        let without = |status, reason: Option<&str>| {
            BeamEstimate::without_angles(b.beam, status, reason.map(str::to_owned))
        };
        match b.status {
            BeamClass::Direct => without(Status::Direct, None),
            BeamClass::Deflected => BeamEstimate {
                facet: b.facets.first().cloned(),
                azimuth_rad: b.azimuth_rad,
                elevation_rad: b.elevation_rad,
                distance_m: b.distance_m,
                covariance_rad2: Some([[1e-6, 0.0], [0.0, 1e-6]]),
                poses: Some(6),
                readings: Some(600),
                iterations: Some(3),
                rms_residual_m: Some(0.0),
                ..without(Status::Solved, None)
            },
            BeamClass::Split | BeamClass::MultiBounce => without(
                Status::Rejected,
                Some("spread of 9 mm on 3 boards: it falls on an edge"),
            ),
            BeamClass::Blocked | BeamClass::Lost => {
                without(Status::TooFewPoses, Some("1 board, 3 are needed"))
            }
        }
    };
    Calibration {
        schema_version: SCHEMA_VERSION,
        method: "oracle".to_owned(),
        frame: "sensor".to_owned(),
        beams: truth.beams.iter().map(estimate).collect(),
        facets: Vec::new(),
        rig_from_sensor: Some(MountEstimate {
            translation_m: truth.rig_from_sensor.translation_m,
            rotation_xyzw: truth.rig_from_sensor.rotation_xyzw,
            covariance: None,
        }),
        bias: None,
        warnings: Vec::new(),
        assessment: None,
    }
}

/// A submission with independent errors of the given size per axis, in radians, and a covariance that says so.
pub(crate) fn noisy(truth: &Truth, sd: f64, seed: u64) -> Calibration {
    let mut noise = Noise::new(seed);
    let mut calibration = perfect(truth);
    calibration.method = "noisy".to_owned();
    for b in calibration
        .beams
        .iter_mut()
        .filter(|b| b.status == Status::Solved)
    {
        let cos = b.elevation_rad.map_or(1.0, f64::cos);
        b.azimuth_rad = b.azimuth_rad.map(|a| a + sd * noise.next() / cos);
        b.elevation_rad = b.elevation_rad.map(|e| e + sd * noise.next());
        b.distance_m = b.distance_m.map(|d| d + 0.5e-3 * noise.next());
        b.covariance_rad2 = Some([[(sd / cos).powi(2), 0.0], [0.0, sd * sd]]);
        b.rms_residual_m = Some(1e-3 * noise.next().abs());
    }
    calibration
}

/// The same with every direction turned by a rotation of the given angle about (1, 2, 2)/3.
pub(crate) fn turned(mut calibration: Calibration, angle: f64) -> Calibration {
    let axis = Unit::new_normalize(Vector3::new(1.0, 2.0, 2.0));
    let rotation = UnitQuaternion::from_axis_angle(&axis, angle);
    for b in &mut calibration.beams {
        if let Some(d) = b.deflection() {
            let azimuth = beam::azimuth(b.beam);
            let exit = Unit::new_unchecked(rotation * d.exit_direction(azimuth).into_inner());
            let d = Deflection::from_exit(azimuth, &exit, d.distance);
            b.azimuth_rad = Some(d.azimuth);
            b.elevation_rad = Some(d.elevation);
        }
    }
    calibration
}
