//! A stretch in the making: chance is added scan by scan to what the sensor sees.

use super::chance::ScanLuck;
use super::{Chances, Laboratory, Returns};
use crate::scene::EchoChoice;
use catoptric_model::{Stretch, beam};

/// A stretch being recorded.
pub struct Recorder<'a> {
    laboratory: &'a Laboratory,
    number: usize,
    chances: Chances<'a>,
    readings: Readings,
}

/// The readings of scans in a row.
pub(super) struct Readings {
    pub(super) ranges: Vec<f64>,
    pub(super) echoes: Option<Vec<Vec<f64>>>,
}

impl Laboratory {
    /// Begins to record a stretch; scan after scan is added, as many as [`Laboratory::scans_of`] says.
    pub fn recorder(&self, number: usize) -> Recorder<'_> {
        Recorder {
            laboratory: self,
            number,
            chances: self.chances(number),
            readings: self.readings(self.planned[number].scans),
        }
    }

    /// Room for the readings of so many scans.
    pub(super) fn readings(&self, scans: usize) -> Readings {
        let all_echoes = self.scene.detection.echo == EchoChoice::All;
        Readings {
            ranges: Vec::with_capacity(scans * beam::COUNT),
            echoes: all_echoes.then(Vec::new),
        }
    }
}

impl Readings {
    /// Adds a scan.
    pub(super) fn add(&mut self, laboratory: &Laboratory, returns: &Returns, luck: &ScanLuck) {
        let sensor = &laboratory.sensor;
        let beams = returns.iter().map(Option::as_ref).enumerate();
        match &mut self.echoes {
            None => self
                .ranges
                .extend(beams.map(|(beam, found)| sensor.read(found, &luck.of(beam)))),
            Some(echoes) => {
                for (beam, found) in beams {
                    let chance = luck.of(beam);
                    self.ranges.push(sensor.read(found, &chance));
                    echoes.push(sensor.read_all(found, &chance));
                }
            }
        }
    }
}

impl Recorder<'_> {
    /// Adds a scan from what [`super::Sight::returns`] found for it.
    pub fn add(&mut self, returns: &Returns) {
        let luck = self.chances.next_scan(Some(returns));
        self.readings.add(self.laboratory, returns, luck);
    }

    /// The stretch, with what motion capture saw meanwhile.
    pub fn finish(self) -> Stretch {
        let frames = 0..self.laboratory.frames_of(self.number);
        self.laboratory.stretch_of(self.number, self.readings, frames)
    }
}

impl Laboratory {
    /// Readings with frames and all that is noted of the stretch.
    pub(super) fn stretch_of(
        &self,
        number: usize,
        readings: Readings,
        frames: std::ops::Range<u64>,
    ) -> Stretch {
        Stretch {
            label: self.label(number),
            start_s: self.start_s(number),
            scan_period_s: self.scene.scanner.limits().scan_period_s(),
            beams: beam::COUNT,
            ranges: readings.ranges,
            echoes: readings.echoes,
            tracks: self.tracks(number, frames),
        }
    }
}
