//! Whether a `calibration.json` is well formed and physically sane, whoever wrote it.

mod element;
mod problem;
mod sane;
mod shared;

use catoptric_model::beam;
use catoptric_model::calibration::{self, Calibration};
use element::check_element;
use problem::Problems;
use shared::{check_bias, check_facet, check_mount};
use std::collections::BTreeSet;
use std::f64::consts::PI;

pub use problem::{Problem, Severity};

/// Distances from the scanner at which a mirror can be, in metres: beyond, millimetres were meant.
pub const MIRROR_DISTANCE_M: f64 = 10.0;

/// Standard deviations an angle can have, in radians: a millionth of the least that was ever measured, and a turn
/// that says nothing.
pub const ANGLE_SD_RAD: [f64; 2] = [1e-10, PI];

/// Everything wrong with a calibration, in the order of the file; nothing if it is sound.
///
/// ```
/// use catoptric_model::Calibration;
/// let calibration = Calibration {
///     schema_version: 1,
///     method: "mine".to_owned(),
///     frame: "room".to_owned(),
///     beams: Vec::new(),
///     facets: Vec::new(),
///     rig_from_sensor: None,
///     bias: None,
///     warnings: Vec::new(),
///     assessment: None,
/// };
/// let problems = catoptric_assess::validate(&calibration);
/// assert_eq!(problems[0].key, "frame");
/// ```
pub fn validate(calibration: &Calibration) -> Vec<Problem> {
    let mut problems = Problems::default();
    if calibration.schema_version != calibration::SCHEMA_VERSION {
        problems.error(
            "schema_version",
            format!(
                "is {}, this program reads {}",
                calibration.schema_version,
                calibration::SCHEMA_VERSION
            ),
        );
    }
    if calibration.method.trim().is_empty() {
        problems.error("method", "is empty; name the method".to_owned());
    }
    if calibration.frame != "sensor" {
        problems.error(
            "frame",
            format!("is {:?}; angles are given in \"sensor\"", calibration.frame),
        );
    }
    if calibration.beams.is_empty() {
        problems.error("beams", "lists no element".to_owned());
    }
    let mut seen = BTreeSet::new();
    for (place, estimate) in calibration.beams.iter().enumerate() {
        let mut at = problems.of_beam(place, estimate.beam);
        if estimate.beam >= beam::COUNT {
            at.error("beam", format!("is not among 0…{}", beam::COUNT - 1));
        }
        if !seen.insert(estimate.beam) {
            at.error("beam", "is listed more than once".to_owned());
        }
        check_element(&mut at, estimate);
    }
    let mut names = BTreeSet::new();
    for (place, facet) in calibration.facets.iter().enumerate() {
        let key = format!("facets[{place}]");
        if !names.insert(&facet.facet) {
            problems.error(
                &format!("{key}.facet"),
                format!("{:?} is listed more than once", facet.facet),
            );
        }
        check_facet(&mut problems, &key, facet);
    }
    if let Some(mount) = &calibration.rig_from_sensor {
        check_mount(&mut problems, mount);
    }
    if let Some(bias) = &calibration.bias {
        check_bias(&mut problems, bias);
    }
    problems.list
}

#[cfg(test)]
mod tests;
