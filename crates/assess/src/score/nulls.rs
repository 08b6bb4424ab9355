//! Reasons why figures of a score are null.

use super::Score;
use super::gate::ENOUGH;
use super::range_bias;
use catoptric_model::Calibration;
use catoptric_sim::Truth;
use std::collections::BTreeMap;

/// Returns the keys of the figures that are not finite, with the reasons.
pub(super) fn nulls(
    score: &Score,
    calibration: &Calibration,
    truth: Option<&Truth>,
) -> BTreeMap<&'static str, &'static str> {
    let has_truth = truth.is_some();
    let no_mount = "the calibration has no rig_from_sensor";
    let too_few = "no rotation is determined by these directions";
    let none_scored = "no solved element is deflected and unsplit in truth";
    let scored = score.scored().next().is_some();
    let because = |reason: &'static str| match (has_truth, scored) {
        (false, _) => "there is no truth",
        (true, false) => none_scored,
        (true, true) => reason,
    };
    let room = if calibration.rig_from_sensor.is_none() {
        no_mount
    } else {
        "the rig was never tracked"
    };
    let covariance = if score.scored().all(|e| e.mahalanobis_squared.is_none()) {
        "no scored element has a covariance"
    } else {
        "infinite: a covariance that is not positive definite rules out the error that was made"
    };
    let efficiency = if score.crlb_per_axis_deg.is_finite() {
        "infinite: the error is exactly zero"
    } else {
        "there is no bound"
    };
    let no_bound = "no bound exists: the believed errors are zero, or the boards do not determine the angles";
    let figures = [
        ("direction_deg", score.direction_deg.rms, because(none_scored)),
        ("per_axis_rms_deg", score.per_axis_rms_deg, because(none_scored)),
        ("common_mode_deg", score.common_mode_deg, because(too_few)),
        (
            "differential_per_axis_rms_deg",
            score.differential_per_axis_rms_deg,
            because(too_few),
        ),
        ("direction_room_deg", score.direction_room_deg.rms, because(room)),
        (
            "per_axis_rms_room_deg",
            score.per_axis_rms_room_deg,
            because(room),
        ),
        (
            "common_mode_room_deg",
            score.common_mode_room_deg,
            because(if score.per_axis_rms_room_deg.is_nan() {
                room
            } else {
                too_few
            }),
        ),
        (
            "distance_mm",
            score.distance_mm.rms,
            because("no scored element has a distance_m"),
        ),
        (
            "distance_nees",
            score.distance_nees,
            because("no scored element has a distance_m"),
        ),
        (
            "range_bias_mm",
            score.range_bias_mm,
            range_bias::incomparable(calibration, truth).unwrap_or("no board has a color"),
        ),
        ("stated", score.stated, because(none_scored)),
        ("point_mm", score.point_mm.at_1m, because(none_scored)),
        ("point_room_mm", score.point_room_mm.at_1m, because(room)),
        ("nees_mean", score.nees_mean, because(covariance)),
        ("coverage_95", score.coverage_95, because(covariance)),
        ("crlb_per_axis_deg", score.crlb_per_axis_deg, because(no_bound)),
        (
            "alone_crlb_per_axis_deg",
            score.alone_crlb_per_axis_deg,
            because(no_bound),
        ),
        ("efficiency", score.efficiency, because(efficiency)),
        (
            "split.per_axis_rms_deg",
            score.split.per_axis_rms_deg,
            "no split element is scored",
        ),
        (
            "multi_bounce.per_axis_rms_deg",
            score.multi_bounce.per_axis_rms_deg,
            "one deflection does not describe them",
        ),
        (
            "boards_mm",
            score.boards_mm.rms,
            "no solved element reads a board",
        ),
        (
            "walls_mm",
            score.walls_mm.rms,
            "no solved element reads a wall of the empty room",
        ),
    ];
    let mut nulls: BTreeMap<_, _> = figures
        .into_iter()
        .filter(|(_, value, _)| !value.is_finite())
        .map(|(key, _, reason)| (key, reason))
        .collect();
    if score.open.is_none() {
        for key in ["open", "knowable", "knowable_solved"] {
            nulls.insert(key, "there is no truth");
        }
    }
    if score.mounting.is_none() {
        nulls.insert("mounting", if has_truth { room } else { "there is no truth" });
    }
    for (key, value, reads) in [
        (
            "boards_normalized",
            score.boards_normalized,
            score.boards_mm.readings,
        ),
        (
            "walls_normalized",
            score.walls_normalized,
            score.walls_mm.readings,
        ),
    ] {
        if !value.is_finite() {
            let reason = match (has_truth, reads) {
                (true, _) => "there is a truth to judge by",
                (false, 0) => "no solved element reads one",
                (false, _) => "no surface has a variance",
            };
            nulls.insert(key, reason);
        }
    }
    if score.honesty.is_none() {
        let reason = if score.nees_mean.is_nan() {
            "no scored element has a covariance"
        } else if score.stated < ENOUGH {
            "too few scored elements have a covariance"
        } else {
            "the errors are only numerical"
        };
        nulls.insert("honesty", because(reason));
    }
    nulls
}
