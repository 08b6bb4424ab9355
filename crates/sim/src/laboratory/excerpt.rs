//! A stretch recorded excerpt by excerpt, so that it never is in memory as a whole.
//!
//! Excerpts are drawn and recorded on any thread and in any order. Correlated noise alone runs through a stretch; its
//! innovations are drawn with the excerpt, and between drawing and recording the excerpts of a stretch are linked in
//! order, which is one multiplication and one addition for a reading.

use super::chance::{Luck, Memory, ScanLuck};
use super::recorder::{Digest, Readings};
use super::setup::Laboratory;
use super::sight::Returns;
use crate::noise::Columns;
use crate::receive::reading::Chance;
use catoptric_model::dataset::nanoseconds;
use catoptric_model::{Excerpt, Pose};
use std::ops::Range;

/// Some scans of a stretch with their correlated noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    number: usize,
    scans: Range<usize>,
    /// Innovations, once linked states, scan after scan; none without correlated noise.
    states: Vec<Vec<f64>>,
}

/// Some scans of a stretch being recorded.
pub struct ExcerptRecorder<'a> {
    laboratory: &'a Laboratory,
    drawn: &'a Drawn,
    luck: Luck<'a>,
    readings: Readings,
    digest: Digest,
    scan_luck: ScanLuck,
    /// The scan that is added next.
    next: usize,
}

impl Drawn {
    /// Number of the stretch.
    pub fn number(&self) -> usize {
        self.number
    }

    /// Which of its scans these are.
    pub fn scans(&self) -> Range<usize> {
        self.scans.clone()
    }

    fn states(&self, scan: usize) -> &[f64] {
        &self.states[scan - self.scans.start]
    }
}

impl ExcerptRecorder<'_> {
    /// Adds the next scan from what every beam met; `changed` if that may be something else than for the scan before. Its
    /// readings, in metres.
    pub fn add(&mut self, returns: &Returns, changed: bool) -> &[f64] {
        if changed || self.next == self.drawn.scans.start {
            self.digest.take(returns, self.readings.echoes.is_some());
        }
        let states = self.drawn.states(self.next);
        let asked = Some(self.digest.by_chance());
        self.luck.draw(self.next, states, asked, &mut self.scan_luck);
        let known = self.readings.ranges.len();
        self.readings
            .add(self.laboratory, returns, &self.digest, &self.scan_luck);
        self.next += 1;
        &self.readings.ranges[known..]
    }

    /// The excerpt; `first_seen` is the stretch's.
    pub fn finish(self, first_seen: &[Option<(f64, Pose)>]) -> Excerpt {
        let (laboratory, number, scans) = (self.laboratory, self.drawn.number, self.drawn.scans());
        let before = |scan| laboratory.frames_before(number, scan);
        let frames = before(scans.start)..before(scans.end);
        Excerpt {
            part: laboratory.stretch_of(number, self.readings, frames),
            first_scan: scans.start,
            first_seen: first_seen.to_vec(),
        }
    }
}

impl Laboratory {
    /// Draws the innovations of some scans of a stretch.
    pub fn draw(&self, number: usize, scans: Range<usize>) -> Drawn {
        let luck = self.luck(number);
        let mut columns = Columns::default();
        let states = scans
            .clone()
            .map(|scan| {
                let mut innovations = Vec::new();
                luck.innovations(scan, &mut columns, &mut innovations);
                innovations
            })
            .collect();
        Drawn {
            number,
            scans,
            states,
        }
    }

    /// Carries the memory of correlated noise through scans; those before have been linked with the same memory, which
    /// before the first scan of a stretch may be any.
    pub fn link(&self, drawn: &mut Drawn, memory: &mut Memory) {
        let luck = self.luck(drawn.number);
        for (scan, states) in drawn.scans.clone().zip(&mut drawn.states) {
            luck.remember(scan, memory, states);
        }
    }

    /// Begins to record scans that were linked: all of them are to be added, one after the other.
    pub fn excerpt_recorder<'a>(&'a self, drawn: &'a Drawn) -> ExcerptRecorder<'a> {
        ExcerptRecorder {
            laboratory: self,
            drawn,
            luck: self.luck(drawn.number),
            readings: self.readings(drawn.scans.len()),
            digest: Digest::default(),
            scan_luck: ScanLuck::default(),
            next: drawn.scans.start,
        }
    }

    /// What is by chance in a scan of those that were linked: one for every beam.
    pub fn scan_chances(&self, drawn: &Drawn, scan: usize) -> Vec<Chance> {
        let mut scan_luck = ScanLuck::default();
        self.luck(drawn.number)
            .draw(scan, drawn.states(scan), None, &mut scan_luck);
        (0..self.sensor.scan().beams())
            .map(|beam| scan_luck.of(beam))
            .collect()
    }

    /// When and where each body of a stretch is solved for the first time.
    pub fn first_seen(&self, number: usize) -> Vec<Option<(f64, Pose)>> {
        let all = self.frames_of(number);
        let mut seen: Vec<Option<(f64, Pose)>> = Vec::new();
        // The first frame nearly always tells.
        for frame in 0..all {
            let tracks = self.tracks(number, frame..frame + 1);
            seen.resize(tracks.len(), None);
            for (seen, track) in seen.iter_mut().zip(&tracks) {
                let found = track.frames.first().and_then(|f| Some((f.time_s, f.pose?)));
                *seen = seen.or(found);
            }
            if seen.iter().all(Option::is_some) {
                break;
            }
        }
        seen
    }

    /// Frames of a stretch before one of its scans begins; of the scan after the last, all there are.
    fn frames_before(&self, number: usize, scan: usize) -> u64 {
        let all = self.frames_of(number);
        if scan == 0 {
            return 0;
        }
        if scan == self.planned[number].scans {
            return all;
        }
        let start_s = self.start_s(number);
        let rate = self.scene.mocap.frame_rate_hz;
        let elapsed_s = scan as f64 * self.sensor.scan().scan_period_s();
        let begins = nanoseconds(start_s) + nanoseconds(elapsed_s);
        // One less than the quotient, which rounding may have moved.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let mut frames = ((elapsed_s * rate).floor() as u64).saturating_sub(1);
        while frames < all && nanoseconds(start_s + frames as f64 / rate) < begins {
            frames += 1;
        }
        frames.min(all)
    }
}
