//! Counts of elements by outcome: solved, abstained, missed, false, open, and by status.

use super::element::solved;
use super::statistics::CHI_SQUARED_999;
use super::statistics::mean;
use super::{ApartScore, BeamCounts, ElementError, OpenCounts};
use catoptric_model::{BeamEstimate, Calibration, Dataset, Status};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use std::collections::{BTreeMap, BTreeSet};

/// Counts the elements that were solved, abstained, missed or false.
pub(super) fn count(calibration: &Calibration, truth: Option<&Truth>) -> BeamCounts {
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

/// Whether an entry has no direction, and a status and a reason instead.
fn abstains(b: &BeamEstimate) -> bool {
    match b.status {
        Status::Solved | Status::Direct => false,
        Status::TooFewPoses | Status::Unobservable | Status::NotConverged | Status::Rejected => {
            b.reason.as_ref().is_some_and(|r| !r.trim().is_empty())
        }
    }
}

/// Counts the outcomes of the elements that their boards leave open.
pub(super) fn open(
    calibration: &Calibration,
    elements: &[ElementError],
    open: &BTreeSet<usize>,
) -> OpenCounts {
    let solved = || elements.iter().filter(|e| open.contains(&e.beam));
    let entries = open.iter().filter_map(|&b| calibration.beam(b));
    OpenCounts {
        elements: open.len(),
        abstained: entries.filter(|b| abstains(b)).count(),
        solved: solved().count(),
        wrong: solved()
            .filter(|e| e.mahalanobis_squared.is_some_and(|m| m > CHI_SQUARED_999))
            .count(),
    }
}

/// Counts the elements of each status; "absent" are those without an entry in the calibration.
pub(super) fn statuses(dataset: &Dataset, calibration: &Calibration) -> BTreeMap<&'static str, usize> {
    let mut counts: BTreeMap<_, _> = Status::ALL.iter().map(|s| (s.word(), 0)).collect();
    for b in &calibration.beams {
        *counts.entry(b.status.word()).or_default() += 1;
    }
    counts.insert("absent", absent(dataset, calibration));
    counts
}

/// Counts the elements without an entry in the calibration.
pub fn absent(dataset: &Dataset, calibration: &Calibration) -> usize {
    let beams = 0..dataset.session.scanner.scan.beams();
    beams.filter(|&b| calibration.beam(b).is_none()).count()
}

/// Scores the elements of a class that is reported separately.
pub(super) fn apart(
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
