//! What went wrong while a pose was recorded, from the recording alone: exchanged labels, a misplaced label, a body
//! that moved, readings that changed their level.
//!
//! A body at rest shows its markers where its template has them, to within the believed errors, and shows them there
//! from the first frame to the last. Every deviation is reported in plain language, pose by pose. If it is certain what
//! happened, the pose is corrected, else it is left out.

mod body;
mod constellation;
mod movement;

use body::{Body, body, name_of};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::{Dataset, PoseKind, PoseRecord, Watched};
use constellation::Misfit;
use nalgebra::Point3;
use rayon::prelude::*;
use std::borrow::Cow;
use std::collections::BTreeMap;

/// What is wrong with one body in one pose.
struct Finding {
    /// Index of the pose.
    pose: usize,
    subject: String,
    what: What,
}

enum What {
    Moved(String),
    Misfit(Misfit),
}

/// The dataset with poses corrected or left out, and a sentence for each; the dataset itself if nothing went wrong.
///
/// A pose that is left out keeps its index: its readings become invalid. If a body's markers do not fit in most of the
/// poses in which it was seen, its template or the belief about its markers is wrong rather than each of those poses;
/// that is reported, and the poses are kept.
pub fn put_right(dataset: &Dataset) -> (Cow<'_, Dataset>, Vec<String>) {
    let session = &dataset.session;
    // Of readings in memory they are gathered now, side by side.
    dataset.poses.par_iter().for_each(|record| {
        record.readings.statistics();
    });
    let mut findings = Vec::new();
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (pose, record) in dataset.poses.iter().enumerate() {
        if !record.label.kind.is_evidence() {
            continue;
        }
        let before = findings.len();
        for watched in &record.watched {
            let Some(body) = body(session, record, &watched.subject) else {
                continue;
            };
            *seen.entry(body.subject).or_default() += 1;
            let what = examine(record, &body, watched, session.believed.marker_sd_mm * 1e-3);
            findings.extend(what.map(|what| Finding {
                pose,
                subject: watched.subject.clone(),
                what,
            }));
        }
        // A motion has changed the readings as well; it is reported once.
        if findings.len() == before
            && let Some(change) = movement::of_readings(record, session)
        {
            findings.push(Finding {
                pose,
                subject: String::new(),
                what: What::Moved(change),
            });
        }
    }
    if findings.is_empty() {
        return (Cow::Borrowed(dataset), Vec::new());
    }
    let (unfit, findings) = without_templates_that_never_fit(findings, &seen);
    let mut repaired = dataset.clone();
    let mut warnings = unfit;
    for finding in findings {
        let record = &mut repaired.poses[finding.pose];
        let name = name_of(&finding.subject);
        let (message, corrected) = match finding.what {
            What::Moved(how) => (how, None),
            What::Misfit(misfit) => (misfit.words(&name), misfit.corrected()),
        };
        let remedy = match corrected {
            Some(pose) if finding.subject == RIG_SUBJECT => {
                record.room_from_rig = pose;
                "its pose was solved anew with the labels corrected"
            }
            Some(pose) => {
                record.room_from_board = Some(pose);
                "its pose was solved anew with the labels corrected"
            }
            None => {
                record.readings = record.readings.left_out();
                "the pose is left out"
            }
        };
        warnings.push(format!("pose {}: {message}; {remedy}", record.label.pose));
    }
    (Cow::Owned(repaired), warnings)
}

fn examine(record: &PoseRecord, body: &Body<'_>, watched: &Watched, marker_sd: f64) -> Option<What> {
    if watched.parts.iter().any(|p| p.len() != body.template.len()) {
        return None;
    }
    let name = name_of(body.subject);
    if let Some(movement) = movement::of_markers(watched) {
        return Some(What::Moved(movement.words(&name)));
    }
    let faces = (body.subject != RIG_SUBJECT && record.label.kind != PoseKind::Room)
        .then(|| Point3::from(record.room_from_rig.translation.vector));
    constellation::misfit(body, watched, marker_sd, faces.as_ref()).map(What::Misfit)
}

/// Removes the misfits of bodies that hardly ever fit, and reports these bodies.
fn without_templates_that_never_fit(
    findings: Vec<Finding>,
    seen: &BTreeMap<&str, usize>,
) -> (Vec<String>, Vec<Finding>) {
    let mut odd: BTreeMap<String, usize> = BTreeMap::new();
    let unexplained = |f: &Finding| matches!(&f.what, What::Misfit(m) if m.corrected().is_none());
    for finding in findings.iter().filter(|f| unexplained(f)) {
        *odd.entry(finding.subject.clone()).or_default() += 1;
    }
    odd.retain(|subject, count| {
        let of = seen.get(subject.as_str()).copied().unwrap_or_default();
        of > 1 && 2 * *count > of
    });
    let message = |(subject, count): (&String, &usize)| {
        format!(
            "the markers of {} do not fit its template in {count} of {} poses: the template in the session, or what it \
             believes of marker errors, is wrong; the poses are used as they were tracked",
            name_of(subject),
            seen.get(subject.as_str()).copied().unwrap_or_default()
        )
    };
    let warnings = odd.iter().map(message).collect();
    let kept = |f: &Finding| !(unexplained(f) && odd.contains_key(&f.subject));
    (warnings, findings.into_iter().filter(kept).collect())
}
