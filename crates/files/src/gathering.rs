//! A stretch in the making: the messages between one label and the next.

use super::bodies::Bodies;
use super::messages::{LabelledMarker, NS_PER_S, Scan};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::frame::Pose;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{PoseLabel, Stretch, Track, TrackedFrame};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// How far a period may be from the scanner's to be taken for it, in seconds: stamps are whole nanoseconds.
const PERIOD_TOLERANCE_S: f64 = 1e-9;

/// A stretch being read; times are nanoseconds.
pub(super) struct Gathering {
    label: PoseLabel,
    label_time: u64,
    first_scan: Option<u64>,
    last_scan: u64,
    scan_time: f64,
    scans: usize,
    ranges: Vec<f64>,
    echoes: Vec<Vec<f64>>,
    poses: BTreeMap<(u64, usize), Pose>,
    markers: BTreeMap<u64, Vec<LabelledMarker>>,
}

impl Gathering {
    /// Begins with a label.
    pub(super) fn new(label: PoseLabel, label_time: u64) -> Self {
        Self {
            label,
            label_time,
            first_scan: None,
            last_scan: label_time,
            scan_time: 0.0,
            scans: 0,
            ranges: Vec::new(),
            echoes: Vec::new(),
            poses: BTreeMap::new(),
            markers: BTreeMap::new(),
        }
    }

    /// Takes a scan in; its beams must be those of the session.
    pub(super) fn scan(&mut self, scan: &Scan, scanner: &ScannerSheet) -> Result<(), String> {
        let beams = scanner.scan.beams();
        if scan.ranges.len() != beams {
            return Err(format!("{} beams, session.toml has {beams}", scan.ranges.len()));
        }
        let (first, step) = (scanner.scan.azimuth(0), scanner.scan.increment());
        let drift = (scan.angle_increment - step).abs() * beams as f64;
        let off = scan.angle_min - first;
        // Azimuths a turn apart are one.
        let off = off - TAU * (off / TAU).round();
        // A quarter of a step tells rounding to 32 bits from another beam.
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
        self.ranges.extend_from_slice(&scan.ranges);
        Ok(())
    }

    /// Takes the echoes of a scan in; its beams must be those of the session.
    pub(super) fn echoes(&mut self, echoes: Vec<Vec<f64>>, scanner: &ScannerSheet) -> Result<(), String> {
        let beams = scanner.scan.beams();
        if echoes.len() != beams {
            return Err(format!("{} beams, session.toml has {beams}", echoes.len()));
        }
        self.echoes.extend(echoes);
        Ok(())
    }

    /// Takes a solved pose of a body in.
    pub(super) fn pose(&mut self, time: u64, body: usize, pose: Pose) {
        self.poses.insert((time, body), pose);
    }

    /// Takes the markers of a frame in.
    pub(super) fn markers(&mut self, time: u64, markers: Vec<LabelledMarker>) {
        self.markers.entry(time).or_default().extend(markers);
    }

    /// Number of the pose.
    pub(super) fn number(&self) -> usize {
        self.label.pose
    }

    /// The stretch, with times counted from the epoch; an error if its scans are not as many as its label says.
    pub(super) fn into_stretch(
        self,
        scanner: &ScannerSheet,
        bodies: &Bodies,
        epoch: u64,
    ) -> Result<Stretch, String> {
        if self.scans != self.label.scans {
            let (pose, expected, found) = (self.label.pose, self.label.scans, self.scans);
            return Err(format!("pose {pose}: {found} scans, its label says {expected}"));
        }
        if !self.echoes.is_empty() && self.echoes.len() != self.ranges.len() {
            let (pose, found) = (self.label.pose, self.echoes.len() / scanner.scan.beams());
            return Err(format!("pose {pose}: echoes of {found} scans of {}", self.scans));
        }
        let start = self.first_scan.unwrap_or(self.label_time);
        Ok(Stretch {
            start_s: seconds_between(epoch, start),
            scan_period_s: self.period(scanner, start),
            beams: scanner.scan.beams(),
            tracks: self.tracks(bodies, epoch),
            ranges: self.ranges,
            echoes: (!self.echoes.is_empty()).then_some(self.echoes),
            label: self.label,
        })
    }

    /// Time from scan to scan: the scanner's where the stamps agree with it to their resolution.
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

    /// The rig, the board of the label and whatever else was seen.
    fn tracks(&self, bodies: &Bodies, epoch: u64) -> Vec<Track> {
        if self.poses.is_empty() && self.markers.is_empty() {
            return Vec::new();
        }
        let mut seen: BTreeMap<(u64, usize), TrackedFrame> = BTreeMap::new();
        let board = self.label.board.as_deref();
        let expected: Vec<_> = [Some(RIG_SUBJECT), board]
            .into_iter()
            .flatten()
            .filter_map(|subject| bodies.position(subject))
            .collect();
        let found = self.poses.keys().map(|(_, body)| *body);
        let marked = self
            .markers
            .values()
            .flatten()
            .filter_map(|m| Some(bodies.find(&m.name)?.0));
        let mut others: Vec<_> = found.chain(marked).filter(|b| !expected.contains(b)).collect();
        others.sort_unstable();
        others.dedup();
        let order: Vec<_> = expected.into_iter().chain(others).collect();

        let frame = |time: u64, markers| TrackedFrame {
            time_s: seconds_between(epoch, time),
            pose: None,
            markers,
        };
        for (time, markers) in &self.markers {
            for body in &order {
                let unseen = vec![None; bodies.all[*body].labels.len()];
                seen.insert((*time, *body), frame(*time, unseen));
            }
            for marker in markers {
                if let Some((body, i)) = bodies.find(&marker.name) {
                    let place = seen.get_mut(&(*time, body)).and_then(|f| f.markers.get_mut(i));
                    if let Some(place) = place {
                        *place = Some(marker.point);
                    }
                }
            }
        }
        for ((time, body), pose) in &self.poses {
            let entry = seen.entry((*time, *body));
            entry.or_insert_with(|| frame(*time, Vec::new())).pose = Some(*pose);
        }
        let of = |body: usize| {
            let frames = seen.iter().filter(move |((_, b), _)| *b == body);
            frames.map(|(_, f)| f.clone()).collect()
        };
        let track = |body: usize| Track {
            subject: bodies.all[body].subject.clone(),
            frames: of(body),
        };
        order.into_iter().map(track).collect()
    }
}

/// Seconds from one time to another, both in nanoseconds.
fn seconds_between(from: u64, to: u64) -> f64 {
    let ns = i128::from(to) - i128::from(from);
    ns as f64 / NS_PER_S as f64
}
