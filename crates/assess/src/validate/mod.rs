//! Validation of a `calibration.json` from any source: whether it is well formed and physically plausible.

mod element;
mod problem;
mod sane;
mod shared;

use catoptric_model::calibration::{self, Calibration};
use catoptric_model::place::nearest;
use catoptric_model::{ScanGeometry, Session};
use element::{Wraps, check_element};
use problem::Problems;
use shared::{check_bias, check_facet, check_mount};
use std::collections::BTreeSet;

pub use problem::{Problem, Severity};
pub use sane::{ANGLE_SD_RAD, MIRROR_DISTANCE_M};

/// Hexadecimal digits of a SHA-256.
const SHA256_DIGITS: usize = 64;

/// Everything wrong with a calibration, in the order of the file; nothing if it is sound.
///
/// ```
/// use catoptric_model::Calibration;
/// let calibration = Calibration {
///     schema_version: 1,
///     method: "mine".to_owned(),
///     frame: "room".to_owned(),
///     scanner: None,
///     dataset: None,
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
    check(calibration, None)
}

/// Everything wrong with a calibration for use with a dataset of this session: as [`validate`], and it must be of the same
/// scanner, which is the session's if it states none, and name no mirrors but the session's.
pub fn validate_for(calibration: &Calibration, session: &Session) -> Vec<Problem> {
    let mut found = check(calibration, Some(session));
    if let Err(error) = calibration.check_scanner(session) {
        let mut problems = Problems::default();
        problems.error("scanner", format!("does not fit: {error}"));
        found.extend(problems.list);
    }
    found.extend(unknown_facets(calibration, session));
    found
}

/// Names of facets that the session does not have. One without any facets, of a laboratory that did not list them, knows none.
fn unknown_facets(calibration: &Calibration, session: &Session) -> Vec<Problem> {
    let mut problems = Problems::default();
    if session.facets.is_empty() {
        return problems.list;
    }
    let names = || session.facets.iter().map(|f| f.name.as_str());
    let wrong = |name: &str| {
        let help = match nearest(name, names()) {
            Some(near) => format!("did you mean {near:?}?"),
            None => format!(
                "it has {}",
                names().map(|n| format!("{n:?}")).collect::<Vec<_>>().join(", ")
            ),
        };
        (!names().any(|known| known == name))
            .then(|| format!("is {name:?}, a mirror that the session does not have; {help}"))
    };
    for (place, estimate) in calibration.beams.iter().enumerate() {
        if let Some(message) = estimate.facet.as_deref().and_then(wrong) {
            problems.of_beam(place, estimate.beam).error("facet", message);
        }
    }
    for (place, facet) in calibration.facets.iter().enumerate() {
        if let Some(message) = wrong(&facet.facet) {
            problems.error(&format!("facets[{place}].facet"), message);
        }
    }
    problems.list
}

fn check(calibration: &Calibration, session: Option<&Session>) -> Vec<Problem> {
    let mut problems = Problems::default();
    if !(1..=calibration::SCHEMA_VERSION).contains(&calibration.schema_version) {
        problems.error(
            "schema_version",
            format!(
                "is {}, but this program reads 1 to {}",
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
    if let Some(Err(wrong)) = calibration.scanner.map(|angles| angles.check()) {
        problems.error(&format!("scanner.{}", wrong.key), wrong.problem);
    }
    // Who does not say which scanner it is has the usual one.
    let beams = calibration.scanner.map_or_else(
        || session.map_or(ScanGeometry::default().beams(), |s| s.scanner.scan.beams()),
        |angles| angles.beams,
    );
    if let Some(id) = &calibration.dataset
        && !(id.len() == SHA256_DIGITS && id.chars().all(|c| c.is_ascii_hexdigit()))
    {
        problems.error(
            "dataset",
            format!("is {id:?}; the SHA-256 of observations.mcap has {SHA256_DIGITS} hexadecimal digits"),
        );
    }
    if calibration.beams.is_empty() {
        problems.error("beams", "lists no element".to_owned());
    }
    let wraps = Wraps::of(calibration);
    let mut seen = BTreeSet::new();
    for (place, estimate) in calibration.beams.iter().enumerate() {
        let mut at = problems.of_beam(place, estimate.beam);
        if estimate.beam >= beams {
            let which = match (calibration.scanner, session) {
                (Some(_), _) => "of `scanner`",
                (None, Some(_)) => "of the dataset's scanner",
                (None, None) => "of the UST-20LX; name another `scanner`",
            };
            at.error(
                "beam",
                format!("is not among the beams 0…{} {which}", beams.saturating_sub(1)),
            );
        }
        if !seen.insert(estimate.beam) {
            at.error("beam", "is listed more than once".to_owned());
        }
        check_element(&mut at, estimate, wraps);
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
