//! The verdict of a score, with its reasons and warnings as text.

use super::honesty::{self, Honesty};
use super::nulls::nulls;
use super::{DISHONEST_NEES, Score, Verdict};
use catoptric_model::{Calibration, Dataset, Status};
use std::collections::BTreeMap;

/// Share of the squared error above which one rotation is reported to dominate it.
pub const DOMINANT_SHARE: f64 = 0.5;
/// Share of the elements above which abstentions are worth a warning.
const MANY: f64 = 0.1;
// Phrases of warnings whose subject a report covers in sentences of its own.
const COMMON: &str = "common mode dominates";
const UNSOLVED: &str = "elements were not solved";

/// Whether a warning is about accuracy, covariance or abstentions, which a report covers anyway.
pub fn is_covered_by_report(warning: &str) -> bool {
    [honesty::OVER, honesty::UNDER, COMMON, UNSOLVED]
        .iter()
        .any(|words| warning.contains(words))
}

/// Share of the squared error that one rotation common to all elements explains; NaN if it does not exist.
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

/// Whether there is a truth, but no element in it with a direction to estimate.
fn nothing_deflected(score: &Score) -> bool {
    score.beams.deflected == Some(0)
}

/// The respects in which a calibration states that it belongs to another scanner or dataset.
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
            "fails: {} deflected by a mirror, with neither a direction nor a reason",
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
    // Infinity is above the limit too; NaN, without a covariance, is not.
    if score.nees_mean > DISHONEST_NEES {
        failures.push(format!(
            "fails: {}; {DISHONEST_NEES} is the limit for a mean normalized squared error",
            honesty::over_confident(score)
        ));
    }
    // If all of them share one error, they are all wrong under an honest covariance once in a thousand runs.
    if let Some(open) = score.open.filter(|o| o.wrong > 0 && 2 * o.wrong > o.solved) {
        failures.push(format!(
            "fails: {} left open by the boards and given a direction with a covariance that rules out the truth; abstaining would be correct",
            elements(open.wrong, "is", "are")
        ));
    }
    failures
}

fn warnings(score: &Score, calibration: &Calibration, has_truth: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    if calibration.frame != "sensor" {
        warnings.push(format!(
            "the file states its angles in the frame {:?}; they are scored as if in \"sensor\"",
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
            "their own boards leave {} of {} elements open: of these {} abstained, which is correct, and {} solved, {} of them wrong according to their stated covariance",
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
            "{} of {scored} scored elements have no covariance",
            scored - stated
        ));
    }
    let share = common_share(score);
    if share > DOMINANT_SHARE && score.per_axis_rms_deg > honesty::NEGLIGIBLE_DEG {
        warnings.push(format!(
            "{COMMON}: one rotation of {:.4}° common to all elements accounts for {:.0} % of the squared error, like an error of the sensor's mounting",
            score.common_mode_deg,
            share * 100.0
        ));
    }
    let without_distance = score.scored().filter(|e| !e.has_distance).count();
    if without_distance > 0 {
        warnings.push(format!(
            "{} no d; point errors assume d = 0 for them",
            elements(without_distance, "has", "have")
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
            "{} of {candidates} {UNSOLVED}; over all elements, the most frequent reasons are: {}",
            score.beams.abstained,
            reasons.join(", ")
        ));
    }
    if calibration.rig_from_sensor.is_none() {
        warnings.push(
            "the calibration has no mounting of the sensor in the rig; residuals use the one of the drawing"
                .to_owned(),
        );
    }
    warnings
}

/// Elements without a direction that share a reason.
pub struct Abstention {
    /// Their status, with spaces.
    pub status: String,
    /// The reason of the first of them.
    pub reason: String,
    /// Number of elements.
    pub count: usize,
}

/// Returns the reasons of the elements that are neither solved nor direct, most frequent first.
///
/// Reasons that differ only in their numbers count as one, represented by the first of them.
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

/// Returns the word of a status with spaces instead of underscores.
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
