//! Everything a calibration needs of a stretch, accumulated while its messages are read, in bounded memory.
//!
//! If a stretch is long for motion capture, its markers are averaged in another pass over its messages, when their
//! frames have been counted.

use super::bodies::Bodies;
use super::capture::{Capture, MOST_WAITING};
use super::error::IoError;
use super::gathering::{Gathering, Keep, Known, followed};
use super::lost::{Seen, Sieve};
use super::messages::Echoes;
use super::source::Source;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::selection::Median;
use catoptric_model::tracking::{Jumping, MeanPose, Watching, median_jump};
use catoptric_model::{
    BeamStatistics, Gathered, Intensities, ModelError, Motion, Pose, PoseKind, PoseLabel, PoseRecord,
};
use catoptric_model::{Readings, ScanSource, TrackedFrame, Unreadable, Watched};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Maximum number of marker displacements held for their median; more than that take additional passes.
const MOST_JUMPS: usize = 1 << if cfg!(test) { 12 } else { 20 };

/// A stretch being read.
pub(super) struct Survey {
    gathered: Gathered,
    /// Intensities, once a scan has some.
    intensities: Option<Intensities>,
    /// Body by body, once frames have been discarded.
    followed: Option<Vec<Followed>>,
    is_flight: bool,
}

/// A body whose frames are discarded one at a time.
#[derive(Debug, Clone, Default)]
struct Followed {
    mean: MeanPose,
    frames: usize,
    markers: usize,
    is_seen: bool,
    jumping: Jumping,
    /// Squares of the displacements; `None` if there are too many.
    jumps: Jumps,
    /// Trajectory of the rig, in a flight.
    path: Vec<(f64, Pose)>,
    seen: Seen,
}

/// Squares of displacements, or the reason why they are not held.
#[derive(Debug, Clone)]
enum Jumps {
    Held(Vec<f64>),
    TooMany,
}

impl Default for Jumps {
    fn default() -> Self {
        Self::Held(Vec::new())
    }
}

/// The result for a stretch; the readings are not in its record yet.
pub(super) struct Surveyed {
    pub(super) record: Result<PoseRecord, ModelError>,
    pub(super) statistics: Vec<BeamStatistics>,
    pub(super) intensities: Option<Intensities>,
    /// Bodies whose markers remain to be averaged.
    pub(super) unwatched: Vec<Unwatched>,
    /// What the poses of each body look like.
    pub(super) seen: Vec<Seen>,
    /// Number of frames in which the tracker reported no pose of a body.
    pub(super) lost: BTreeMap<usize, usize>,
    /// Number of frames in which it was farther away than anything is.
    pub(super) far: BTreeMap<usize, usize>,
    pub(super) label: PoseLabel,
    /// Whether the label's number of scans was wrong, and with it the halves of the statistics.
    pub(super) is_miscounted: bool,
}

/// A body whose frames are known in number only.
#[derive(Debug, Clone)]
pub(super) struct Unwatched {
    body: usize,
    subject: String,
    frames: usize,
    markers: usize,
    median: Middle,
}

/// The median of squared displacements.
#[derive(Debug, Clone)]
enum Middle {
    Known(Option<f64>),
    /// To be found in further passes.
    Sought(Median),
}

impl Middle {
    fn value(&self) -> Option<f64> {
        match self {
            Self::Known(value) => *value,
            Self::Sought(median) => median.value(),
        }
    }

    fn is_known(&self) -> bool {
        match self {
            Self::Known(_) => true,
            Self::Sought(median) => median.is_found(),
        }
    }
}

impl Jumps {
    fn add(&mut self, square: f64) {
        match self {
            Self::Held(squares) if squares.len() < MOST_JUMPS => squares.push(square),
            Self::Held(_) | Self::TooMany => *self = Self::TooMany,
        }
    }

    fn median(self) -> Middle {
        match self {
            Self::Held(mut squares) => Middle::Known(median_jump(&mut squares)),
            Self::TooMany => Middle::Sought(Median::default()),
        }
    }
}

impl Followed {
    fn add(&mut self, frame: &TrackedFrame, keeps_path: bool) {
        self.frames += 1;
        self.markers = self.markers.max(frame.markers.len());
        self.is_seen |= frame.pose.is_some() || frame.markers.iter().any(Option::is_some);
        let jumps = &mut self.jumps;
        self.jumping.add(&frame.markers, |square| jumps.add(square));
        if let Some(pose) = frame.pose {
            self.seen.add(&pose);
            self.mean.add(&pose);
            if keeps_path {
                self.path.push((frame.time_s, pose));
            }
        }
    }
}

impl Survey {
    /// Discards the oldest frames until N messages are waiting.
    fn follow(&mut self, capture: &mut Capture, left: usize, known: Known<'_>) {
        let bodies = known.bodies;
        let all: Vec<usize> = (0..bodies.all.len()).collect();
        let rig = bodies.position(RIG_SUBJECT).filter(|_| self.is_flight);
        let none = || vec![Followed::default(); all.len()];
        let followed = self.followed.get_or_insert_with(none);
        capture.take(left, bodies, &all, known.epoch, |body, frame| {
            followed[body].add(&frame, rig == Some(body));
        });
    }
}

impl Keep for Survey {
    type Kept = Surveyed;

    fn begin(label: &PoseLabel, beams: usize) -> Self {
        Self {
            gathered: Gathered::new(beams, label.scans),
            intensities: None,
            followed: None,
            is_flight: label.kind == PoseKind::Flight,
        }
    }

    fn scan(&mut self, ranges: Vec<f64>, intensities: Vec<f64>) {
        self.gathered.add(&ranges);
        if !intensities.is_empty() {
            let all = self
                .intensities
                .get_or_insert_with(|| Intensities::new(ranges.len()));
            all.add(&ranges, &intensities);
        }
    }

    fn echoes(&mut self, _: Echoes) {}

    fn look(&mut self, capture: &mut Capture, known: Known<'_>) {
        if capture.waiting() > MOST_WAITING {
            self.follow(capture, MOST_WAITING / 2, known);
        }
    }

    fn end(mut stretch: Gathering<Self>, known: Known<'_>) -> Surveyed {
        if stretch.kept.followed.is_some() {
            stretch.kept.follow(&mut stretch.capture, 0, known);
        }
        let lost = std::mem::take(&mut stretch.capture.lost);
        let far = std::mem::take(&mut stretch.capture.far);
        let (is_miscounted, starts) = (stretch.miscounts(), stretch.uneven_starts(known));
        let (stretch, kept) = stretch.into_stretch(known);
        let (statistics, intensities) = (kept.gathered.finish(), kept.intensities);
        let label = stretch.label.clone();
        let Some(mut all) = kept.followed else {
            let mut seen = vec![Seen::default(); known.bodies.all.len()];
            for track in &stretch.tracks {
                let body = known.bodies.position(&track.subject);
                let seen = &mut seen[body.expect("a tracked body")];
                let poses = track.frames.iter().filter_map(|frame| frame.pose);
                poses.for_each(|pose| seen.add(&pose));
            }
            let mut record = stretch.into_record();
            if let Ok(PoseRecord {
                motion: Some(motion), ..
            }) = &mut record
            {
                motion.scan_starts_s = starts;
            }
            return Surveyed {
                record,
                statistics,
                intensities,
                unwatched: Vec::new(),
                seen,
                lost,
                far,
                label,
                is_miscounted,
            };
        };
        let seen = all
            .iter_mut()
            .map(|body| std::mem::take(&mut body.seen))
            .collect();
        let rig = known.bodies.position(RIG_SUBJECT);
        let motion = kept.is_flight.then(|| Motion {
            start_s: stretch.start_s,
            scan_period_s: stretch.scan_period_s,
            scan_starts_s: starts,
            frames: rig.map_or_else(Vec::new, |rig| std::mem::take(&mut all[rig].path)),
        });
        let (record, unwatched) = of_followed(&label, motion, all, known.bodies, stretch.beams);
        Surveyed {
            record,
            statistics,
            intensities,
            unwatched,
            seen,
            lost,
            far,
            label,
            is_miscounted,
        }
    }
}

/// The record of a stretch whose frames were discarded, and the bodies whose markers remain to be averaged.
fn of_followed(
    label: &PoseLabel,
    motion: Option<Motion>,
    mut all: Vec<Followed>,
    bodies: &Bodies,
    beams: usize,
) -> (Result<PoseRecord, ModelError>, Vec<Unwatched>) {
    let mut unwatched = Vec::new();
    if motion.is_none() {
        let seen: Vec<usize> = (0..all.len()).filter(|body| all[*body].is_seen).collect();
        for body in followed(label, bodies, seen.into_iter()) {
            let of = &mut all[body];
            if of.markers > 0 {
                unwatched.push(Unwatched {
                    body,
                    subject: bodies.all[body].subject.clone(),
                    frames: of.frames,
                    markers: of.markers,
                    median: std::mem::take(&mut of.jumps).median(),
                });
            }
        }
    }
    let mean = |subject: &str| all[bodies.position(subject)?].mean.finish();
    let readings = Readings::in_memory(beams, Vec::new());
    let record = PoseRecord::new(label.clone(), motion, mean, Vec::new(), readings);
    (record, unwatched)
}

/// The markers of bodies over a stretch whose frames were discarded.
fn watch(
    source: &Source,
    stretch: usize,
    mut unwatched: Vec<Unwatched>,
    sieve: &Sieve,
) -> Result<Vec<Watched>, IoError> {
    let bodies: Vec<usize> = unwatched.iter().map(|u| u.body).collect();
    let begun = unwatched.iter().map(|u| Watching::new(u.frames, u.markers));
    let mut watching: Vec<Watching> = begun.collect();
    let mut is_first = true;
    while is_first || unwatched.iter().any(|u| !u.median.is_known()) {
        let mut jumping = vec![Jumping::default(); bodies.len()];
        let mut sieve = sieve.clone();
        source.frames(stretch, &bodies, |body, frame| {
            if !sieve.passes(body, &frame) {
                return;
            }
            let place = bodies.iter().position(|b| *b == body);
            let place = place.expect("only these were asked for");
            if is_first {
                watching[place].add(&frame.markers);
            }
            if let Middle::Sought(median) = &mut unwatched[place].median {
                jumping[place].add(&frame.markers, |square| median.add(square));
            }
        })?;
        for u in &mut unwatched {
            if let Middle::Sought(median) = &mut u.median {
                median.end_pass();
            }
        }
        is_first = false;
    }
    let all = watching.into_iter().zip(unwatched);
    Ok(all
        .map(|(watching, u)| watching.finish(u.subject, u.median.value()))
        .collect())
}

impl Surveyed {
    /// Averages the stretch again, without the frames in which a body was lost.
    fn again(&mut self, source: &Source, stretch: usize, sieve: &Sieve) -> Result<(), IoError> {
        let bodies = &source.bodies;
        let of: Vec<usize> = (0..bodies.all.len()).collect();
        let rig = bodies
            .position(RIG_SUBJECT)
            .filter(|_| self.label.kind == PoseKind::Flight);
        let (mut all, mut passing) = (vec![Followed::default(); of.len()], sieve.clone());
        source.frames(stretch, &of, |body, frame| {
            if passing.passes(body, &frame) {
                all[body].add(&frame, rig == Some(body));
            }
        })?;
        let motion = self.record.as_ref().ok().and_then(|record| record.motion.clone());
        let motion = motion.map(|motion| Motion {
            frames: rig.map_or_else(Vec::new, |rig| std::mem::take(&mut all[rig].path)),
            ..motion
        });
        let beams = source.scanner.scan.beams();
        (self.record, self.unwatched) = of_followed(&self.label, motion, all, bodies, beams);
        Ok(())
    }

    /// The statistics of the readings once more, if the label's number of scans was wrong.
    fn counted(&mut self, source: &Source, stretch: usize) -> Result<(), Unreadable> {
        if self.is_miscounted {
            let mut gathered = Gathered::new(source.scanner.scan.beams(), source.stretches[stretch].scans);
            for scan in source.scans(stretch) {
                gathered.add(&scan?);
            }
            self.statistics = gathered.finish();
        }
        Ok(())
    }

    /// The complete record of the stretch, whose readings stay in the recording.
    pub(super) fn complete(
        mut self,
        source: &Arc<Source>,
        stretch: usize,
        sieve: &Sieve,
    ) -> Result<Result<PoseRecord, ModelError>, IoError> {
        if !sieve.is_empty() {
            self.again(source, stretch, sieve)?;
        }
        self.counted(source, stretch)
            .map_err(|_| source.place.changed(0))?;
        let mut record = match self.record {
            Ok(record) => record,
            Err(error) => return Ok(Err(error)),
        };
        if !self.unwatched.is_empty() {
            record.watched = watch(source, stretch, self.unwatched, sieve)?;
        }
        let recording: Arc<dyn ScanSource> = Arc::<Source>::clone(source);
        let readings = Readings::recorded(recording, stretch, record.label.scans, self.statistics);
        record.readings = readings.with_intensities(self.intensities);
        Ok(Ok(record))
    }
}
