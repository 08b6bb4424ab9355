//! How well a calibration came back: against the truth, or, without it, against surveyed boards and walls.
//!
//! Accuracy is counted over the *scored* elements: solved, and deflected without being split in truth. With
//! φ, θ the true angles of an element, δφ, δθ the errors of its estimate, e = (δθ, δφ), P the covariance stated for
//! it and C the bound on that covariance at the true angles:
//!
//! ```text
//! per-axis error    √(mean((cos φ·δθ)² + δφ²) / 2)
//! direction error   atan2(‖v̂×v‖, v̂·v)
//! common mode       angle of the rotation R that makes Σ‖v̂ − R·v‖² least
//! point error       √mean ‖(d̂ − d)·u + s·(v̂ − v)‖²           at s = 1, 4 and 10 m behind the mirror
//! NEES              mean(eᵀP⁻¹e) / 2                           1 where the covariance is honest
//! coverage          share of elements with eᵀP⁻¹e ≤ 5.991      0.95 where the covariance is honest
//! efficiency        mean(C_θθ·cos²φ + C_φφ) / mean((cos φ·δθ)² + δφ²)
//! ```
//!
//! Every element that the truth deflects unsplit is one of solved, abstained or missed. Figures that do not exist
//! are NaN here and `null` in JSON, with the reason in `nulls`.

mod bound;
pub mod residual;
mod statistics;
pub(crate) mod words;

use catoptric_model::beam::{self, Deflection};
use catoptric_model::frame::Pose;
use catoptric_model::{Calibration, Dataset, Status, Track, TrackedFrame};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use nalgebra::{Matrix2, Rotation3, Unit, Vector2, Vector3};
use serde::Serialize;
use std::collections::BTreeMap;

pub use residual::SurfaceResidual;
pub use statistics::percentile;
use statistics::{best_rotation, mahalanobis_squared, mean, rms, rotation_angle};

/// Version of what `score --json` prints.
pub const SCHEMA_VERSION: u32 = 1;

/// 95 % quantile of χ² with two degrees of freedom: −2·ln 0.05.
pub const CHI_SQUARED_95: f64 = 5.991_464_547_107_979;

/// Mean NEES above which a covariance is dishonest beyond bad luck.
///
/// Elements share errors, so the mean over one run scatters more than over independent draws: at worst all elements
/// have one and the same error, and the mean is a χ² of two degrees of freedom over two, which exceeds 6 with
/// probability e⁻⁶ = 0.25 %.
pub const DISHONEST_NEES: f64 = 6.0;

/// Distances behind the mirror at which point errors are given, in metres.
pub const POINT_RANGES_M: [f64; 3] = [1.0, 4.0, 10.0];

/// What a score comes to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// Nothing is wrong.
    Pass,
    /// An element is missed or false, the covariance is dishonest, or the error is above the limit set.
    Fail,
    /// There is no truth to judge by.
    Blind,
}

/// What became of the elements. Without a truth, solved and abstained count what the calibration says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct BeamCounts {
    /// Elements that are deflected and unsplit in truth: the sum of the next three. `None` without a truth.
    pub deflected: Option<usize>,
    /// Of these, those with a direction.
    pub solved: usize,
    /// Of these, those without a direction whose status says so and why.
    pub abstained: usize,
    /// Of these, those with neither: absent, called direct, or without a reason. `None` without a truth.
    pub missed: Option<usize>,
    /// Solved elements that are direct, blocked or lost in truth, or do not exist. `None` without a truth.
    #[serde(rename = "false")]
    pub wrong: Option<usize>,
}

/// Distribution of an angle, in degrees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Spread {
    /// Root mean square.
    pub rms: f64,
    /// Median.
    pub median: f64,
    /// 95th percentile; see [`percentile`].
    pub p95: f64,
    /// Largest.
    pub max: f64,
}

/// Errors of d, in millimetres.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct DistanceError {
    /// Root mean square.
    pub rms: f64,
    /// Largest absolute value.
    pub max: f64,
}

/// Root mean square displacement of a point, in millimetres, at three distances behind the mirror.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PointError {
    /// At 1 m.
    pub at_1m: f64,
    /// At 4 m.
    pub at_4m: f64,
    /// At 10 m.
    pub at_10m: f64,
}

/// Elements that are reported apart: split at an edge, or reflected more than once.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ApartScore {
    /// How many there are in truth.
    pub elements: usize,
    /// How many the calibration solved.
    pub solved: usize,
    /// Per-axis error of the chief ray, over those whose chief ray is deflected once.
    pub per_axis_rms_deg: f64,
}

/// Errors of one solved element, in radians, for plots.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementError {
    /// Beam.
    pub beam: usize,
    /// Facet that deflects it, in truth.
    pub facet: String,
    /// What the structure does to it.
    pub class: BeamClass,
    /// Truth.
    pub truth: Deflection,
    /// Estimate; d is 0 where the calibration gives none.
    pub estimate: Deflection,
    /// Whether the calibration gives d.
    pub has_distance: bool,
    /// cos φ·δθ.
    pub across: f64,
    /// δφ.
    pub up: f64,
    /// Stated standard deviations of `across` and `up`.
    pub sigma: Option<[f64; 2]>,
    /// eᵀP⁻¹e; `None` without a covariance.
    pub mahalanobis_squared: Option<f64>,
    /// Bound on the covariance of (`across`, `up`).
    pub bound: Option<Matrix2<f64>>,
}

/// A score: what `score --json` prints. A figure that does not exist is NaN.
#[derive(Debug, Clone, Serialize)]
pub struct Score {
    /// Version of this format.
    pub schema_version: u32,
    /// Method of the calibration.
    pub method: String,
    /// What it comes to.
    pub verdict: Verdict,
    /// What became of the elements.
    pub beams: BeamCounts,
    /// How many elements the calibration gives each status; "absent" for those it does not mention.
    pub statuses: BTreeMap<&'static str, usize>,
    /// Angle between estimated and true direction, in the sensor frame.
    pub direction_deg: Spread,
    /// Root mean square of (cos φ·δθ, δφ), in the sensor frame.
    pub per_axis_rms_deg: f64,
    /// Angle of the rotation that all scored elements share.
    pub common_mode_deg: f64,
    /// Per-axis error that is left once that rotation is taken out.
    pub differential_per_axis_rms_deg: f64,
    /// Angle between estimated and true direction in the room: with the rig as tracked and the mounting as
    /// calibrated, against rig and mounting as they were.
    pub direction_room_deg: Spread,
    /// Per-axis error in the room: length of the error over √2.
    pub per_axis_rms_room_deg: f64,
    /// Angle of the shared rotation in the room.
    pub common_mode_room_deg: f64,
    /// Error of d.
    pub distance_mm: DistanceError,
    /// Error of a point, in the sensor frame.
    pub point_mm: PointError,
    /// Error of a point in the room.
    pub point_room_mm: PointError,
    /// Mean normalised estimation error squared.
    #[doc(alias = "ANEES")]
    pub nees_mean: f64,
    /// Share of elements whose error is inside its own 95 % ellipse.
    pub coverage_95: f64,
    /// Per-axis bound: what the best unbiased estimator of the same kind could reach with these data.
    #[doc(alias = "CRLB")]
    pub crlb_per_axis_deg: f64,
    /// Bound over error, as mean squares; 1 is the best that can be expected, and one run scatters about it.
    pub efficiency: f64,
    /// Elements that are split in truth.
    pub split: ApartScore,
    /// Elements that are reflected more than once in truth.
    pub multi_bounce: ApartScore,
    /// Point-to-board residuals of the solved elements.
    pub boards_mm: SurfaceResidual,
    /// Point-to-wall residuals of the solved elements in the empty room, which no method fits angles to.
    pub walls_mm: SurfaceResidual,
    /// Why a figure is null, by its key.
    pub nulls: BTreeMap<&'static str, &'static str>,
    /// What a reader should know, in words; the reasons of a failure first.
    pub warnings: Vec<String>,
    /// Errors of every solved element that the truth deflects once, split ones too.
    #[serde(skip)]
    pub elements: Vec<ElementError>,
}

impl Score {
    /// Sets a limit for the per-axis error, in degrees: a score above it, or without one, fails.
    ///
    /// A blind score stays blind.
    #[must_use]
    pub fn with_limit(mut self, max_rms_deg: f64) -> Self {
        let error = self.per_axis_rms_deg;
        match self.verdict {
            Verdict::Blind => self.warnings.push(format!(
                "the limit of {max_rms_deg}° was not tested: there is no truth"
            )),
            Verdict::Pass | Verdict::Fail if error <= max_rms_deg => {}
            Verdict::Pass | Verdict::Fail => {
                self.verdict = Verdict::Fail;
                let found = if error.is_finite() {
                    format!("is {error:.4}°")
                } else {
                    "does not exist".to_owned()
                };
                self.warnings.insert(
                    0,
                    format!("fails: the per-axis error {found}, the limit is {max_rms_deg}°"),
                );
            }
        }
        self
    }

    /// The errors that the accuracy is counted from: solved, deflected and unsplit.
    pub fn scored(&self) -> impl Iterator<Item = &ElementError> {
        self.elements.iter().filter(|e| e.class == BeamClass::Deflected)
    }
}

/// Scores a calibration against the truth; without one, against boards and walls only.
pub fn score(dataset: &Dataset, calibration: &Calibration, truth: Option<&Truth>) -> Score {
    let boards_mm = residual::boards(dataset, calibration);
    let walls_mm = residual::walls(dataset, calibration);
    let elements = truth.map_or_else(Vec::new, |truth| compare(dataset, calibration, truth));
    let scored: Vec<&ElementError> = elements
        .iter()
        .filter(|e| e.class == BeamClass::Deflected)
        .collect();

    let in_sensor = Directions::of(&scored, &Pose::identity(), &Pose::identity());
    let in_room = truth
        .zip(calibration.rig_from_sensor.as_ref())
        .zip(tracked_rig(dataset))
        .map(|((truth, mount), room_from_rig)| {
            let believed = room_from_rig * mount.pose();
            let actual = Pose::from(&truth.room_from_rig) * Pose::from(&truth.rig_from_sensor);
            Directions::of(&scored, &believed, &actual)
        })
        .unwrap_or_else(|| Directions::of(&[], &Pose::identity(), &Pose::identity()));

    let squares = |e: &&ElementError| e.across.powi(2) + e.up.powi(2);
    let mahalanobis: Vec<f64> = scored.iter().filter_map(|e| e.mahalanobis_squared).collect();
    let distances: Vec<f64> = scored
        .iter()
        .filter(|e| e.has_distance)
        .map(|e| (e.estimate.distance - e.truth.distance) * 1e3)
        .collect();
    let bounded: Vec<&ElementError> = scored.iter().copied().filter(|e| e.bound.is_some()).collect();
    let bound_trace = mean(bounded.iter().filter_map(|e| e.bound).map(|b| b.trace()));

    let mut score = Score {
        schema_version: SCHEMA_VERSION,
        method: calibration.method.clone(),
        verdict: Verdict::Blind,
        beams: count(calibration, truth),
        statuses: statuses(dataset, calibration),
        direction_deg: in_sensor.spread_deg(),
        per_axis_rms_deg: (0.5 * mean(scored.iter().map(squares))).sqrt().to_degrees(),
        common_mode_deg: in_sensor.common_mode_deg,
        differential_per_axis_rms_deg: in_sensor.differential_deg,
        direction_room_deg: in_room.spread_deg(),
        per_axis_rms_room_deg: in_room.per_axis_deg,
        common_mode_room_deg: in_room.common_mode_deg,
        distance_mm: DistanceError {
            rms: rms(distances.iter().copied()),
            max: largest(distances.iter().map(|d| d.abs())),
        },
        point_mm: in_sensor.point_mm,
        point_room_mm: in_room.point_mm,
        nees_mean: mean(mahalanobis.iter().map(|m| 0.5 * m)),
        coverage_95: mean(
            mahalanobis
                .iter()
                .map(|&m| f64::from(u8::from(m <= CHI_SQUARED_95))),
        ),
        crlb_per_axis_deg: (0.5 * bound_trace).sqrt().to_degrees(),
        efficiency: bound_trace / mean(bounded.iter().map(squares)),
        split: apart(calibration, truth, &elements, BeamClass::Split),
        multi_bounce: apart(calibration, truth, &elements, BeamClass::MultiBounce),
        boards_mm,
        walls_mm,
        nulls: BTreeMap::new(),
        warnings: Vec::new(),
        elements: Vec::new(),
    };
    score.elements = elements;
    words::judge(&mut score, calibration, truth.is_some());
    score
}

/// The errors of every solved element that the truth deflects once.
fn compare(dataset: &Dataset, calibration: &Calibration, truth: &Truth) -> Vec<ElementError> {
    let bounds = bound::at_truth(dataset, truth);
    let mut elements = Vec::new();
    for true_beam in &truth.beams {
        let (Some(actual), Some(estimate)) = (true_beam.deflection(), calibration.beam(true_beam.beam))
        else {
            continue;
        };
        let Some(found) = solved(estimate) else {
            continue;
        };
        if !matches!(true_beam.status, BeamClass::Deflected | BeamClass::Split) {
            continue;
        }
        let error = Vector2::new(
            wrap(found.azimuth - actual.azimuth),
            found.elevation - actual.elevation,
        );
        let cos = actual.elevation.cos();
        let covariance = estimate
            .covariance_rad2
            .map(|c| Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]));
        let to_tangent = Matrix2::new(cos, 0.0, 0.0, 1.0);
        elements.push(ElementError {
            beam: true_beam.beam,
            facet: true_beam.facets.first().cloned().unwrap_or_default(),
            class: true_beam.status,
            truth: actual,
            estimate: found,
            has_distance: estimate.distance_m.is_some(),
            across: cos * error.x,
            up: error.y,
            sigma: covariance.map(|c| [cos * c[(0, 0)].sqrt(), c[(1, 1)].sqrt()]),
            mahalanobis_squared: covariance.map(|c| mahalanobis_squared(&error, &c)),
            bound: bounds.get(&true_beam.beam).map(|b| to_tangent * b * to_tangent),
        });
    }
    elements
}

/// An element's deflection if it is solved and its angles are numbers.
fn solved(estimate: &catoptric_model::BeamEstimate) -> Option<Deflection> {
    estimate
        .deflection()
        .filter(|d| d.azimuth.is_finite() && d.elevation.is_finite() && d.distance.is_finite())
}

/// Brings a difference of azimuths into (−π, π]; one that is there already stays as it is, to the last bit.
fn wrap(difference: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if -PI < difference && difference <= PI {
        return difference;
    }
    let turned = difference.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}

/// Where the rig stood, as tracked: the mean over the stretches, through which it did not move.
fn tracked_rig(dataset: &Dataset) -> Option<Pose> {
    let frame = |pose: &catoptric_model::PoseRecord| TrackedFrame {
        time_s: 0.0,
        pose: Some(pose.room_from_rig),
        markers: Vec::new(),
    };
    Track {
        subject: catoptric_model::dataset::RIG_SUBJECT.to_owned(),
        frames: dataset.poses.iter().map(frame).collect(),
    }
    .mean_pose()
}

/// Everything that follows from estimated and true rays in one frame.
struct Directions {
    errors: Vec<f64>,
    per_axis_deg: f64,
    common_mode_deg: f64,
    differential_deg: f64,
    point_mm: PointError,
}

impl Directions {
    fn of(scored: &[&ElementError], believed_from_sensor: &Pose, actual_from_sensor: &Pose) -> Self {
        let ray = |beam: usize, deflection: &Deflection, pose: &Pose| {
            let azimuth = beam::azimuth(beam);
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

    fn spread_deg(&self) -> Spread {
        Spread {
            rms: rms(self.errors.iter().copied()).to_degrees(),
            median: percentile(&self.errors, 0.5).to_degrees(),
            p95: percentile(&self.errors, 0.95).to_degrees(),
            max: largest(self.errors.iter().copied()).to_degrees(),
        }
    }
}

/// Per-axis error of pairs (true, found) in radians: the length of the error in the tangent plane over √2.
///
/// Agrees with (cos φ·δθ, δφ) for small errors, and unlike it has no trouble straight up.
fn per_axis(pairs: impl Iterator<Item = (Unit<Vector3<f64>>, Unit<Vector3<f64>>)>) -> f64 {
    rms(pairs.map(|(v, found)| beam::angle_between(&v, &found))) / std::f64::consts::SQRT_2
}

/// Largest of some numbers; NaN of nothing.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(f64::NAN, f64::max)
}

fn count(calibration: &Calibration, truth: Option<&Truth>) -> BeamCounts {
    let has_reason =
        |b: &catoptric_model::BeamEstimate| b.reason.as_ref().is_some_and(|r| !r.trim().is_empty());
    let abstains = |b: &catoptric_model::BeamEstimate| match b.status {
        Status::Solved | Status::Direct => false,
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => has_reason(b),
    };
    let Some(truth) = truth else {
        return BeamCounts {
            solved: calibration.beams.iter().filter_map(solved).count(),
            abstained: calibration.beams.iter().filter(|b| abstains(b)).count(),
            ..BeamCounts::default()
        };
    };
    let mut counts = BeamCounts::default();
    let (mut deflected, mut missed) = (0, 0);
    for true_beam in truth.beams.iter().filter(|b| b.status == BeamClass::Deflected) {
        deflected += 1;
        match calibration.beam(true_beam.beam) {
            Some(b) if solved(b).is_some() => counts.solved += 1,
            Some(b) if abstains(b) => counts.abstained += 1,
            _ => missed += 1,
        }
    }
    let class: BTreeMap<usize, BeamClass> = truth.beams.iter().map(|b| (b.beam, b.status)).collect();
    let wrong = calibration
        .beams
        .iter()
        .filter(|b| b.status == Status::Solved)
        .filter(|b| match class.get(&b.beam) {
            Some(BeamClass::Direct | BeamClass::Blocked | BeamClass::Lost) | None => true,
            Some(BeamClass::Deflected | BeamClass::Split | BeamClass::MultiBounce) => false,
        })
        .count();
    BeamCounts {
        deflected: Some(deflected),
        missed: Some(missed),
        wrong: Some(wrong),
        ..counts
    }
}

fn statuses(dataset: &Dataset, calibration: &Calibration) -> BTreeMap<&'static str, usize> {
    let mut counts: BTreeMap<_, _> = Status::ALL.iter().map(|s| (s.word(), 0)).collect();
    for b in &calibration.beams {
        *counts.entry(b.status.word()).or_default() += 1;
    }
    let absent = (0..dataset.session.scanner.beams).filter(|&i| calibration.beam(i).is_none());
    counts.insert("absent", absent.count());
    counts
}

fn apart(
    calibration: &Calibration,
    truth: Option<&Truth>,
    elements: &[ElementError],
    class: BeamClass,
) -> ApartScore {
    let there: Vec<usize> = truth
        .map(|t| {
            t.beams
                .iter()
                .filter(|b| b.status == class)
                .map(|b| b.beam)
                .collect()
        })
        .unwrap_or_default();
    let squares = elements
        .iter()
        .filter(|e| e.class == class)
        .map(|e| e.across.powi(2) + e.up.powi(2));
    ApartScore {
        elements: there.len(),
        solved: there
            .iter()
            .filter(|&&b| calibration.beam(b).and_then(solved).is_some())
            .count(),
        per_axis_rms_deg: (0.5 * mean(squares)).sqrt().to_degrees(),
    }
}

#[cfg(test)]
mod tests;
