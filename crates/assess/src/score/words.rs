//! The verdict of a score, with its reasons and warnings as text.

use super::gate::{ENOUGH, Gate, Outcome, elements};
use super::honesty;
use super::mistakes;
use super::nulls::nulls;
use super::verdict::{DOUBTFUL, Honesty, UNDER};
use super::{Score, USEFUL_SD, judge};
use catoptric_model::{Calibration, Dataset, Pose, Status};
use catoptric_sim::Truth;
use std::collections::BTreeMap;

/// Share of the squared error above which one rotation is reported to dominate it.
pub const DOMINANT_SHARE: f64 = 0.5;
/// Share of the elements above which abstentions are worth a warning.
const MANY: f64 = 0.1;
/// Error over its bound above which the usual mistakes are tried on a calibration that passes.
const SUSPICIOUS: f64 = 10.0;
// Phrases of warnings whose subject a report covers in sentences of its own.
const COMMON: &str = "common mode dominates";
const UNSOLVED: &str = "elements were not solved";

/// Whether a warning is about accuracy, covariance or abstentions, which a report covers anyway.
pub fn is_covered_by_report(warning: &str) -> bool {
    [DOUBTFUL, UNDER, COMMON, UNSOLVED]
        .iter()
        .any(|words| warning.contains(words))
}

/// Share of the squared error that one rotation common to all elements explains; NaN if it does not exist.
pub fn common_share(score: &Score) -> f64 {
    1.0 - (score.differential_per_axis_rms_deg / score.per_axis_rms_deg).powi(2)
}

/// Adds the gates, the mistakes that are recognized, the warnings, and why figures are missing; settles the verdict.
pub(super) fn judge(
    mut score: Score,
    dataset: &Dataset,
    calibration: &Calibration,
    truth: Option<&Truth>,
    rig: Option<&Pose>,
) -> Score {
    score.honesty = honesty::of(&score);
    score.gates = judge::gates(&score, dataset, calibration, truth);
    let is_met = |g: &Gate| matches!(g.outcome, Outcome::Pass | Outcome::NotTested);
    let suspicious = !score.gates.iter().all(is_met)
        || score.honesty == Some(Honesty::UnderConfident)
        || score.per_axis_rms_deg > SUSPICIOUS * score.crlb_per_axis_deg;
    if let Some(truth) = truth.filter(|_| suspicious) {
        score.mistakes = mistakes::recognize(&score, dataset, calibration, truth, rig);
    }
    score.remarks = score.mistakes.iter().map(ToString::to_string).collect();
    let remarks = warnings(&score, calibration, truth.is_some());
    score.remarks.extend(remarks);
    score.nulls = nulls(&score, calibration, truth);
    score.settled()
}

fn warnings(score: &Score, calibration: &Calibration, has_truth: bool) -> Vec<String> {
    let mut warnings = Vec::new();
    if !has_truth {
        warnings.push(
            "there is no truth: residuals on boards and walls are the only figures, and the boards may be the ones the calibration was fitted to"
                .to_owned(),
        );
    }
    match score.honesty {
        Some(Honesty::Doubtful) => warnings.push(honesty::doubtful(score)),
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
    if stated < scored && score.stated >= ENOUGH {
        warnings.push(format!(
            "{} of {scored} scored elements have no covariance",
            scored - stated
        ));
    }
    if score.useless > 0 {
        warnings.push(format!(
            "useless: {} a standard deviation above {:.0}°, and {} not count as solved",
            elements(score.useless, "states", "state"),
            USEFUL_SD.to_degrees(),
            if score.useless == 1 { "does" } else { "do" }
        ));
    }
    let share = common_share(score);
    let explained = score.mistakes.iter().any(|m| m.figure == "per_axis_rms_deg");
    if !explained && share > DOMINANT_SHARE && score.per_axis_rms_deg > honesty::NEGLIGIBLE_DEG {
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
