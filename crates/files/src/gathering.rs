//! A stretch being recorded: the messages between one label and the next.

use super::bodies::Bodies;
use super::capture::{Capture, seconds_between};
use super::messages::{LabeledMarker, Scan};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::frame::Pose;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{PoseLabel, Stretch, Track};
use std::f64::consts::TAU;

/// Maximum difference from the scanner's period to be treated as equal to it, in seconds: stamps are whole nanoseconds.
const PERIOD_TOLERANCE_S: f64 = 1e-9;

/// Properties shared by all stretches of a recording.
#[derive(Clone, Copy)]
pub(super) struct Known<'a> {
    pub(super) scanner: &'a ScannerSheet,
    pub(super) bodies: &'a Bodies,
    /// Time of the first message, in nanoseconds.
    pub(super) epoch: u64,
}

/// What is kept of a stretch while it is read: everything, or what a calibration needs.
pub(super) trait Keep: Sized {
    /// The final result.
    type Kept;
    /// Begins an empty stretch with a given number of beams.
    fn begin(label: &PoseLabel, beams: usize) -> Self;
    /// Adds a scan.
    fn scan(&mut self, ranges: Vec<f64>);
    /// Adds the echoes of a scan.
    fn echoes(&mut self, echoes: Vec<Vec<f64>>);
    /// Processes the motion capture received so far.
    fn look(&mut self, capture: &mut Capture, known: Known<'_>);
    /// Ends a complete stretch.
    fn end(stretch: Gathering<Self>, known: Known<'_>) -> Self::Kept;
}

/// A stretch being read; times are in nanoseconds.
pub(super) struct Gathering<R> {
    pub(super) label: PoseLabel,
    label_time: u64,
    first_scan: Option<u64>,
    last_scan: u64,
    scan_time: f64,
    scans: usize,
    /// Number of scans whose echoes were recorded too.
    echoes: usize,
    pub(super) kept: R,
    pub(super) capture: Capture,
}

/// Keeps the whole stretch.
#[derive(Default)]
pub(super) struct Whole {
    ranges: Vec<f64>,
    echoes: Vec<Vec<f64>>,
}

impl<R: Keep> Gathering<R> {
    /// Begins with a label.
    pub(super) fn new(label: PoseLabel, label_time: u64, scanner: &ScannerSheet) -> Self {
        Self {
            kept: R::begin(&label, scanner.scan.beams()),
            label,
            label_time,
            first_scan: None,
            last_scan: label_time,
            scan_time: 0.0,
            scans: 0,
            echoes: 0,
            capture: Capture::default(),
        }
    }

    /// Adds a scan; its beams must be those of the session.
    pub(super) fn scan(&mut self, scan: Scan, scanner: &ScannerSheet) -> Result<(), String> {
        let beams = scanner.scan.beams();
        if scan.ranges.len() != beams {
            return Err(format!("{} beams, session.toml has {beams}", scan.ranges.len()));
        }
        let (first, step) = (scanner.scan.azimuth(0), scanner.scan.increment());
        let drift = (scan.angle_increment - step).abs() * beams as f64;
        let off = scan.angle_min - first;
        // Azimuths a full turn apart are equivalent.
        let off = off - TAU * (off / TAU).round();
        // A quarter of a step separates 32-bit rounding from a different beam.
        if drift + off.abs() > step.abs() / 4.0 {
            return Err(format!(
                "beams from {} rad in steps of {} rad, session.toml has {first} and {step}",
                scan.angle_min, scan.angle_increment
            ));
        }
        self.first_scan.get_or_insert(scan.stamp);
        self.last_scan = scan.stamp;
        self.scan_time = scan.scan_time;
        self.scans += 1;
        self.kept.scan(scan.ranges);
        Ok(())
    }

    /// Adds the echoes of a scan; its beams must be those of the session.
    pub(super) fn echoes(&mut self, echoes: Vec<Vec<f64>>, scanner: &ScannerSheet) -> Result<(), String> {
        let beams = scanner.scan.beams();
        if echoes.len() != beams {
            return Err(format!("{} beams, session.toml has {beams}", echoes.len()));
        }
        self.echoes += 1;
        self.kept.echoes(echoes);
        Ok(())
    }

    /// Adds a solved pose of a body.
    pub(super) fn pose(
        &mut self,
        time: u64,
        body: usize,
        pose: Pose,
        known: Known<'_>,
    ) -> Result<(), String> {
        self.capture.pose(time, body, pose)?;
        self.kept.look(&mut self.capture, known);
        Ok(())
    }

    /// Adds the markers of a frame.
    pub(super) fn markers(
        &mut self,
        time: u64,
        markers: &[LabeledMarker],
        known: Known<'_>,
    ) -> Result<(), String> {
        self.capture.markers(time, markers, known.bodies)?;
        self.kept.look(&mut self.capture, known);
        Ok(())
    }

    /// Number of the pose.
    pub(super) fn number(&self) -> usize {
        self.label.pose
    }

    /// Ends the stretch; an error if the number of its scans differs from its label.
    pub(super) fn end(self, known: Known<'_>) -> Result<R::Kept, String> {
        let (pose, expected, found) = (self.label.pose, self.label.scans, self.scans);
        if found != expected {
            return Err(format!("pose {pose}: {found} scans, its label says {expected}"));
        }
        if self.echoes > 0 && self.echoes != found {
            return Err(format!("pose {pose}: echoes of {} scans of {found}", self.echoes));
        }
        Ok(R::end(self, known))
    }

    /// The stretch without its readings, with times counted from the epoch, and the data kept of them.
    pub(super) fn into_stretch(mut self, known: Known<'_>) -> (Stretch, R) {
        let start = self.first_scan.unwrap_or(self.label_time);
        let stretch = Stretch {
            start_s: seconds_between(known.epoch, start),
            scan_period_s: self.period(known.scanner, start),
            beams: known.scanner.scan.beams(),
            tracks: self.tracks(known),
            ranges: Vec::new(),
            echoes: None,
            label: self.label,
        };
        (stretch, self.kept)
    }

    /// Scan period: the scanner's if the stamps agree with it to within their resolution.
    fn period(&self, scanner: &ScannerSheet, start: u64) -> f64 {
        let rated = scanner.scan.scan_period_s();
        let (measured, tolerance) = match self.scans {
            0 => return rated,
            1 => (self.scan_time, rated * f64::from(f32::EPSILON)),
            n => (
                seconds_between(start, self.last_scan) / (n - 1) as f64,
                PERIOD_TOLERANCE_S,
            ),
        };
        if (measured - rated).abs() <= tolerance {
            rated
        } else {
            measured
        }
    }

    /// The rig, the board of the label and any other body seen, with their remaining frames.
    fn tracks(&mut self, known: Known<'_>) -> Vec<Track> {
        if self.capture.waiting() == 0 {
            return Vec::new();
        }
        let order = followed(&self.label, known.bodies, self.capture.seen());
        let subject = |body: &usize| known.bodies.all[*body].subject.clone();
        let mut tracks: Vec<Track> = order
            .iter()
            .map(|body| Track {
                subject: subject(body),
                frames: Vec::new(),
            })
            .collect();
        self.capture
            .take(0, known.bodies, &order, known.epoch, |body, frame| {
                let place = order.iter().position(|b| *b == body);
                tracks[place.expect("it is one of them")].frames.push(frame);
            });
        tracks
    }
}

/// The bodies that have tracks: the rig, the board of the label, and others that were seen.
pub(super) fn followed(label: &PoseLabel, bodies: &Bodies, seen: impl Iterator<Item = usize>) -> Vec<usize> {
    let expected = [Some(RIG_SUBJECT), label.board.as_deref()];
    let expected = expected.into_iter().flatten();
    let expected: Vec<usize> = expected.filter_map(|subject| bodies.position(subject)).collect();
    let mut others: Vec<_> = seen.filter(|b| !expected.contains(b)).collect();
    others.sort_unstable();
    others.dedup();
    expected.into_iter().chain(others).collect()
}

impl Keep for Whole {
    type Kept = Stretch;

    fn begin(_: &PoseLabel, _: usize) -> Self {
        Self::default()
    }

    fn scan(&mut self, ranges: Vec<f64>) {
        self.ranges.extend(ranges);
    }

    fn echoes(&mut self, echoes: Vec<Vec<f64>>) {
        self.echoes.extend(echoes);
    }

    fn look(&mut self, _: &mut Capture, _: Known<'_>) {}

    fn end(stretch: Gathering<Self>, known: Known<'_>) -> Stretch {
        let (stretch, kept) = stretch.into_stretch(known);
        Stretch {
            ranges: kept.ranges,
            echoes: (!kept.echoes.is_empty()).then_some(kept.echoes),
            ..stretch
        }
    }
}
