//! Records a stretch excerpt by excerpt, so that it is never in memory as a whole.
//!
//! Excerpts are drawn and recorded on any thread and in any order. Only correlated noise extends over a whole stretch:
//! its innovations are drawn with each excerpt, and the excerpts of a stretch are linked in order between drawing and
//! recording, which costs one multiplication and one addition per reading.

use super::effects::{EffectSource, Memory, ScanEffects};
use super::recorder::{Digest, Readings};
use super::setup::Laboratory;
use super::sight::Returns;
use crate::noise::Columns;
use crate::receive::reading::RandomEffects;
use catoptric_model::dataset::nanoseconds;
use catoptric_model::{Excerpt, Pose};
use std::ops::Range;

/// Some scans of a stretch, with their correlated noise.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawn {
    number: usize,
    scans: Range<usize>,
    /// Innovations, or states once they are linked, scan by scan; empty without correlated noise.
    states: Vec<Vec<f64>>,
}

/// Some scans of a stretch while they are being recorded.
pub struct ExcerptRecorder<'a> {
    laboratory: &'a Laboratory,
    drawn: &'a Drawn,
    source: EffectSource<'a>,
    readings: Readings,
    digest: Digest,
    scan_effects: ScanEffects,
    /// The next scan to add.
    next: usize,
}

impl Drawn {
    /// Number of the stretch.
    pub fn number(&self) -> usize {
        self.number
    }

    /// The range of its scans within the stretch.
    pub fn scans(&self) -> Range<usize> {
        self.scans.clone()
    }

    fn states(&self, scan: usize) -> &[f64] {
        &self.states[scan - self.scans.start]
    }
}

impl ExcerptRecorder<'_> {
    /// Adds the next scan, given the returns of every beam, and returns its readings, in meters. `changed` says that
    /// the returns may differ from those of the previous scan.
    pub fn add(&mut self, returns: &Returns, changed: bool) -> &[f64] {
        if changed || self.next == self.drawn.scans.start {
            self.digest.take(returns, self.readings.echoes.is_some());
        }
        let states = self.drawn.states(self.next);
        let asked = Some(self.digest.at_random());
        self.source.draw(self.next, states, asked, &mut self.scan_effects);
        let known = self.readings.ranges.len();
        self.readings
            .add(self.laboratory, returns, &self.digest, &self.scan_effects);
        self.next += 1;
        &self.readings.ranges[known..]
    }

    /// The excerpt; `first_seen` is that of the stretch.
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
        let source = self.effect_source(number);
        let mut columns = Columns::default();
        let states = scans
            .clone()
            .map(|scan| {
                let mut innovations = Vec::new();
                source.innovations(scan, &mut columns, &mut innovations);
                innovations
            })
            .collect();
        Drawn {
            number,
            scans,
            states,
        }
    }

    /// Carries the state of correlated noise through scans. Earlier scans must have been linked with the same memory;
    /// before the first scan of a stretch its content is ignored.
    pub fn link(&self, drawn: &mut Drawn, memory: &mut Memory) {
        let source = self.effect_source(drawn.number);
        for (scan, states) in drawn.scans.clone().zip(&mut drawn.states) {
            source.remember(scan, memory, states);
        }
    }

    /// Starts recording linked scans, all of which are to be added in order.
    pub fn excerpt_recorder<'a>(&'a self, drawn: &'a Drawn) -> ExcerptRecorder<'a> {
        ExcerptRecorder {
            laboratory: self,
            drawn,
            source: self.effect_source(drawn.number),
            readings: self.readings(drawn.scans.len()),
            digest: Digest::default(),
            scan_effects: ScanEffects::default(),
            next: drawn.scans.start,
        }
    }

    /// Random effects of one of the linked scans, one per beam.
    pub fn scan_effects(&self, drawn: &Drawn, scan: usize) -> Vec<RandomEffects> {
        let mut scan_effects = ScanEffects::default();
        self.effect_source(drawn.number)
            .draw(scan, drawn.states(scan), None, &mut scan_effects);
        (0..self.sensor.scan().beams())
            .map(|beam| scan_effects.of(beam))
            .collect()
    }

    /// Time and pose at which each body of a stretch is solved for the first time.
    pub fn first_seen(&self, number: usize) -> Vec<Option<(f64, Pose)>> {
        let all = self.frames_of(number);
        let mut seen: Vec<Option<(f64, Pose)>> = Vec::new();
        // The first frame nearly always suffices.
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

    /// Number of motion-capture frames of a stretch before one of its scans begins; for the scan after the last, all of
    /// them.
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
        // One less than the quotient, which rounding may have changed.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let mut frames = ((elapsed_s * rate).floor() as u64).saturating_sub(1);
        while frames < all && nanoseconds(start_s + frames as f64 / rate) < begins {
            frames += 1;
        }
        frames.min(all)
    }
}
