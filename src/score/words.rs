//! What a score comes to, and why, in words.

use super::nulls::nulls;
use super::{DISHONEST_NEES, Score, Verdict};
use catoptric_model::{Calibration, Status};
use std::collections::BTreeMap;

/// Mean NEES, and coverage below which, a covariance is called too small without failing the score.
pub(crate) const OVER_CONFIDENT: (f64, f64) = (2.0, 0.85);
/// Mean NEES below which a covariance is called too large: if all elements share one error, an honest one is there in
/// one run of ten.
pub(crate) const UNDER_CONFIDENT_NEES: f64 = 0.1;
/// Share of the squared error beyond which one rotation is said to dominate it.
pub(crate) const DOMINANT_SHARE: f64 = 0.5;
/// Share of the elements beyond which abstentions are worth a word.
const MANY: f64 = 0.1;
/// Below this an error is numerical, and nothing is at fault for it, in degrees.
const NEGLIGIBLE_DEG: f64 = 1e-6;

/// What warnings say whose matter a report tells in sentences of its own.
const OVER: &str = "over-confident";
const UNDER: &str = "under-confident";
const COMMON: &str = "common mode dominates";
const UNSOLVED: &str = "elements were not solved";

/// Whether a warning is about accuracy, covariance or abstentions, of which a report speaks anyway.
pub(crate) fn is_told(warning: &str) -> bool {
    [OVER, UNDER, COMMON, UNSOLVED]
        .iter()
        .any(|words| warning.contains(words))
}

/// Share of the squared error that one rotation common to all elements explains; NaN where it does not exist.
pub(crate) fn common_share(score: &Score) -> f64 {
    1.0 - (score.differential_per_axis_rms_deg / score.per_axis_rms_deg).powi(2)
}

/// Sets the verdict, and writes down its reasons, the warnings, and why figures are missing.
pub(super) fn judge(score: &mut Score, calibration: &Calibration, has_truth: bool) {
    let failures = failures(score);
    score.verdict = match (has_truth, failures.is_empty()) {
        (false, _) => Verdict::Blind,
        (true, true) => Verdict::Pass,
        (true, false) => Verdict::Fail,
    };
    score.warnings = failures;
    score.warnings.extend(warnings(score, calibration, has_truth));
    score.nulls = nulls(score, calibration, has_truth);
}

fn failures(score: &Score) -> Vec<String> {
    let mut failures = Vec::new();
    if let Some(missed @ 1..) = score.beams.missed {
        failures.push(format!(
            "fails: {} deflected by a mirror but given neither a direction nor a reason",
            elements(missed, "is", "are")
        ));
    }
    if let Some(wrong @ 1..) = score.beams.wrong {
        failures.push(format!(
            "fails: {} called solved although no mirror sends {} anywhere",
            elements(wrong, "is", "are"),
            if wrong == 1 { "it" } else { "them" }
        ));
    }
    // Infinity is above the limit too; NaN, which is no covariance, is not.
    if score.nees_mean > DISHONEST_NEES {
        failures.push(format!(
            "fails: the stated covariance is dishonest, the mean normalised squared error is {} where 1 is honest and {DISHONEST_NEES} the limit",
            number(score.nees_mean)
        ));
    }
    failures
}

fn warnings(score: &Score, calibration: &Calibration, has_truth: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    if calibration.frame != "sensor" {
        warnings.push(format!(
            "the file says its angles are in the frame {:?}; they are scored as in \"sensor\"",
            calibration.frame
        ));
    }
    if !has_truth {
        warnings.push(
            "there is no truth: residuals on boards and walls are the only figures, and the boards may be the ones the calibration was fitted to"
                .to_owned(),
        );
    }
    let (nees, coverage) = (score.nees_mean, score.coverage_95);
    if nees > OVER_CONFIDENT.0 || coverage < OVER_CONFIDENT.1 {
        warnings.push(format!(
            "{OVER}: {:.0} % of the errors are inside their 95 % ellipses and the mean normalised squared error is {}",
            coverage * 100.0,
            number(nees)
        ));
    }
    if nees < UNDER_CONFIDENT_NEES && score.per_axis_rms_deg > NEGLIGIBLE_DEG {
        warnings.push(format!(
            "{UNDER}: the mean normalised squared error is {} where 1 is honest",
            number(nees)
        ));
    }
    let stated = score.scored().filter(|e| e.mahalanobis_squared.is_some()).count();
    let scored = score.scored().count();
    if stated < scored {
        warnings.push(format!(
            "{} of {scored} scored elements come without a covariance",
            scored - stated
        ));
    }
    let share = common_share(score);
    if share > DOMINANT_SHARE && score.per_axis_rms_deg > NEGLIGIBLE_DEG {
        warnings.push(format!(
            "{COMMON}: one rotation of {:.4}° shared by all elements makes {:.0} % of the squared error, as an error of the sensor's mounting does",
            score.common_mode_deg,
            share * 100.0
        ));
    }
    let without_distance = score.scored().filter(|e| !e.has_distance).count();
    if without_distance > 0 {
        warnings.push(format!(
            "{} without d; point errors take d as 0 there",
            elements(without_distance, "comes", "come")
        ));
    }
    let candidates = score
        .beams
        .deflected
        .unwrap_or(score.beams.solved + score.beams.abstained);
    if score.beams.abstained as f64 > MANY * candidates as f64 {
        let reasons: Vec<String> = abstentions(calibration)
            .into_iter()
            .take(3)
            .map(|a| format!("{} {} ({})", a.count, a.status, a.reason))
            .collect();
        warnings.push(format!(
            "{} of {candidates} {UNSOLVED}; over all elements the usual reasons are: {}",
            score.beams.abstained,
            reasons.join(", ")
        ));
    }
    if calibration.rig_from_sensor.is_none() {
        warnings.push(
            "the calibration says nothing about where the sensor sits in the rig; residuals take the drawing for it"
                .to_owned(),
        );
    }
    warnings
}

/// Elements without a direction that share a reason.
pub(crate) struct Abstention {
    /// Their status, as a reader would write it.
    pub(crate) status: String,
    /// The reason of the first of them.
    pub(crate) reason: String,
    /// How many they are.
    pub(crate) count: usize,
}

/// Reasons of the elements that are neither solved nor direct, the most frequent first.
///
/// Reasons that differ in their numbers only count as one, and the first of them stands for all.
pub(crate) fn abstentions(calibration: &Calibration) -> Vec<Abstention> {
    let mut groups: BTreeMap<(&'static str, String), Abstention> = BTreeMap::new();
    for b in &calibration.beams {
        if !matches!(b.status, Status::Solved | Status::Direct) {
            let reason = b.reason.as_deref().unwrap_or("no reason given");
            let group = groups.entry((b.status.word(), without_numbers(reason)));
            let first = || Abstention {
                status: spelled(b.status),
                reason: reason.to_owned(),
                count: 0,
            };
            group.or_insert_with(first).count += 1;
        }
    }
    let mut sorted: Vec<_> = groups.into_values().collect();
    sorted.sort_by_key(|a| std::cmp::Reverse(a.count));
    sorted
}

/// A status as a reader would write it.
pub(crate) fn spelled(status: Status) -> String {
    status.word().replace('_', " ")
}

fn without_numbers(text: &str) -> String {
    let words = text.split(' ').map(|word| {
        let bare = word.trim_matches(|c: char| !c.is_ascii_digit());
        if bare.parse::<f64>().is_ok() {
            word.replace(bare, "…")
        } else {
            word.to_owned()
        }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// "1 element is", "2 elements are".
pub(crate) fn elements(count: usize, one: &str, many: &str) -> String {
    if count == 1 {
        format!("1 element {one}")
    } else {
        format!("{count} elements {many}")
    }
}

fn number(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.2}")
    } else {
        "infinite".to_owned()
    }
}
