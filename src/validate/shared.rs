//! What elements share: facets, the mounting of the sensor, range biases.

use super::MIRROR_DISTANCE_M;
use super::problem::Problems;
use super::sane::{check_covariance, is_near, is_unit};
use catoptric_model::RangeBias;
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use nalgebra::SVector;

pub(super) fn check_facet(problems: &mut Problems, key: &str, facet: &FacetEstimate) {
    let length = SVector::from(facet.normal).norm();
    if !is_unit(length) {
        problems.error(
            &format!("{key}.normal"),
            format!("of {:?} has length {length}, a unit normal has 1", facet.facet),
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
    if let Err(message) = check_covariance(&facet.covariance) {
        problems.error(
            &format!("{key}.covariance"),
            format!("of {:?} {message}", facet.facet),
        );
    }
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
            format!("has length {length}, a unit quaternion has 1"),
        );
    }
    if let Some(covariance) = mount.covariance
        && let Err(message) = check_covariance(&covariance)
    {
        problems.error("rig_from_sensor.covariance", message);
    }
}

pub(super) fn check_bias(problems: &mut Problems, bias: &RangeBias) {
    let table = &bias.distance;
    if table.range_m.len() != table.error_mm.len() {
        problems.error(
            "bias.distance",
            format!(
                "has {} ranges and {} errors",
                table.range_m.len(),
                table.error_mm.len()
            ),
        );
    }
    if !table
        .range_m
        .iter()
        .zip(table.range_m.iter().skip(1))
        .all(|(a, b)| a < b)
    {
        problems.error("bias.distance.range_m", "does not increase".to_owned());
    }
    let lines = bias.color.values().flat_map(|c| [c.slope_mm_per_m, c.offset_mm]);
    let numbers = lines
        .chain([bias.angle.gain_mm, bias.angle.offset_mm])
        .chain(table.error_mm.iter().copied());
    if !numbers.into_iter().all(f64::is_finite) {
        problems.error("bias", "holds something that is not a number".to_owned());
    }
}
