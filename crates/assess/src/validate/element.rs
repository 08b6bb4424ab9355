//! Validation of one element: a status consistent with the rest, plausible angles and distance, valid covariances.

use super::problem::OfBeam;
use super::sane::{ANGLE_SD_RAD, MIRROR_DISTANCE_M};
use super::sane::{check_covariance, is_unit};
use catoptric_model::{BeamEstimate, Calibration, Status};
use nalgebra::SVector;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What angles beyond their limits look like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Wraps {
    /// Radians to which whole turns were added: nothing is far beyond a turn.
    Turns,
    /// Degrees.
    Degrees,
}

impl Wraps {
    /// By all angles of a calibration: one alone can be both.
    pub(super) fn of(calibration: &Calibration) -> Self {
        let angles = calibration
            .beams
            .iter()
            .flat_map(|b| [b.azimuth_rad, b.elevation_rad]);
        let largest = angles.flatten().map(f64::abs).filter(|a| a.is_finite());
        match largest.fold(0.0, f64::max) <= PI + MOST_TURNS * TAU {
            true => Self::Turns,
            false => Self::Degrees,
        }
    }

    /// What a value beyond its limit would be.
    fn hint(self, value: f64, limit: f64) -> Option<String> {
        let turns = (value / TAU).round();
        let within = value - turns * TAU;
        match self {
            Self::Turns if turns.abs() == MOST_TURNS && within.abs() <= limit + ROUNDED => {
                let (too, change) = if turns > 0.0 {
                    ("much", "minus")
                } else {
                    ("little", "plus")
                };
                Some(format!(
                    "it looks like a whole turn too {too}: {change} 2π it is {within:.4} rad"
                ))
            }
            Self::Degrees if value.abs() > TAU => Some(format!(
                "it looks like degrees: {value}° is {:.4} rad",
                value.to_radians()
            )),
            Self::Turns | Self::Degrees => None,
        }
    }
}

/// Whole turns that angles in radians may have too much; degrees are hardly ever all below that.
const MOST_TURNS: f64 = 1.0;

/// Rounding to nine digits may move an angle this far beyond its limit.
const ROUNDED: f64 = 1e-9;

/// Checks one element.
pub(super) fn check_element(at: &mut OfBeam, b: &BeamEstimate, wraps: Wraps) {
    check_status(at, b);
    check_angles(at, b, wraps);
    check_covariances(at, b);
}

fn check_status(at: &mut OfBeam, b: &BeamEstimate) {
    let has_angles = b.azimuth_rad.is_some() || b.elevation_rad.is_some();
    match b.status {
        Status::Solved => {
            for (key, value) in [("azimuth_rad", b.azimuth_rad), ("elevation_rad", b.elevation_rad)] {
                if value.is_none() {
                    at.error(key, "is missing from a solved element".to_owned());
                }
            }
            if b.covariance_rad2.is_none() {
                at.warning("covariance_rad2", "is missing: how well is it known?".to_owned());
            }
        }
        Status::Direct => {
            if has_angles {
                at.error(
                    "status",
                    "is direct, but there are angles of deflection".to_owned(),
                );
            }
        }
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => {
            if b.reason.as_ref().is_none_or(|r| r.trim().is_empty()) {
                at.error(
                    "reason",
                    format!("is missing from an element that is {}", b.status.word()),
                );
            }
        }
    }
    if b.status == Status::Unobservable && has_angles {
        at.error(
            "azimuth_rad",
            "or elevation_rad is a number, but the element is unobservable: an unobservable angle is never a number"
                .to_owned(),
        );
    }
    if let Some(direction) = b.null_direction {
        let length = SVector::from(direction).norm();
        if !is_unit(length) {
            at.error(
                "null_direction",
                format!("has length {length}, a direction has length 1"),
            );
        }
    }
}

fn check_angles(at: &mut OfBeam, b: &BeamEstimate, wraps: Wraps) {
    for (key, value, limit, limit_name) in [
        ("azimuth_rad", b.azimuth_rad, PI, "π"),
        ("elevation_rad", b.elevation_rad, FRAC_PI_2, "π/2"),
    ] {
        match value {
            Some(value) if !value.is_finite() => at.error(key, format!("is {value}, not a number")),
            Some(value) if value.abs() > limit + ROUNDED => {
                let hint = wraps
                    .hint(value, limit)
                    .map_or_else(String::new, |hint| format!("; {hint}"));
                at.error(key, format!("is {value}, outside ±{limit_name}{hint}"));
            }
            _ => {}
        }
    }
    match b.distance_m {
        Some(d) if !d.is_finite() => at.error("distance_m", format!("is {d}, not a number")),
        Some(d) if d <= 0.0 => at.error(
            "distance_m",
            format!("is {d}, but a mirror has a positive distance"),
        ),
        Some(d) if d > MIRROR_DISTANCE_M => at.error(
            "distance_m",
            format!("is {d}, but a mirror is closer than {MIRROR_DISTANCE_M} m; it looks like millimeters"),
        ),
        _ => {}
    }
    match b.rms_residual_m {
        Some(r) if !(r.is_finite() && r >= 0.0) => {
            at.error(
                "rms_residual_m",
                format!("is {r}, but a root mean square is a non-negative number"),
            );
        }
        _ => {}
    }
}

fn check_covariances(at: &mut OfBeam, b: &BeamEstimate) {
    for (key, covariance) in [
        ("covariance_rad2", b.covariance_rad2),
        ("noise_covariance_rad2", b.noise_covariance_rad2),
    ] {
        let Some(covariance) = covariance else {
            continue;
        };
        if let Err(message) = check_covariance(&covariance) {
            at.error(key, message);
            continue;
        }
        let largest = covariance[0][0].max(covariance[1][1]).sqrt();
        let smallest = covariance[0][0].min(covariance[1][1]).sqrt();
        let [least, most] = ANGLE_SD_RAD;
        if largest > most {
            at.error(
                key,
                format!(
                    "means a standard deviation of {largest:.3} rad, which is meaningless; is it in degrees?"
                ),
            );
        } else if smallest < least {
            at.warning(
                key,
                format!("means a standard deviation of {smallest:e} rad, which no measurement attains"),
            );
        }
    }
}
