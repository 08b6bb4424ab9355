//! A stretch in the making: chance is added scan by scan to what the sensor sees.

use super::{Chances, Laboratory, Returns};
use crate::scene::EchoChoice;
use catoptric_model::{Stretch, beam};

/// A stretch being recorded.
pub struct Recorder<'a> {
    laboratory: &'a Laboratory,
    number: usize,
    chances: Chances<'a>,
    ranges: Vec<f64>,
    echoes: Option<Vec<Vec<f64>>>,
}

impl Laboratory {
    /// Begins to record a stretch; scan after scan is added, as many as [`Laboratory::scans_of`] says.
    pub fn recorder(&self, number: usize) -> Recorder<'_> {
        let all_echoes = self.scene.detection.echo == EchoChoice::All;
        Recorder {
            laboratory: self,
            number,
            chances: self.chances(number),
            ranges: Vec::with_capacity(self.planned[number].scans * beam::COUNT),
            echoes: all_echoes.then(Vec::new),
        }
    }
}

impl Recorder<'_> {
    /// Adds a scan from what [`super::Sight::returns`] found for it.
    pub fn add(&mut self, returns: &Returns) {
        let sensor = &self.laboratory.sensor;
        // They never end.
        let chances = self.chances.next().unwrap_or_default();
        let readings = returns.iter().map(Option::as_ref).zip(&chances);
        self.ranges
            .extend(readings.clone().map(|(found, chance)| sensor.read(found, chance)));
        if let Some(echoes) = &mut self.echoes {
            echoes.extend(readings.map(|(found, chance)| sensor.read_all(found, chance)));
        }
    }

    /// The stretch, with what motion capture saw meanwhile.
    pub fn finish(self) -> Stretch {
        let (laboratory, number) = (self.laboratory, self.number);
        let scan_period_s = laboratory.scene.scanner.limits().scan_period_s();
        let start_s = laboratory.start_s(number);
        let duration_s = laboratory.planned[number].scans as f64 * scan_period_s;
        Stretch {
            label: laboratory.label(number),
            start_s,
            scan_period_s,
            beams: beam::COUNT,
            ranges: self.ranges,
            echoes: self.echoes,
            tracks: laboratory.tracks(number, start_s, duration_s),
        }
    }
}
