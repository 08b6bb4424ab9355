//! Whether a `calibration.json` is well formed and physically sane, whoever wrote it.

use catoptric_model::calibration::{self, Calibration, FacetEstimate, MountEstimate};
use catoptric_model::{BeamEstimate, RangeBias, Status, beam};
use nalgebra::{DMatrix, SVector};
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
                    "is direct, and yet there are angles of deflection".to_owned(),
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
            "or elevation_rad is a number, but the element is unobservable: what cannot be observed is never a number"
                .to_owned(),
        );
    }
    if let Some(direction) = b.null_direction {
        let length = SVector::from(direction).norm();
        if !is_unit(length) {
            at.error(
                "null_direction",
                format!("has length {length}, a direction has 1"),
            );
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
                    format!(
                        "; it looks like degrees: {value}° is {:.4} rad",
                        value.to_radians()
                    )
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
            at.error(
                "rms_residual_m",
                format!("is {r}, a root mean square is a number from 0"),
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
                    "means a standard deviation of {largest:.3} rad, which says nothing; is it in degrees?"
                ),
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

fn check_mount(problems: &mut Problems, mount: &MountEstimate) {
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

fn check_bias(problems: &mut Problems, bias: &RangeBias) {
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
        problems.error("bias", "holds something that is not a number".to_owned());
    }
}

/// A table of errors over nodes that have a name.
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

/// Whether a length is 1 up to rounding; not for NaN.
fn is_unit(length: f64) -> bool {
    (length - 1.0).abs() <= UNIT_TOLERANCE
}

/// Whether a coordinate is one of a structure around the scanner; not for NaN.
fn is_near(metres: f64) -> bool {
    metres.abs() <= MIRROR_DISTANCE_M
}

/// Whether a matrix can be a covariance: finite, symmetric, positive semi-definite.
fn check_covariance<const N: usize>(rows: &[[f64; N]; N]) -> Result<(), String> {
    let c = DMatrix::from_fn(N, N, |i, j| rows[i][j]);
    if !c.iter().all(|x| x.is_finite()) {
        return Err("holds something that is not a number".to_owned());
    }
    if (&c - c.transpose()).amax() > DEFINITE_TOLERANCE * c.amax() {
        return Err("is not symmetric".to_owned());
    }
    if let Some(negative) = c.diagonal().iter().find(|&&x| x < 0.0) {
        return Err(format!("has the negative variance {negative:e}"));
    }
    // Angles and shifts have different sizes: scaling to correlations makes one tolerance fit both.
    let scale = c.diagonal().map(|x| if x > 0.0 { x.sqrt().recip() } else { 1.0 });
    let correlation = DMatrix::from_fn(N, N, |i, j| c[(i, j)] * scale[i] * scale[j]);
    if correlation.symmetric_eigenvalues().min() < -DEFINITE_TOLERANCE {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{noisy, perfect, sample};

    /// A sound calibration after one change, and what is found wrong with it.
    fn after(change: impl FnOnce(&mut Calibration, usize)) -> Vec<Problem> {
        let truth = sample().truth;
        let mut calibration = noisy(&truth, 1e-3, 1);
        let solved = calibration
            .beams
            .iter()
            .position(|b| b.status == Status::Solved)
            .expect("some are solved");
        change(&mut calibration, solved);
        validate(&calibration)
    }

    fn one(problems: &[Problem]) -> &Problem {
        assert_eq!(problems.len(), 1, "{problems:?}");
        &problems[0]
    }

    #[test]
    fn a_sound_calibration_has_no_problem() {
        let truth = sample().truth;
        assert_eq!(validate(&noisy(&truth, 1e-3, 1)), []);
        assert_eq!(validate(&perfect(&truth)), []);
    }

    #[test]
    fn degrees_are_recognized() {
        let problems = after(|c, i| {
            for b in &mut c.beams {
                b.azimuth_rad = b.azimuth_rad.map(f64::to_degrees);
                b.elevation_rad = b.elevation_rad.map(f64::to_degrees);
            }
            c.beams[i].elevation_rad = Some(45.0);
        });
        assert!(problems.len() > 300);
        let at_45 = problems
            .iter()
            .find(|p| p.message.contains("is 45,"))
            .expect("it is found");
        assert_eq!(
            at_45.message,
            "is 45, outside ±π/2; it looks like degrees: 45° is 0.7854 rad"
        );
        assert!(at_45.key.ends_with("].elevation_rad") && at_45.severity == Severity::Error);
        assert_eq!(
            at_45.to_string(),
            format!(
                "error: {} (beam {}): {}",
                at_45.key,
                at_45.beam.expect("of a beam"),
                at_45.message
            )
        );
    }

    #[test]
    fn angles_have_limits_and_numbers() {
        let problem = after(|c, i| c.beams[i].azimuth_rad = Some(3.2));
        assert!(one(&problem).message.starts_with("is 3.2, outside ±π"));
        assert!(!one(&problem).message.contains("degrees"));
        for bad in [f64::NAN, f64::INFINITY] {
            let problem = after(|c, i| c.beams[i].elevation_rad = Some(bad));
            assert!(one(&problem).message.ends_with("not a number"));
        }
        let problem = after(|c, i| c.beams[i].elevation_rad = None);
        assert!(one(&problem).message.contains("missing from a solved element"));
    }

    #[test]
    fn distances_are_positive_metres() {
        assert!(
            one(&after(|c, i| c.beams[i].distance_m = Some(65.0)))
                .message
                .contains("millimetres")
        );
        assert!(
            one(&after(|c, i| c.beams[i].distance_m = Some(-0.06)))
                .key
                .ends_with("distance_m")
        );
        assert_eq!(after(|c, i| c.beams[i].distance_m = None), []);
    }

    #[test]
    fn a_covariance_is_symmetric_and_positive() {
        for (covariance, what) in [
            ([[1e-6, 2e-7], [-2e-7, 1e-6]], "is not symmetric"),
            ([[1e-6, 2e-6], [2e-6, 1e-6]], "is not positive semi-definite"),
            ([[-1e-6, 0.0], [0.0, 1e-6]], "has the negative variance -1e-6"),
            (
                [[f64::NAN, 0.0], [0.0, 1e-6]],
                "holds something that is not a number",
            ),
            (
                [[100.0, 0.0], [0.0, 1e-6]],
                "means a standard deviation of 10.000 rad, which says nothing; is it in degrees?",
            ),
        ] {
            let problems = after(|c, i| c.beams[i].covariance_rad2 = Some(covariance));
            assert_eq!(one(&problems).message, what);
            assert_eq!(one(&problems).severity, Severity::Error);
        }
        let tiny = after(|c, i| c.beams[i].covariance_rad2 = Some([[1e-24, 0.0], [0.0, 1e-24]]));
        assert_eq!(one(&tiny).severity, Severity::Warning);
        // Perfectly correlated is semi-definite, and sound.
        assert_eq!(
            after(|c, i| c.beams[i].covariance_rad2 = Some([[4e-6, 2e-6], [2e-6, 1e-6]])),
            []
        );
    }

    #[test]
    fn a_status_fits_the_rest() {
        let unsolved = |status, reason: Option<&str>, angle| {
            after(|c, i| {
                let mut b = BeamEstimate::without_angles(c.beams[i].beam, status, reason.map(str::to_owned));
                b.azimuth_rad = angle;
                c.beams[i] = b;
            })
        };
        assert!(
            one(&unsolved(Status::Rejected, None, None))
                .key
                .ends_with("reason")
        );
        assert!(
            one(&unsolved(Status::Rejected, Some(" "), None))
                .key
                .ends_with("reason")
        );
        assert!(
            one(&unsolved(Status::Unobservable, Some("one axis"), Some(0.1)))
                .message
                .contains("never a number")
        );
        assert_eq!(unsolved(Status::Direct, None, None), []);
        assert_eq!(unsolved(Status::Unobservable, Some("one axis"), None), []);
        assert!(
            one(&unsolved(Status::Direct, None, Some(0.1)))
                .key
                .ends_with("status")
        );
    }

    #[test]
    fn the_rest_of_the_file_is_looked_at_too() {
        let key = |change: fn(&mut Calibration, usize)| {
            let problems = after(change);
            one(&problems).key.clone()
        };
        assert_eq!(key(|c, _| c.schema_version = 2), "schema_version");
        assert_eq!(key(|c, _| c.frame = "room".to_owned()), "frame");
        assert_eq!(key(|c, _| c.method.clear()), "method");
        assert_eq!(key(|c, _| c.beams[3].beam = 1081), "beams[3].beam");
        assert_eq!(key(|c, _| c.beams[3].beam = 2), "beams[3].beam");
        assert_eq!(
            key(|c, i| c.beams[i].null_direction = Some([1.0, 1.0]))
                .split('.')
                .next_back(),
            Some("null_direction")
        );
        assert_eq!(
            key(|c, _| {
                let mount = c.rig_from_sensor.as_mut().expect("it has one");
                mount.rotation_xyzw = [0.0, 0.0, 0.0, 2.0];
            }),
            "rig_from_sensor.rotation_xyzw"
        );
        assert_eq!(
            key(|c, _| c.facets.push(FacetEstimate {
                facet: "port".to_owned(),
                normal: [0.0, 0.0, 1.1],
                offset_m: 0.05,
                covariance: [[0.0; 3]; 3],
            })),
            "facets[0].normal"
        );
        assert_eq!(
            key(|c, _| {
                let mut bias = RangeBias::default();
                bias.distance.range_m = vec![1.0];
                c.bias = Some(bias);
            }),
            "bias.distance"
        );
    }
}
