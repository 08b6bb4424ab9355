//! A stretch being recorded: the messages between one label and the next.

use super::bodies::Bodies;
use super::capture::{Capture, seconds_between};
use super::codes::{Codes, Limits};
use super::messages::{Echoes, LabeledMarker, Scan};
use super::order::Recent;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::frame::Pose;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{PoseKind, PoseLabel, Stretch, Track};
use std::f64::consts::TAU;

/// Maximum difference from the scanner's period to be treated as equal to it, in seconds: stamps are whole nanoseconds.
const PERIOD_TOLERANCE_S: f64 = 1e-9;

/// Maximum difference of a scan's stamp from evenly spaced ones, in seconds: rounding of both to nanoseconds.
const STAMP_TOLERANCE_S: f64 = 2e-9;

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
    /// Adds the ranges of a scan, and their intensities unless these are empty.
    fn scan(&mut self, ranges: Vec<f64>, intensities: Vec<f64>);
    /// Adds the echoes of a scan.
    fn echoes(&mut self, echoes: Echoes);
    /// Processes the motion capture received so far.
    fn look(&mut self, capture: &mut Capture, known: Known<'_>);
    /// Ends a complete stretch.
    fn end(stretch: Gathering<Self>, known: Known<'_>) -> Self::Kept;
}

/// A stretch being read; times are in nanoseconds.
pub(super) struct Gathering<R> {
    pub(super) label: PoseLabel,
    pub(super) label_time: u64,
    /// The messages taken last, which may be repeated.
    pub(super) recent: Recent,
    first_scan: Option<u64>,
    last_scan: u64,
    /// Time at which the last scan was logged.
    pub(super) latest_scan: u64,
    scan_time: f64,
    scans: usize,
    /// Stamp of every scan of a flight.
    stamps: Vec<u64>,
    /// What was unusual and is no fault.
    pub(super) notes: Vec<String>,
    /// Number of scans whose echoes were recorded too.
    echoes: usize,
    pub(super) kept: R,
    pub(super) capture: Capture,
}

/// Number of turns within which the azimuth of a first beam must be: of a larger one no digit is left to compare.
const MOST_TURNS: f64 = 4.0;

/// Keeps the whole stretch.
#[derive(Default)]
pub(super) struct Whole {
    ranges: Vec<f64>,
    echoes: Vec<Vec<f64>>,
    intensities: Vec<f64>,
    echo_intensities: Vec<Vec<f64>>,
}

impl<R: Keep> Gathering<R> {
    /// Begins with a label.
    pub(super) fn new(label: PoseLabel, label_time: u64, scanner: &ScannerSheet) -> Self {
        Self {
            kept: R::begin(&label, scanner.scan.beams()),
            label,
            label_time,
            recent: Recent::default(),
            first_scan: None,
            last_scan: label_time,
            latest_scan: label_time,
            scan_time: 0.0,
            scans: 0,
            stamps: Vec::new(),
            notes: Vec::new(),
            echoes: 0,
            capture: Capture::default(),
        }
    }

    /// Adds a scan, logged at a given time; its beams must be those of the session.
    pub(super) fn scan(
        &mut self,
        mut scan: Scan,
        logged: u64,
        scanner: &ScannerSheet,
        codes: &mut Codes,
    ) -> Result<(), String> {
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
        if drift + off.abs() > step.abs() / 4.0 || scan.angle_min.abs() > MOST_TURNS * TAU {
            return Err(format!(
                "beams from {} rad in steps of {} rad, session.toml has {first} and {step}",
                scan.angle_min, scan.angle_increment
            ));
        }
        let counts = scan.intensities.len();
        if counts > 0 && counts != beams {
            return Err(format!("{beams} beams, intensities of {counts}"));
        }
        codes.replace(&mut scan.ranges, Limits::of(scanner, scan.limits_m)?);
        if self.label.kind == PoseKind::Flight {
            self.stamps.push(scan.stamp);
        }
        self.first_scan.get_or_insert(scan.stamp);
        self.last_scan = scan.stamp;
        self.latest_scan = logged;
        self.scan_time = scan.scan_time;
        self.scans += 1;
        self.kept.scan(scan.ranges, scan.intensities);
        Ok(())
    }

    /// Adds the echoes of a scan; its beams must be those of the session.
    pub(super) fn echoes(&mut self, echoes: Echoes, scanner: &ScannerSheet) -> Result<(), String> {
        let beams = scanner.scan.beams();
        if echoes.ranges.len() != beams {
            return Err(format!("{} beams, session.toml has {beams}", echoes.ranges.len()));
        }
        self.echoes += 1;
        self.kept.echoes(echoes);
        Ok(())
    }

    /// Adds the pose of a body in a frame; `None` if the tracker had lost it.
    pub(super) fn pose(
        &mut self,
        time: u64,
        body: usize,
        pose: Option<Pose>,
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

    /// Number of its scans so far.
    pub(super) fn scans(&self) -> usize {
        self.scans
    }

    /// Number of the pose.
    pub(super) fn number(&self) -> usize {
        self.label.pose
    }

    /// Whether the recording has another number of scans than the label.
    pub(super) fn miscounts(&self) -> bool {
        self.scans != self.label.scans
    }

    /// Ends the stretch: what was kept of it, and what was unusual. An error if it has none of its scans, or if it is a flight
    /// whose scans have no times that motion capture knows.
    pub(super) fn end(mut self, known: Known<'_>) -> Result<(R::Kept, Vec<String>), String> {
        let (pose, expected, found) = (self.label.pose, self.label.scans, self.scans);
        if found == 0 && expected > 0 {
            return Err(format!(
                "pose {pose}: none of its {expected} scans is in the recording"
            ));
        }
        if found < expected {
            let lost = expected - found;
            self.notes.push(format!(
                "pose {pose}: {lost} of its {expected} scans are not in the recording"
            ));
        }
        if found > expected {
            return Err(format!(
                "pose {pose}: {found} scans, its label says {expected}; was the next label lost?"
            ));
        }
        if self.echoes > 0 && self.echoes != found {
            return Err(format!("pose {pose}: echoes of {} scans of {found}", self.echoes));
        }
        self.check_times()?;
        let notes = std::mem::take(&mut self.notes);
        Ok((R::end(self, known), notes))
    }

    /// Checks that the scans of a flight were stamped one after the other.
    fn check_times(&self) -> Result<(), String> {
        let pose = self.label.pose;
        let Some(k) = self.stamps.windows(2).position(|pair| pair[1] <= pair[0]) else {
            return Ok(());
        };
        let back = seconds_between(self.stamps[k + 1], self.stamps[k]);
        let how = match back == 0.0 {
            true => "bear the same stamp".to_owned(),
            false => format!("are stamped in the wrong order, {back} s apart"),
        };
        Err(format!(
            "pose {pose}: scans {k} and {} {how}; a flight needs the time of each scan",
            k + 1
        ))
    }

    /// Times at which the scans of a flight began, in seconds since the epoch; none if they are evenly spaced.
    pub(super) fn uneven_starts(&self, known: Known<'_>) -> Vec<f64> {
        let Some(start) = self.first_scan else {
            return Vec::new();
        };
        let period = self.period(known.scanner, start);
        let is_even = |(k, stamp): (usize, &u64)| {
            (seconds_between(start, *stamp) - k as f64 * period).abs() <= STAMP_TOLERANCE_S
        };
        if self.stamps.iter().enumerate().all(is_even) {
            return Vec::new();
        }
        self.stamps
            .iter()
            .map(|stamp| seconds_between(known.epoch, *stamp))
            .collect()
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
            intensities: None,
            echo_intensities: None,
            label: PoseLabel {
                scans: self.scans,
                ..self.label
            },
        };
        (stretch, self.kept)
    }

    /// Scan period: the scanner's if the stamps agree with it to within their resolution.
    fn period(&self, scanner: &ScannerSheet, start: u64) -> f64 {
        let rated = scanner.scan.scan_period_s();
        let (measured, tolerance) = match self.scans {
            0 => return rated,
            1 if self.scan_time > 0.0 => (self.scan_time, rated * f64::from(f32::EPSILON)),
            1 => return rated,
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

    fn scan(&mut self, ranges: Vec<f64>, intensities: Vec<f64>) {
        self.ranges.extend(ranges);
        self.intensities.extend(intensities);
    }

    fn echoes(&mut self, echoes: Echoes) {
        self.echoes.extend(echoes.ranges);
        self.echo_intensities.extend(echoes.intensities);
    }

    fn look(&mut self, _: &mut Capture, _: Known<'_>) {}

    fn end(stretch: Gathering<Self>, known: Known<'_>) -> Stretch {
        let (stretch, kept) = stretch.into_stretch(known);
        // Scans with intensities and without cannot be told apart afterward.
        let complete = |counts: usize, readings: usize| counts > 0 && counts == readings;
        let (all, of_echoes) = (
            complete(kept.intensities.len(), kept.ranges.len()),
            complete(kept.echo_intensities.len(), kept.echoes.len()),
        );
        Stretch {
            ranges: kept.ranges,
            echoes: (!kept.echoes.is_empty()).then_some(kept.echoes),
            intensities: all.then_some(kept.intensities),
            echo_intensities: of_echoes.then_some(kept.echo_intensities),
            ..stretch
        }
    }
}
