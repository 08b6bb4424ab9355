//! Everything a calibration needs of a stretch, accumulated while its messages are read, in bounded memory.
//!
//! If a stretch is long for motion capture, its markers are averaged in another pass over its messages, when their
//! frames have been counted.

use super::capture::Capture;
use super::error::IoError;
use super::gathering::{Gathering, Keep, Known, followed};
use super::source::Source;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::selection::Median;
use catoptric_model::tracking::{Jumping, MeanPose, Watching, median_jump};
use catoptric_model::{BeamStatistics, Gathered, ModelError, Motion, Pose, PoseKind, PoseLabel, PoseRecord};
use catoptric_model::{TrackedFrame, Watched};

/// Maximum number of motion-capture messages waiting to form frames; stretches with fewer may have them in any order.
///
/// Tests use lower limits.
pub(super) const MOST_WAITING: usize = 1 << if cfg!(test) { 10 } else { 15 };

/// Maximum number of marker displacements held for their median; more than that take additional passes.
const MOST_JUMPS: usize = 1 << if cfg!(test) { 12 } else { 20 };

/// A stretch being read.
pub(super) struct Survey {
    gathered: Gathered,
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
    /// Bodies whose markers remain to be averaged.
    pub(super) unwatched: Vec<Unwatched>,
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
            followed: None,
            is_flight: label.kind == PoseKind::Flight,
        }
    }

    fn scan(&mut self, ranges: Vec<f64>) {
        self.gathered.add(&ranges);
    }

    fn echoes(&mut self, _: Vec<Vec<f64>>) {}

    fn look(&mut self, capture: &mut Capture, known: Known<'_>) {
        if capture.waiting() > MOST_WAITING {
            self.follow(capture, MOST_WAITING / 2, known);
        }
    }

    fn end(mut stretch: Gathering<Self>, known: Known<'_>) -> Surveyed {
        if stretch.kept.followed.is_some() {
            stretch.kept.follow(&mut stretch.capture, 0, known);
        }
        let (stretch, kept) = stretch.into_stretch(known);
        let statistics = kept.gathered.finish();
        let Some(mut all) = kept.followed else {
            return Surveyed {
                record: stretch.into_record(),
                statistics,
                unwatched: Vec::new(),
            };
        };
        let position = |subject: &str| known.bodies.position(subject);
        let motion = kept.is_flight.then(|| Motion {
            start_s: stretch.start_s,
            scan_period_s: stretch.scan_period_s,
            frames: position(RIG_SUBJECT).map_or_else(Vec::new, |rig| std::mem::take(&mut all[rig].path)),
        });
        let mut unwatched = Vec::new();
        if motion.is_none() {
            let seen: Vec<usize> = (0..all.len()).filter(|body| all[*body].is_seen).collect();
            let bodies = followed(&stretch.label, known.bodies, seen.into_iter());
            for body in bodies {
                let of = &mut all[body];
                if of.markers > 0 {
                    unwatched.push(Unwatched {
                        body,
                        subject: known.bodies.all[body].subject.clone(),
                        frames: of.frames,
                        markers: of.markers,
                        median: std::mem::take(&mut of.jumps).median(),
                    });
                }
            }
        }
        let mean = |subject: &str| all[position(subject)?].mean.finish();
        let readings = catoptric_model::Readings::in_memory(stretch.beams, Vec::new());
        Surveyed {
            record: PoseRecord::new(stretch.label, motion, mean, Vec::new(), readings),
            statistics,
            unwatched,
        }
    }
}

/// The markers of bodies over a stretch whose frames were discarded.
pub(super) fn watch(
    source: &Source,
    stretch: usize,
    mut unwatched: Vec<Unwatched>,
) -> Result<Vec<Watched>, IoError> {
    let bodies: Vec<usize> = unwatched.iter().map(|u| u.body).collect();
    let begun = unwatched.iter().map(|u| Watching::new(u.frames, u.markers));
    let mut watching: Vec<Watching> = begun.collect();
    let mut is_first = true;
    while is_first || unwatched.iter().any(|u| !u.median.is_known()) {
        let mut jumping = vec![Jumping::default(); bodies.len()];
        source.frames(stretch, &bodies, |body, frame| {
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
