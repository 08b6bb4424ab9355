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

mod bound;
pub mod counts;
mod directions;
mod element;
mod figures;
mod honesty;
mod nulls;
pub mod residual;
mod statistics;
pub mod words;

use catoptric_model::frame::Pose;
use catoptric_model::{Calibration, Dataset, PoseRecord, Track, TrackedFrame, Unreadable};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use counts::{apart, count, open, statuses};
use directions::Directions;
use element::compare;
use statistics::{largest, mean, rms};
use std::collections::BTreeMap;

#[cfg(feature = "testing")]
pub(crate) use element::wrap;
#[cfg(feature = "testing")]
pub(crate) use statistics::mahalanobis_squared;

pub use bound::true_directions;
pub use bound::{Knowable, knowable};
pub use element::ElementError;
pub use figures::{ApartScore, BeamCounts, DistanceError, OpenCounts, PointError, Score, Spread, Verdict};
pub use honesty::Honesty;
pub use residual::SurfaceResidual;
pub use statistics::percentile;

/// Version of what `score --json` prints.
pub const SCHEMA_VERSION: u32 = 1;

/// 95 % quantile of χ² with two degrees of freedom: −2·ln 0.05.
pub const CHI_SQUARED_95: f64 = 5.991_464_547_107_979;

/// 99.9 % quantile of the same: −2·ln 0.001.
pub const CHI_SQUARED_999: f64 = 13.815_510_557_964_274;

/// Mean NEES above which a covariance is dishonest beyond statistical fluctuation.
///
/// Elements share errors, so the mean over one run scatters more than over independent draws: at worst all elements
/// have the same error, and the mean is χ² with two degrees of freedom divided by two, which exceeds 6 with probability
/// e⁻⁶ = 0.25 %.
pub const DISHONEST_NEES: f64 = 6.0;

/// Distances behind the mirror at which point errors are computed, in meters.
pub const POINT_RANGES_M: [f64; 3] = [1.0, 4.0, 10.0];

/// Scores a calibration against the truth, `&truth`; without one, `None`, against boards and walls only.
///
/// A calibration that says that it was made from another dataset, or of another scanner, fails.
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
    let truth = reference.map(|(truth, _)| truth);
    let knowable = reference.map(|(_, knowable)| knowable);
    let boards_mm = residual::boards(dataset, calibration)?;
    let walls_mm = residual::walls(dataset, calibration)?;
    let elements = reference.map_or_else(Vec::new, |(truth, knowable)| {
        compare(calibration, truth, knowable)
    });
    let scored: Vec<&ElementError> = elements
        .iter()
        .filter(|e| e.class == BeamClass::Deflected)
        .collect();

    let scan = &dataset.session.scanner.scan;
    let in_sensor = Directions::of(scan, &scored, &Pose::identity(), &Pose::identity());
    let in_room = truth
        .zip(calibration.rig_from_sensor.as_ref())
        .zip(tracked_rig(dataset))
        .map(|((truth, mount), room_from_rig)| {
            let believed = room_from_rig * mount.pose();
            let actual = Pose::from(&truth.room_from_rig) * Pose::from(&truth.rig_from_sensor);
            Directions::of(scan, &scored, &believed, &actual)
        })
        .unwrap_or_else(|| Directions::of(scan, &[], &Pose::identity(), &Pose::identity()));

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
        honesty: None,
        beams: count(calibration, truth),
        open: knowable.map(|k| open(calibration, &elements, &k.open)),
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
        alone_crlb_per_axis_deg: (0.5 * mean(scored.iter().filter_map(|e| e.alone_bound).map(|b| b.trace())))
            .sqrt()
            .to_degrees(),
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
    words::judge(&mut score, dataset, calibration, truth.is_some());
    Ok(score)
}

/// Returns the tracked pose of the rig: the mean over the stretches, during which it did not move.
fn tracked_rig(dataset: &Dataset) -> Option<Pose> {
    let frame = |pose: &PoseRecord| TrackedFrame {
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

#[cfg(test)]
mod tests;
