//! A recorded experiment: the session, and the scans and tracked bodies of every board pose.
//!
//! A [`Stretch`] is what the laboratory records, frame by frame; a [`PoseRecord`] is what a calibration needs of it.

use crate::error::ModelError;
use crate::frame::Pose;
use crate::label::{PoseKind, PoseLabel};
use crate::motion::Motion;
use crate::readings::{BeamStatistics, Intensities, Readings, Scans};
use crate::session::Session;
use crate::summary::Summary;
use crate::tracking::{Track, Watched};

/// Name of the rig as a motion-capture subject.
pub const RIG_SUBJECT: &str = "rig";

/// A finite, non-negative time in seconds as whole nanoseconds, the resolution of a recording.
pub fn nanoseconds(seconds: f64) -> u64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "the time is finite and not negative"
    )]
    let ns = (seconds * 1e9).round() as u64;
    ns
}

/// One stretch of scans as recorded; nothing moves, except in a flight.
#[derive(Debug, Clone, PartialEq)]
pub struct Stretch {
    /// What the experimenter noted.
    pub label: PoseLabel,
    /// Time at which the first scan began, in seconds since the recording began.
    pub start_s: f64,
    /// Time from the start of one scan to the start of the next, in seconds.
    pub scan_period_s: f64,
    /// Beams of a scan.
    pub beams: usize,
    /// Readings in meters, scan after scan; −∞ too close, +∞ no return, NaN invalid (REP-117).
    pub ranges: Vec<f64>,
    /// Echoes of every reading in meters, nearest first and in the order of `ranges`, if they were recorded.
    pub echoes: Option<Vec<Vec<f64>>>,
    /// Intensity of every reading in counts of the receiver, in the order of `ranges`, if it was recorded; 0 for a code.
    pub intensities: Option<Vec<f64>>,
    /// Intensities of the echoes, in the order of `echoes`, if both were recorded.
    pub echo_intensities: Option<Vec<Vec<f64>>>,
    /// The tracked bodies, the rig first.
    pub tracks: Vec<Track>,
}

/// Consecutive scans of a stretch, with the motion-capture frames from the first of them to the one after the last.
///
/// The first excerpt of a stretch also has the frames before its first scan, and the last those after its last. A
/// stretch of any length can be recorded excerpt by excerpt.
#[derive(Debug, Clone, PartialEq)]
pub struct Excerpt {
    /// The scans and frames. Everything else is that of the whole stretch: the label, and the time of its first scan.
    pub part: Stretch,
    /// Index in the stretch of the first scan.
    pub first_scan: usize,
    /// First solved pose of each tracked body in the whole stretch, with its time; `None` if it was never solved.
    pub first_seen: Vec<Option<(f64, Pose)>>,
}

/// One stretch of scans, with the tracked poses of rig and board.
#[derive(Debug, Clone, PartialEq)]
pub struct PoseRecord {
    /// What the experimenter noted.
    pub label: PoseLabel,
    /// Rig as tracked: mean over the stretch, or the first pose of a flight.
    pub room_from_rig: Pose,
    /// Board as tracked, mean over the stretch; `None` if none was set up.
    pub room_from_board: Option<Pose>,
    /// Trajectory of the rig during a flight; `None` if nothing moved.
    pub motion: Option<Motion>,
    /// The markers of rig and board over the stretch; empty for a flight, or if only poses were recorded.
    pub watched: Vec<Watched>,
    /// Readings of all beams, scan by scan.
    pub readings: Readings,
}

/// A recorded experiment: the input of a calibration.
///
/// Its size does not grow with the number of scans: readings stay in the recording, which is read again when a
/// statistic needs them, unless the dataset was made in memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Dataset {
    /// What the experimenter knows.
    pub session: Session,
    /// The stretches, in the order they were recorded.
    pub poses: Vec<PoseRecord>,
    /// SHA-256 of the recording it was read from, in hexadecimal; `None` for a dataset made in memory.
    pub id: Option<String>,
    /// What was unusual in the recording, and how it was dealt with: a sentence each, for the warnings of a calibration.
    pub warnings: Vec<String>,
}

impl Stretch {
    /// First solved pose of each tracked body, with its time.
    pub fn first_seen(&self) -> Vec<Option<(f64, Pose)>> {
        let first = |track: &Track| track.frames.iter().find_map(|f| Some((f.time_s, f.pose?)));
        self.tracks.iter().map(first).collect()
    }

    /// Extracts what a calibration needs of the stretch.
    ///
    /// # Errors
    /// [`ModelError::Inconsistent`] if motion capture never saw the rig.
    pub fn into_record(self) -> Result<PoseRecord, ModelError> {
        let mean = |subject: &str| {
            self.tracks
                .iter()
                .find(|t| t.subject == subject)
                .and_then(Track::mean_pose)
        };
        let motion = (self.label.kind == PoseKind::Flight).then(|| self.motion());
        let watched = match motion {
            Some(_) => Vec::new(),
            None => self.tracks.iter().filter_map(Watched::of).collect(),
        };
        let intensities = self.intensities.map(|counts| {
            let mut all = Intensities::new(self.beams);
            let scans = self.ranges.chunks(self.beams.max(1));
            scans
                .zip(counts.chunks(self.beams.max(1)))
                .for_each(|(ranges, counts)| all.add(ranges, counts));
            all
        });
        let readings = Readings::in_memory(self.beams, self.ranges).with_intensities(intensities);
        PoseRecord::new(self.label, motion, mean, watched, readings)
    }

    /// Poses of the rig, frame by frame.
    fn motion(&self) -> Motion {
        let rig = self.tracks.iter().filter(|t| t.subject == RIG_SUBJECT);
        let frames = rig.flat_map(|t| &t.frames);
        Motion {
            start_s: self.start_s,
            scan_period_s: self.scan_period_s,
            scan_starts_s: Vec::new(),
            frames: frames.filter_map(|f| Some((f.time_s, f.pose?))).collect(),
        }
    }
}

impl PoseRecord {
    /// Builds the record of a stretch; `mean` returns the mean pose of a body.
    ///
    /// # Errors
    /// [`ModelError::Inconsistent`] if motion capture never saw the rig.
    pub fn new(
        label: PoseLabel,
        motion: Option<Motion>,
        mean: impl Fn(&str) -> Option<Pose>,
        watched: Vec<Watched>,
        readings: Readings,
    ) -> Result<Self, ModelError> {
        let room_from_rig = match &motion {
            Some(motion) => motion.frames.first().map(|(_, pose)| *pose),
            None => mean(RIG_SUBJECT),
        };
        let room_from_rig = room_from_rig.ok_or_else(|| {
            ModelError::Inconsistent(format!("pose {}: the rig was never tracked", label.pose))
        })?;
        Ok(Self {
            room_from_rig,
            room_from_board: label.board.as_deref().and_then(mean),
            motion,
            watched,
            readings,
            label,
        })
    }

    /// Beams of a scan.
    pub fn beams(&self) -> usize {
        self.readings.beams()
    }

    /// The scans in order.
    ///
    /// ```
    /// use catoptric_model::{PoseRecord, Unreadable};
    ///
    /// fn longest(record: &PoseRecord) -> Result<f64, Unreadable> {
    ///     let mut longest = 0.0_f64;
    ///     for scan in record.scans() {
    ///         longest = scan?.iter().filter(|r| r.is_finite()).fold(longest, |l, r| l.max(*r));
    ///     }
    ///     Ok(longest)
    /// }
    /// ```
    pub fn scans(&self) -> Scans<'_> {
        self.readings.scans()
    }

    /// Mean and spread of every beam.
    pub fn summarize(&self) -> Vec<Summary> {
        let beams = self.readings.statistics().iter();
        beams.map(BeamStatistics::summary).collect()
    }
}

impl Dataset {
    /// Checks that the parts are consistent.
    ///
    /// # Errors
    /// [`ModelError::Inconsistent`] names the first pose whose board is not in the session or is missing, or whose
    /// number of readings is not scans × beams.
    pub fn check(&self) -> Result<(), ModelError> {
        let fail = |pose: &PoseRecord, what: String| {
            Err(ModelError::Inconsistent(format!(
                "pose {}: {what}",
                pose.label.pose
            )))
        };
        for pose in &self.poses {
            let (beams, found) = (pose.beams(), pose.readings.len());
            let scanner = self.session.scanner.scan.beams();
            if beams != scanner {
                return fail(pose, format!("{beams} beams, the scanner has {scanner}"));
            }
            let expected = pose.label.scans * beams;
            if found != expected {
                return fail(pose, format!("{found} readings, {expected} expected"));
            }
            let needs_board = matches!(pose.label.kind, PoseKind::Direct | PoseKind::Facet);
            match &pose.label.board {
                Some(name) if self.session.board(name).is_none() => {
                    return fail(pose, format!("board {name:?} is not in session.toml"));
                }
                None if needs_board => return fail(pose, "no board named".to_owned()),
                _ => {}
            }
            if needs_board && pose.room_from_board.is_none() {
                return fail(pose, "its board was never tracked".to_owned());
            }
        }
        Ok(())
    }

    /// The first stretch of a kind.
    pub fn first(&self, kind: PoseKind) -> Option<&PoseRecord> {
        self.of_kind(kind).next()
    }

    /// The stretches of a kind, in order.
    pub fn of_kind(&self, kind: PoseKind) -> impl Iterator<Item = &PoseRecord> + '_ {
        self.poses.iter().filter(move |p| p.label.kind == kind)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_leaves_codes_out() {
        let pose = PoseRecord {
            label: PoseLabel::of(0, PoseKind::Room, 3),
            room_from_rig: Pose::identity(),
            room_from_board: None,
            motion: None,
            watched: Vec::new(),
            readings: Readings::in_memory(2, vec![1.0, f64::INFINITY, 2.0, f64::NAN, 3.0, 5.0]),
        };
        let s = pose.summarize();
        assert_eq!(
            s[0],
            Summary {
                count: 3,
                mean: 2.0,
                sd: 1.0,
                ..Summary::default()
            }
        );
        assert_eq!(
            s[1],
            Summary {
                count: 1,
                missing: 2,
                mean: 5.0,
                ..Summary::default()
            }
        );
    }
}
