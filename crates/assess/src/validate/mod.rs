//! Validation of a `calibration.json` from any source: whether it is well formed and physically plausible.

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

/// Maximum distance of a mirror from the scanner, in meters; larger values are probably millimeters.
pub const MIRROR_DISTANCE_M: f64 = 10.0;

/// Minimum and maximum plausible standard deviation of an angle, in radians: a millionth of the smallest ever measured,
/// and half a turn, which is no information at all.
pub const ANGLE_SD_RAD: [f64; 2] = [1e-10, PI];

/// Returns all problems of a calibration, in the order of the file; none if it is valid.
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
                "is {}, but this program reads {}",
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
            format!("is {:?}, but angles are given in \"sensor\"", calibration.frame),
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
