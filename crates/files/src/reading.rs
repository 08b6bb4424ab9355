//! From a recording to the records of a dataset: what a calibration needs of every stretch, and what was unusual.
//!
//! A stretch that motion capture cannot place is left out, and so are frames in which a body was lost: with a warning, since
//! nothing is wrong with the recording. Damage is refused, or left out on request.

use super::blocks::Place;
use super::error::IoError;
use super::lost::{Habit, Sieve};
use super::outlying::{Found, Outlying};
use super::playback::{Played, play};
use super::source::Source;
use super::survey::{Survey, Surveyed};
use super::topics::LABEL_TOPIC;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::limits::FAR_M;
use catoptric_model::motion::LONGEST_GAP_S;
use catoptric_model::place::nearest;
use catoptric_model::{PoseKind, PoseRecord, Session, Stop};
use rayon::prelude::*;
use std::sync::Arc;

/// What happens to a recording that is damaged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Damage {
    /// It is refused.
    #[default]
    Refused,
    /// Its damaged stretches are left out.
    LeftOut,
}

/// The stretches of a recording, and what was unusual: a sentence each.
pub(super) struct Records {
    pub(super) poses: Vec<PoseRecord>,
    pub(super) warnings: Vec<String>,
}

/// Reads what a calibration needs of every stretch of a recording; readings stay in the recording.
///
/// # Errors
/// [`IoError`] if it cannot be read, does not fit the session, or has nothing to read.
pub(super) fn records(
    place: &Place,
    session: &Session,
    damage: Damage,
    stop: &Stop,
) -> Result<Records, IoError> {
    let error = match attempt(place, session, damage, stop) {
        Err(error @ IoError::Recording { .. }) if damage == Damage::Refused => error,
        read => return read,
    };
    let kept = attempt(place, session, Damage::LeftOut, stop).map_or(0, |read| read.poses.len());
    Err(match kept {
        0 => error,
        kept => IoError::Damaged {
            source: Box::new(error),
            kept,
        },
    })
}

fn attempt(place: &Place, session: &Session, damage: Damage, stop: &Stop) -> Result<Records, IoError> {
    let played = play::<Survey>(place, session, damage == Damage::LeftOut, stop)?;
    let Played {
        stretches,
        source,
        notes: mut warnings,
        left_out,
        ..
    } = played;
    warnings.extend(left_out);
    if stretches.is_empty() {
        return Err(nothing(place, &source, &warnings));
    }
    let (mut sieves, lost) = sieves(&source, &stretches);
    warnings.extend(lost);
    let (unknown, outlying) = outlying(&source, &stretches, &mut sieves)?;
    warnings.extend(outlying);
    let source = Arc::new(source);
    let complete = |(stretch, (surveyed, sieve)): (usize, (Surveyed, Sieve))| {
        let pose = surveyed.label.pose;
        if let Some(why) = &unknown[stretch] {
            return Ok(Err(format!("pose {pose}: {why}; it is left out")));
        }
        let record = surveyed.complete(&source, stretch, &sieve)?;
        let record = record.map_err(|e| format!("{e}; it is left out"));
        Ok(record.and_then(|record| match untracked_board(&record, session) {
            Some(what) => Err(format!("pose {pose}: {what}; it is left out")),
            None => Ok(record),
        }))
    };
    let of_stretches = stretches.into_par_iter().zip(sieves).enumerate();
    let found: Vec<Result<PoseRecord, String>> =
        of_stretches.map(complete).collect::<Result<_, IoError>>()?;
    let mut poses = Vec::with_capacity(found.len());
    for record in found {
        match record {
            Err(what) => warnings.push(what),
            Ok(record) => match scans_without_frames(&record) {
                Ok(note) => {
                    warnings.extend(note);
                    poses.push(record);
                }
                Err(what) if damage == Damage::LeftOut => warnings.push(format!("{what}; it is left out")),
                Err(what) => return Err(place.corrupt(what, 0)),
            },
        }
    }
    if poses.is_empty() {
        return Err(nothing(place, &source, &warnings));
    }
    Ok(Records { poses, warnings })
}

/// The error for a recording of which nothing can be used.
fn nothing(place: &Place, source: &Source, reasons: &[String]) -> IoError {
    let names = || source.names.iter().map(String::as_str);
    let what = match (source.names.contains(LABEL_TOPIC), nearest(LABEL_TOPIC, names())) {
        _ if !reasons.is_empty() => format!("nothing in it can be used: {}", reasons.join("; ")),
        (true, _) => format!("there is no message on {LABEL_TOPIC}"),
        (false, Some(near)) => format!("there is no topic {LABEL_TOPIC}; did you mean {near}?"),
        (false, None) if source.names.is_empty() => "there is no message in it".to_owned(),
        (false, None) => {
            let names: Vec<&str> = names().collect();
            format!(
                "there is no topic {LABEL_TOPIC}; its topics are {}",
                names.join(", ")
            )
        }
    };
    IoError::content(place.path(), what)
}

/// The frames of each stretch that are not used, and a sentence for each stretch and body that has some.
fn sieves(source: &Source, stretches: &[Surveyed]) -> (Vec<Sieve>, Vec<String>) {
    let bodies = source.bodies.all.len();
    let mut habits = vec![Habit::default(); bodies];
    for stretch in stretches {
        let is_flight = stretch.label.kind == PoseKind::Flight;
        for (habit, seen) in habits.iter_mut().zip(&stretch.seen) {
            habit.add(seen, is_flight);
        }
    }
    let (mut sieves, mut warnings) = (Vec::with_capacity(stretches.len()), Vec::new());
    let mut before = vec![None; bodies];
    for stretch in stretches {
        let mut sieve = Sieve::default();
        for (body, seen) in stretch.seen.iter().enumerate() {
            let unreported = stretch.lost.get(&body).copied().unwrap_or_default();
            let lost = unreported + sieve.mark(body, seen, &habits[body], before[body]);
            before[body] = seen.last().or(before[body]);
            let subject = &source.bodies.all[body].subject;
            if let Some(far) = stretch.far.get(&body) {
                warnings.push(format!(
                    "pose {}: motion capture put {subject:?} beyond {:.0} km in {far} frames, which are not used",
                    stretch.label.pose,
                    1e-3 * FAR_M
                ));
            }
            if lost > 0 {
                warnings.push(format!(
                    "pose {}: motion capture had lost {:?} in {lost} of {} frames, which are not used",
                    stretch.label.pose,
                    subject,
                    seen.frames + unreported
                ));
            }
        }
        sieves.push(sieve);
    }
    (sieves, warnings)
}

/// Looks for frames in which the rig or the board of a stretch is far from where it is in the others. Marks them as unused;
/// returns why a stretch cannot be used, and a sentence for each stretch and body that has some.
fn outlying(
    source: &Source,
    stretches: &[Surveyed],
    sieves: &mut [Sieve],
) -> Result<(Vec<Option<String>>, Vec<String>), IoError> {
    let (mut unknown, mut warnings) = (vec![None; stretches.len()], Vec::new());
    for (number, stretch) in stretches.iter().enumerate() {
        if stretch.label.kind == PoseKind::Flight {
            continue;
        }
        let subjects = [Some(RIG_SUBJECT), stretch.label.board.as_deref()];
        let bodies = subjects
            .into_iter()
            .flatten()
            .filter_map(|subject| source.bodies.position(subject));
        for body in bodies {
            let Some(center) = stretch.seen[body].sample.center() else {
                continue;
            };
            let (mut found, mut sieve) = (Outlying::default(), sieves[number].clone());
            source.frames(number, &[body], |of, frame| {
                if sieve.passes(of, &frame) {
                    found.add(&frame, &center);
                }
            })?;
            let subject = &source.bodies.all[body].subject;
            let Outlying { frames, count, .. } = found;
            match found.found() {
                Found::Moments if count > 0 => {
                    sieves[number].mark_far(body, center);
                    warnings.push(format!(
                        "pose {}: motion capture put {subject:?} elsewhere for a moment in {count} of {frames} frames, which are \
                         not used",
                        stretch.label.pose
                    ));
                }
                Found::Moments | Found::Moved => {}
                Found::Unknown(why) => {
                    unknown[number] = Some(format!(
                        "motion capture put {subject:?} elsewhere in {count} of {frames} frames: {why}"
                    ));
                }
            }
        }
    }
    Ok((unknown, warnings))
}

/// Why a stretch with a board cannot be used, if motion capture never saw it.
fn untracked_board(record: &PoseRecord, session: &Session) -> Option<String> {
    let board = record.label.board.as_deref()?;
    let needs_board = matches!(record.label.kind, PoseKind::Direct | PoseKind::Facet);
    let missing = needs_board && record.room_from_board.is_none() && session.board(board).is_some();
    missing.then(|| format!("motion capture never saw its board {board:?}"))
}

/// Looks for scans of a flight for whose time no frame of motion capture was recorded: a sentence about some, an error about
/// all.
fn scans_without_frames(record: &PoseRecord) -> Result<Option<String>, String> {
    let Some(motion) = &record.motion else {
        return Ok(None);
    };
    let (pose, scans) = (record.label.pose, record.label.scans);
    let gaps = (0..scans).map(|scan| motion.gap_s(motion.time_s(scan, 0, 0.0)));
    let far: Vec<f64> = gaps.filter(|gap| *gap > LONGEST_GAP_S).collect();
    let nearest_s = far.iter().copied().fold(f64::INFINITY, f64::min);
    if far.is_empty() {
        return Ok(None);
    }
    if far.len() == scans {
        return Err(format!(
            "pose {pose}: its scans are {nearest_s:.3} s or more from the nearest frame of motion capture; do both stamp by \
             the same clock?"
        ));
    }
    Ok(Some(format!(
        "pose {pose}: {} of its {scans} scans are {nearest_s:.3} s or more from the nearest frame of motion capture; in the \
         room they have no place",
        far.len()
    )))
}
