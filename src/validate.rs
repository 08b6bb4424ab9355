//! Whether a `calibration.json` is well formed and physically sane, whoever wrote it.

use catoptric_model::calibration::{self, Calibration, FacetEstimate, MountEstimate};
use catoptric_model::{BeamEstimate, RangeBias, Status, beam};
use nalgebra::{SMatrix, SVector};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::fmt;

/// Distances from the scanner at which a mirror can be, in metres: beyond, millimetres were meant.
pub const MIRROR_DISTANCE_M: f64 = 10.0;

/// Standard deviations an angle can have, in radians: a millionth of the least that was ever measured, and a turn
/// that says nothing.
pub const ANGLE_SD_RAD: [f64; 2] = [1e-10, PI];

/// How far the length of a normal or a quaternion may be from 1: what rounding to nine digits leaves, and more.
const UNIT_TOLERANCE: f64 = 1e-6;

/// Negative eigenvalue, as a share of the largest, that rounding explains.
const DEFINITE_TOLERANCE: f64 = 1e-9;

/// How grave a problem is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Odd, but it can be scored and applied.
    Warning,
    /// The file does not say what it has to, or says what cannot be.
    Error,
}

/// Something wrong with a calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// How grave it is.
    pub severity: Severity,
    /// Key in the file, such as `beams[3].azimuth_rad`.
    pub key: String,
    /// Beam it is about.
    pub beam: Option<usize>,
    /// What is wrong.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let severity = match self.severity {
            Severity::Warning => "warning",
            Severity::Error => "error",
        };
        write!(f, "{severity}: {}", self.key)?;
        if let Some(beam) = self.beam {
            write!(f, " (beam {beam})")?;
        }
        write!(f, ": {}", self.message)
    }
}

/// Everything wrong with a calibration, in the order of the file; nothing if it is sound.
///
/// ```
/// use catoptric::model::Calibration;
/// let calibration = Calibration {
///     schema_version: 1,
///     method: "mine".to_owned(),
///     frame: "room".to_owned(),
///     beams: Vec::new(),
///     facets: Vec::new(),
///     rig_from_sensor: None,
///     bias: None,
/// };
/// let problems = catoptric::validate(&calibration);
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
        check_status(&mut at, estimate);
        check_angles(&mut at, estimate);
        check_covariances(&mut at, estimate);
    }
    let mut names = BTreeSet::new();
    for (place, facet) in calibration.facets.iter().enumerate() {
        let key = format!("facets[{place}]");
        if !names.insert(&facet.facet) {
            problems.error(&format!("{key}.facet"), format!("{:?} is listed more than once", facet.facet));
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
                at.error("status", "is direct, and yet there are angles of deflection".to_owned());
            }
        }
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => {
            if b.reason.as_ref().is_none_or(|r| r.trim().is_empty()) {
                at.error("reason", format!("is missing from an element that is {}", b.status.word()));
            }
        }
    }
    if b.status == Status::Unobservable && has_angles {
        at.error(
            "azimuth_rad",
            "or elevation_rad is a number, but the element is unobservable: what cannot be observed is never a number"
                .to_owned(),
        );
    }
    if let Some(direction) = b.null_direction {
        let length = SVector::from(direction).norm();
        if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
            at.error("null_direction", format!("has length {length}, a direction has 1"));
        }
    }
}

fn check_angles(at: &mut OfBeam, b: &BeamEstimate) {
    for (key, value, limit, limit_name) in [
        ("azimuth_rad", b.azimuth_rad, PI, "π"),
        ("elevation_rad", b.elevation_rad, FRAC_PI_2, "π/2"),
    ] {
        match value {
            Some(value) if !value.is_finite() => at.error(key, format!("is {value}, not a number")),
            // Rounding to nine digits may carry an angle that far beyond its limit.
            Some(value) if value.abs() > limit + 1e-9 => {
                let hint = if value.abs() > TAU {
                    format!("; it looks like degrees: {value}° is {:.4} rad", value.to_radians())
                } else {
                    String::new()
                };
                at.error(key, format!("is {value}, outside ±{limit_name}{hint}"));
            }
            _ => {}
        }
    }
    match b.distance_m {
        Some(d) if !d.is_finite() => at.error("distance_m", format!("is {d}, not a number")),
        Some(d) if d <= 0.0 => at.error("distance_m", format!("is {d}, a mirror is farther than 0")),
        Some(d) if d > MIRROR_DISTANCE_M => at.error(
            "distance_m",
            format!("is {d}, a mirror is nearer than {MIRROR_DISTANCE_M} m; it looks like millimetres"),
        ),
        _ => {}
    }
    match b.rms_residual_m {
        Some(r) if !(r.is_finite() && r >= 0.0) => {
            at.error("rms_residual_m", format!("is {r}, a root mean square is a number from 0"));
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
        if let Err(message) = check_covariance(&SMatrix::from(covariance).transpose()) {
            at.error(key, message);
            continue;
        }
        let largest = covariance[0][0].max(covariance[1][1]).sqrt();
        let smallest = covariance[0][0].min(covariance[1][1]).sqrt();
        let [least, most] = ANGLE_SD_RAD;
        if largest > most {
            at.error(
                key,
                format!("means a standard deviation of {largest:.3} rad, which says nothing; is it in degrees?"),
            );
        } else if smallest < least {
            at.warning(
                key,
                format!("means a standard deviation of {smallest:e} rad, which no measurement has"),
            );
        }
    }
}

fn check_facet(problems: &mut Problems, key: &str, facet: &FacetEstimate) {
    let length = SVector::from(facet.normal).norm();
    if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
        problems.error(
            &format!("{key}.normal"),
            format!("of {:?} has length {length}, a unit normal has 1", facet.facet),
        );
    }
    if !(facet.offset_m.abs() <= MIRROR_DISTANCE_M) {
        problems.error(
            &format!("{key}.offset_m"),
            format!("of {:?} is {}, not within {MIRROR_DISTANCE_M} m", facet.facet, facet.offset_m),
        );
    }
    if let Err(message) = check_covariance(&SMatrix::from(facet.covariance).transpose()) {
        problems.error(&format!("{key}.covariance"), format!("of {:?} {message}", facet.facet));
    }
}

fn check_mount(problems: &mut Problems, mount: &MountEstimate) {
    if !mount.translation_m.iter().all(|x| x.abs() <= MIRROR_DISTANCE_M) {
        problems.error(
            "rig_from_sensor.translation_m",
            format!("is {:?}, not within {MIRROR_DISTANCE_M} m", mount.translation_m),
        );
    }
    let length = SVector::from(mount.rotation_xyzw).norm();
    if !((length - 1.0).abs() <= UNIT_TOLERANCE) {
        problems.error(
            "rig_from_sensor.rotation_xyzw",
            format!("has length {length}, a unit quaternion has 1"),
        );
    }
    if let Some(covariance) = mount.covariance
        && let Err(message) = check_covariance(&SMatrix::from(covariance).transpose())
    {
        problems.error("rig_from_sensor.covariance", message);
    }
}

fn check_bias(problems: &mut Problems, bias: &RangeBias) {
    let table = &bias.distance;
    if table.range_m.len() != table.error_mm.len() {
        problems.error(
            "bias.distance",
            format!("has {} ranges and {} errors", table.range_m.len(), table.error_mm.len()),
        );
    }
    if !table.range_m.iter().zip(table.range_m.iter().skip(1)).all(|(a, b)| a < b) {
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

/// Whether a matrix can be a covariance: finite, symmetric, positive semi-definite.
fn check_covariance<const N: usize>(c: &SMatrix<f64, N, N>) -> Result<(), String> {
    if !c.iter().all(|x| x.is_finite()) {
        return Err("holds something that is not a number".to_owned());
    }
    if (c - c.transpose()).abs().max() > DEFINITE_TOLERANCE * c.abs().max() {
        return Err("is not symmetric".to_owned());
    }
    // Angles and shifts have different sizes: scaling to correlations makes one tolerance fit both.
    if let Some(negative) = c.diagonal().iter().find(|&&x| x < 0.0) {
        return Err(format!("has the negative variance {negative:e}"));
    }
    let scale = c.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 1.0 });
    let correlation = SMatrix::<f64, N, N>::from_fn(|i, j| c[(i, j)] * scale[i] * scale[j]);
    // Eigenvalues through singular values, which need no type-level arithmetic: for a symmetric matrix the sum of
    // both kinds differs exactly if an eigenvalue is negative.
    let lack = correlation.svd(false, false).singular_values.sum() - correlation.trace();
    if lack > 2.0 * DEFINITE_TOLERANCE * N as f64 {
        return Err("is not positive semi-definite".to_owned());
    }
    Ok(())
}

#[derive(Default)]
struct Problems {
    list: Vec<Problem>,
}

impl Problems {
    fn error(&mut self, key: &str, message: String) {
        self.list.push(Problem {
            severity: Severity::Error,
            key: key.to_owned(),
            beam: None,
            message,
        });
    }

    fn of_beam(&mut self, place: usize, beam: usize) -> OfBeam<'_> {
        OfBeam {
            list: &mut self.list,
            place,
            beam,
        }
    }
}

struct OfBeam<'a> {
    list: &'a mut Vec<Problem>,
    place: usize,
    beam: usize,
}

impl OfBeam<'_> {
    fn error(&mut self, key: &str, message: String) {
        self.push(Severity::Error, key, message);
    }

    fn warning(&mut self, key: &str, message: String) {
        self.push(Severity::Warning, key, message);
    }

    fn push(&mut self, severity: Severity, key: &str, message: String) {
        self.list.push(Problem {
            severity,
            key: format!("beams[{}].{key}", self.place),
            beam: Some(self.beam),
            message,
        });
    }
}
