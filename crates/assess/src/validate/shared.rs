//! Validation of what elements share: facets, the mounting of the sensor, range biases.

use super::problem::Problems;
use super::sane::{ANGLE_SD_RAD, MIRROR_DISTANCE_M};
use super::sane::{check_covariance, is_near, is_unit};
use catoptric_model::RangeBias;
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use nalgebra::SVector;

pub(super) fn check_facet(problems: &mut Problems, key: &str, facet: &FacetEstimate) {
    let length = SVector::from(facet.normal).norm();
    if !is_unit(length) {
        problems.error(
            &format!("{key}.normal"),
            format!(
                "of {:?} has length {length}, a unit normal has length 1",
                facet.facet
            ),
        );
    }
    if !is_near(facet.offset_m) {
        problems.error(
            &format!("{key}.offset_m"),
            format!(
                "of {:?} is {}, not within {MIRROR_DISTANCE_M} m",
                facet.facet, facet.offset_m
            ),
        );
    }
    let checked =
        check_covariance(&facet.covariance).and_then(|()| check_meaning(&facet.covariance, |i| i < 2));
    if let Err(message) = checked {
        problems.error(
            &format!("{key}.covariance"),
            format!("of {:?} {message}", facet.facet),
        );
    }
}

/// Checks the standard deviations of a covariance, of lengths and of angles: as large as what they describe, they mean nothing.
fn check_meaning<const N: usize>(rows: &[[f64; N]; N], is_angle: fn(usize) -> bool) -> Result<(), String> {
    for (i, row) in rows.iter().enumerate() {
        let sd = row[i].sqrt();
        let (most, unit) = if is_angle(i) {
            (ANGLE_SD_RAD[1], "rad")
        } else {
            (MIRROR_DISTANCE_M, "m")
        };
        if sd > most {
            return Err(format!(
                "means a standard deviation of {sd:.3} {unit} in row {i}, which is meaningless"
            ));
        }
    }
    Ok(())
}

pub(super) fn check_mount(problems: &mut Problems, mount: &MountEstimate) {
    if !mount.translation_m.iter().all(|&x| is_near(x)) {
        problems.error(
            "rig_from_sensor.translation_m",
            format!("is {:?}, not within {MIRROR_DISTANCE_M} m", mount.translation_m),
        );
    }
    let length = SVector::from(mount.rotation_xyzw).norm();
    if !is_unit(length) {
        problems.error(
            "rig_from_sensor.rotation_xyzw",
            format!("has length {length}, a unit quaternion has length 1"),
        );
    }
    if let Some(covariance) = mount.covariance {
        let checked = check_covariance(&covariance).and_then(|()| check_meaning(&covariance, |i| i > 2));
        if let Err(message) = checked {
            problems.error("rig_from_sensor.covariance", message);
        }
    }
}

pub(super) fn check_bias(problems: &mut Problems, bias: &RangeBias) {
    let distance = &bias.distance;
    check_table(
        problems,
        "bias.distance",
        ("range_m", &distance.range_m),
        &distance.error_mm,
    );
    if let Some(table) = &bias.angle.table {
        let nodes = ("incidence_deg", table.incidence_deg.as_slice());
        check_table(problems, "bias.angle.table", nodes, &table.error_mm);
    }
    let lines = bias.color.values().flat_map(|c| [c.slope_mm_per_m, c.offset_mm]);
    let numbers = lines
        .chain([bias.angle.gain_mm, bias.angle.offset_mm])
        .chain(distance.error_mm.iter().copied())
        .chain(bias.angle.table.iter().flat_map(|t| t.error_mm.iter().copied()));
    if !numbers.into_iter().all(f64::is_finite) {
        problems.error("bias", "contains a value that is not a number".to_owned());
    }
}

/// Checks a table of errors over named nodes.
fn check_table(problems: &mut Problems, table: &str, (name, nodes): (&str, &[f64]), error_mm: &[f64]) {
    if nodes.len() != error_mm.len() {
        let what = name.split('_').next().unwrap_or(name);
        problems.error(
            table,
            format!("has {} {what}s and {} errors", nodes.len(), error_mm.len()),
        );
    }
    if !nodes.iter().zip(nodes.iter().skip(1)).all(|(a, b)| a < b) {
        problems.error(&format!("{table}.{name}"), "does not increase".to_owned());
    }
}
