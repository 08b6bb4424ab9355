//! What a score comes to, and why, in words.

use super::honesty::{self, Honesty};
use super::nulls::nulls;
use super::{DISHONEST_NEES, Score, Verdict};
use catoptric_model::{Calibration, Dataset, Status};
use std::collections::BTreeMap;

/// Share of the squared error beyond which one rotation is said to dominate it.
pub const DOMINANT_SHARE: f64 = 0.5;
/// Share of the elements beyond which abstentions are worth a word.
const MANY: f64 = 0.1;
/// What warnings say whose matter a report tells in sentences of its own.
const COMMON: &str = "common mode dominates";
const UNSOLVED: &str = "elements were not solved";

/// Whether a warning is about accuracy, covariance or abstentions, of which a report speaks anyway.
pub fn is_told(warning: &str) -> bool {
    [honesty::OVER, honesty::UNDER, COMMON, UNSOLVED]
        .iter()
        .any(|words| warning.contains(words))
}

/// Share of the squared error that one rotation common to all elements explains; NaN where it does not exist.
pub fn common_share(score: &Score) -> f64 {
    1.0 - (score.differential_per_axis_rms_deg / score.per_axis_rms_deg).powi(2)
}

/// Sets the verdict, and writes down its reasons, the warnings, and why figures are missing.
pub(super) fn judge(score: &mut Score, dataset: &Dataset, calibration: &Calibration, has_truth: bool) {
    score.honesty = honesty::of(score);
    let mut failures = foreign(dataset, calibration);
    failures.extend(self::failures(score));
    score.verdict = match (has_truth && !nothing_deflected(score), failures.is_empty()) {
        (_, false) => Verdict::Fail,
        (true, true) => Verdict::Pass,
        (false, true) => Verdict::Blind,
    };
    score.warnings = failures;
    score.warnings.extend(warnings(score, calibration, has_truth));
    score.nulls = nulls(score, calibration, has_truth);
}

/// Whether there is a truth, and no element in it whose direction could be asked for.
fn nothing_deflected(score: &Score) -> bool {
    score.beams.deflected == Some(0)
}

/// Whether a calibration says that it is of something else than a dataset.
pub(crate) fn foreign(dataset: &Dataset, calibration: &Calibration) -> Vec<String> {
    let scanner = calibration.check_scanner(&dataset.session).err();
    let other = calibration.other_dataset(dataset).map(|[its, this]| {
        format!("fails: the calibration was made from another dataset (SHA-256 {its}); this one is {this}")
    });
    scanner
        .map(|error| format!("fails: {error}"))
        .into_iter()
        .chain(other)
        .collect()
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
            "fails: {}; {DISHONEST_NEES} is the limit for a mean normalised squared error",
            honesty::over_confident(score)
        ));
    }
    // If all of them share one error, an honest covariance has all of them wrong once in a thousand runs.
    if let Some(open) = score.open.filter(|o| o.wrong > 0 && 2 * o.wrong > o.solved) {
        failures.push(format!(
            "fails: {} left open by the boards and given a direction with a covariance that rules out the truth; abstaining is right there",
            elements(open.wrong, "is", "are")
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
    if nothing_deflected(score) {
        warnings
            .push("no element is deflected by a mirror and unsplit: there is nothing to judge".to_owned());
    }
    match score.honesty {
        Some(Honesty::OverConfident) if score.nees_mean <= DISHONEST_NEES => {
            warnings.push(honesty::over_confident(score));
        }
        Some(Honesty::UnderConfident) => warnings.push(honesty::under_confident(score)),
        Some(Honesty::OverConfident | Honesty::Honest) | None => {}
    }
    if let Some(open) = score.open.filter(|o| o.elements > 0) {
        warnings.push(format!(
            "their own boards leave {} of {} elements open: {} abstained there, which is right, {} solved, {} of these wrong by what they state",
            open.elements,
            score.beams.deflected.unwrap_or_default(),
            open.abstained,
            open.solved,
            open.wrong
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
    if share > DOMINANT_SHARE && score.per_axis_rms_deg > honesty::NEGLIGIBLE_DEG {
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
pub struct Abstention {
    /// Their status, as a reader would write it.
    pub status: String,
    /// The reason of the first of them.
    pub reason: String,
    /// How many they are.
    pub count: usize,
}

/// Reasons of the elements that are neither solved nor direct, the most frequent first.
///
/// Reasons that differ in their numbers only count as one, and the first of them stands for all.
pub fn abstentions(calibration: &Calibration) -> Vec<Abstention> {
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
pub fn spelled(status: Status) -> String {
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
pub fn elements(count: usize, one: &str, many: &str) -> String {
    if count == 1 {
        format!("1 element {one}")
    } else {
        format!("{count} elements {many}")
    }
}
