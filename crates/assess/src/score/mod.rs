//! Scoring of a calibration against the truth or, without it, against surveyed boards and walls.
//!
//! Accuracy is computed over the *scored* elements: solved, and deflected and unsplit in truth. With φ, θ the true angles
//! of an element, δφ, δθ the errors of its estimate, e = (δθ, δφ), P its stated covariance and C the bound on the
//! covariance of any estimate from the dataset, at the true angles:
//!
//! ```text
//! per-axis error    √(mean((cos φ·δθ)² + δφ²) / 2)
//! direction error   atan2(‖v̂×v‖, v̂·v)
//! common mode       angle of the rotation R that minimizes Σ‖v̂ − R·v‖²
//! point error       √mean ‖(d̂ − d)·u + s·(v̂ − v)‖²           at s = 1, 4 and 10 m behind the mirror
//! NEES              mean(eᵀP⁻¹e) / 2                           1 where the covariance is honest
//! coverage          share of elements with eᵀP⁻¹e ≤ 5.991      0.95 where the covariance is honest
//! efficiency        mean(C_θθ·cos²φ + C_φφ) / mean((cos φ·δθ)² + δφ²)
//! ```
//!
//! Every element that is deflected and unsplit in truth is either solved, abstained or missed. Those that their own
//! boards leave open are also counted separately: for them abstaining is correct, and a direction is wrong if the truth
//! is outside its stated 99.9 % ellipse (a method may know more than the boards, from a facet or the drawing). Figures
//! that do not exist are NaN here and `null` in JSON, with the reason in `nulls`.

mod allowed;
mod blind;
mod bound;
pub mod counts;
mod directions;
mod distance;
mod element;
mod figures;
pub mod gate;
mod honesty;
mod judge;
mod limits;
mod mistake;
mod mistakes;
mod mounting;
mod nulls;
mod range_bias;
pub mod residual;
mod statistics;
mod verdict;
pub mod words;

use crate::validate::{Severity, validate_for};
use catoptric_model::frame::Pose;
use catoptric_model::{Calibration, Dataset, PoseRecord, Track, TrackedFrame, Unreadable, beam};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use counts::{apart, count, open, statuses};
use directions::Directions;
use element::compare;
use statistics::{largest, mean, rms};
use std::collections::BTreeMap;

pub(crate) use element::wrap;
#[cfg(feature = "testing")]
pub(crate) use statistics::mahalanobis_squared;

pub use bound::{Knowable, knowable};
pub use bound::{bounds, true_directions};
pub use directions::POINT_RANGES_M;
pub use element::{ElementError, USEFUL_SD};
pub use figures::{ApartScore, BeamCounts, DistanceError, OpenCounts, PointError, Score, Spread};
pub use gate::{Gate, MIN_SOLVED, Outcome};
pub use mistake::Mistake;
pub use mounting::Mounting;
pub use residual::SurfaceResidual;
pub use statistics::percentile;
pub use statistics::{CHI_SQUARED_95, CHI_SQUARED_999};
pub use verdict::{Honesty, Verdict};

/// Version of what `score --json` prints.
pub const SCHEMA_VERSION: u32 = 1;

/// Scores a calibration against the truth, `&truth`; without one, `None`, against boards and walls only.
///
/// It is validated first. The verdict follows from [`Score::gates`]; [`Score::with_min_solved`], [`Score::with_limit`] and
/// [`Score::with_requirement`] change them.
///
/// # Errors
/// [`Unreadable`] if the recording of the dataset can no longer be read.
pub fn score<'t>(
    dataset: &Dataset,
    calibration: &Calibration,
    truth: impl Into<Option<&'t Truth>>,
) -> Result<Score, Unreadable> {
    let truth = truth.into();
    let knowable = truth.map(|truth| knowable(dataset, truth)).transpose()?;
    score_by(dataset, calibration, truth.zip(knowable.as_ref()))
}

/// Scores a calibration against the truth and its [`Knowable`], which several calibrations of a dataset can share.
///
/// # Errors
/// [`Unreadable`] if the recording of the dataset can no longer be read.
pub fn score_by(
    dataset: &Dataset,
    calibration: &Calibration,
    reference: Option<(&Truth, &Knowable)>,
) -> Result<Score, Unreadable> {
    let problems = validate_for(calibration, &dataset.session);
    let invalid = problems.iter().any(|p| p.severity == Severity::Error);
    // An entry that is not valid has no figures.
    let nothing = Calibration {
        beams: Vec::new(),
        bias: None,
        ..calibration.clone()
    };
    let given = calibration;
    let calibration = if invalid { &nothing } else { calibration };
    let truth = reference.map(|(truth, _)| truth);
    let knowable = reference.map(|(_, knowable)| knowable);
    let blind = truth.is_none();
    let boards = residual::judged_boards(dataset, calibration, blind)?;
    let walls = residual::judged_walls(dataset, calibration, blind)?;
    let elements = reference.map_or_else(Vec::new, |(truth, knowable)| {
        compare(&dataset.session, calibration, truth, knowable)
    });
    let scored: Vec<&ElementError> = elements
        .iter()
        .filter(|e| e.class == BeamClass::Deflected)
        .collect();

    let scan = &dataset.session.scanner.scan;
    let rig = tracked_rig(dataset);
    let in_sensor = Directions::of(scan, &scored, &Pose::identity(), &Pose::identity());
    let placed = truth
        .zip(calibration.rig_from_sensor.as_ref())
        .zip(rig)
        .filter(|_| !invalid)
        .map(|((truth, mount), room_from_rig)| {
            let believed = room_from_rig * mount.pose();
            let actual = Pose::from(&truth.room_from_rig) * Pose::from(&truth.rig_from_sensor);
            (mount, believed, actual)
        });
    let in_room = match &placed {
        Some((_, believed, actual)) => Directions::of(scan, &scored, believed, actual),
        None => Directions::of(scan, &[], &Pose::identity(), &Pose::identity()),
    };
    let tolerance = &dataset.session.mount_tolerance;
    let mounting = placed
        .as_ref()
        .map(|(mount, believed, actual)| Mounting::of(mount, tolerance, actual, believed));

    let squares = |e: &&ElementError| e.across.powi(2) + e.up.powi(2);
    let mahalanobis: Vec<f64> = scored.iter().filter_map(|e| e.mahalanobis_squared).collect();
    let with_distance = || scored.iter().filter(|e| e.has_distance);
    let off = |e: &ElementError| e.estimate.distance - e.truth.distance;
    let bounded: Vec<&ElementError> = scored
        .iter()
        .copied()
        .filter(|e| e.bound.as_ref().is_some_and(bounds))
        .collect();
    let bound_trace = mean(bounded.iter().filter_map(|e| e.bound).map(|b| b.trace()));
    let alone: Vec<f64> = scored
        .iter()
        .filter_map(|e| e.alone_bound.filter(bounds))
        .map(|b| b.trace())
        .collect();

    let mut score = Score {
        schema_version: SCHEMA_VERSION,
        method: calibration.method.clone(),
        verdict: Verdict::Blind,
        gates: Vec::new(),
        mistakes: Vec::new(),
        honesty: None,
        beams: count(calibration, truth),
        open: knowable.map(|k| open(calibration, &elements, &k.open)),
        knowable: knowable.map(|k| k.well.len()),
        knowable_solved: knowable.map(|k| {
            let useful = |e: &&ElementError| e.stated_sd.is_none_or(|sd| sd <= USEFUL_SD);
            let well = elements.iter().filter(|e| k.well.contains(&e.beam));
            well.filter(useful).count()
        }),
        stated: mahalanobis.len() as f64 / scored.len() as f64,
        statuses: statuses(dataset, calibration),
        direction_deg: in_sensor.spread_deg(),
        per_axis_rms_deg: (0.5 * mean(scored.iter().map(squares))).sqrt().to_degrees(),
        common_mode_deg: in_sensor.common_mode_deg,
        differential_per_axis_rms_deg: in_sensor.differential_deg,
        direction_room_deg: in_room.spread_deg(),
        per_axis_rms_room_deg: in_room.per_axis_deg,
        common_mode_room_deg: in_room.common_mode_deg,
        distance_mm: DistanceError {
            rms: rms(with_distance().map(|e| 1e3 * off(e))),
            max: largest(with_distance().map(|e| 1e3 * off(e).abs())),
        },
        distance_nees: mean(with_distance().map(|e| (off(e) / e.distance_sd).powi(2))),
        range_bias_mm: range_bias::worst(&dataset.session, calibration, truth)
            .map_or(f64::NAN, |worst| worst.error_mm),
        mounting,
        point_mm: in_sensor.point_mm,
        point_room_mm: in_room.point_mm,
        nees_mean: mean(mahalanobis.iter().map(|m| 0.5 * m)),
        coverage_95: mean(
            mahalanobis
                .iter()
                .map(|&m| f64::from(u8::from(m <= CHI_SQUARED_95))),
        ),
        crlb_per_axis_deg: (0.5 * bound_trace).sqrt().to_degrees(),
        crlb_elements: bounded.len(),
        alone_crlb_per_axis_deg: (0.5 * mean(alone.iter().copied())).sqrt().to_degrees(),
        alone_crlb_elements: alone.len(),
        efficiency: bound_trace / mean(bounded.iter().map(squares)),
        split: apart(calibration, truth, &elements, BeamClass::Split),
        multi_bounce: apart(calibration, truth, &elements, BeamClass::MultiBounce),
        boards_mm: boards.residual,
        walls_mm: walls.residual,
        boards_normalized: boards.normalized,
        walls_normalized: walls.normalized,
        nulls: BTreeMap::new(),
        warnings: Vec::new(),
        elements: Vec::new(),
        remarks: Vec::new(),
        has_truth: truth.is_some(),
        blind_stated: calibration
            .beams
            .iter()
            .filter(|b| element::usefully_solved(b) && b.covariance_rad2.is_some())
            .count(),
        useless: calibration
            .beams
            .iter()
            .filter(|b| element::solved(b).is_some() && !element::usefully_solved(b))
            .count(),
        boards_by_mirror: boards.by_mirror,
        walls_by_mirror: walls.by_mirror,
    };
    score.elements = elements;
    if invalid {
        score.gates = vec![judge::valid(&problems)];
        score.nulls = nulls::nulls(&score, calibration, truth);
        if let Some((truth, knowable)) = reference {
            score.mistakes = mistakes_of_invalid(&score, dataset, given, truth, knowable);
            score.remarks = score.mistakes.iter().map(ToString::to_string).collect();
        }
        return Ok(score.settled());
    }
    Ok(words::judge(score, dataset, calibration, truth, rig.as_ref()))
}

/// The mistakes that would explain what makes a calibration invalid, such as angles or distances in another unit.
fn mistakes_of_invalid(
    score: &Score,
    dataset: &Dataset,
    calibration: &Calibration,
    truth: &Truth,
    knowable: &Knowable,
) -> Vec<Mistake> {
    let mut with_errors = score.clone();
    with_errors.elements = compare(&dataset.session, calibration, truth, knowable);
    let off: Vec<[f64; 2]> = with_errors
        .scored()
        .map(|e| {
            let base = dataset.session.scanner.scan.azimuth(e.beam);
            let angle = beam::angle_between(&e.estimate.exit_direction(base), &e.truth.exit_direction(base));
            [angle, e.estimate.distance - e.truth.distance]
        })
        .collect();
    with_errors.per_axis_rms_deg = (rms(off.iter().map(|o| o[0])) / std::f64::consts::SQRT_2).to_degrees();
    with_errors.distance_mm.rms = rms(off.iter().map(|o| 1e3 * o[1]));
    mistakes::recognize(&with_errors, dataset, calibration, truth, None)
}

/// Returns the tracked pose of the rig: the mean over the stretches, during which it did not move.
fn tracked_rig(dataset: &Dataset) -> Option<Pose> {
    // In a flight the rig is elsewhere.
    let at_rest = dataset.poses.iter().filter(|pose| pose.motion.is_none());
    let frame = |pose: &PoseRecord| TrackedFrame {
        time_s: 0.0,
        pose: Some(pose.room_from_rig),
        markers: Vec::new(),
    };
    Track {
        subject: catoptric_model::dataset::RIG_SUBJECT.to_owned(),
        frames: at_rest.map(frame).collect(),
    }
    .mean_pose()
}

#[cfg(test)]
mod tests;
