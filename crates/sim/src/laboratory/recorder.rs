//! Records a stretch: random effects are added, scan by scan, to what the sensor sees.

use super::effects::{ScanEffects, StretchEffects};
use super::setup::Laboratory;
use super::sight::Returns;
use crate::scene::EchoChoice;
use catoptric_model::Stretch;
use catoptric_model::range::NO_RETURN;

/// A stretch being recorded.
pub struct Recorder<'a> {
    laboratory: &'a Laboratory,
    number: usize,
    effects: StretchEffects<'a>,
    readings: Readings,
}

/// Readings of consecutive scans.
pub(super) struct Readings {
    pub(super) ranges: Vec<f64>,
    pub(super) echoes: Option<Vec<Vec<f64>>>,
    pub(super) intensities: Option<Vec<f64>>,
    pub(super) echo_intensities: Option<Vec<Vec<f64>>>,
}

impl Laboratory {
    /// Starts to record a stretch, to which [`Laboratory::scans_of`] scans are added one by one.
    pub fn recorder(&self, number: usize) -> Recorder<'_> {
        Recorder {
            laboratory: self,
            number,
            effects: self.effects(number),
            readings: self.readings(self.planned[number].scans),
        }
    }

    /// Space for the readings of a given number of scans.
    pub(super) fn readings(&self, scans: usize) -> Readings {
        let all_echoes = self.scene.detection.echo == EchoChoice::All;
        let counts = self.scene.detection.intensity.is_some();
        Readings {
            ranges: Vec::with_capacity(scans * self.sensor.scan().beams()),
            echoes: all_echoes.then(Vec::new),
            intensities: counts.then(Vec::new),
            echo_intensities: (all_echoes && counts).then(Vec::new),
        }
    }
}

/// What every beam receives, prepared to be read scan after scan.
#[derive(Default)]
pub(super) struct Digest {
    beams: Vec<Reported>,
    /// The beams of [`Reported::AtRandom`].
    at_random: Vec<usize>,
}

/// What a beam reports.
#[derive(Debug, Clone, Copy)]
enum Reported {
    /// No echo.
    Nothing,
    /// One echo, detected whatever is drawn: its range and the standard deviation of its noise, in meters.
    Surely { range: f64, noise_sd: f64 },
    /// One of several echoes, or all, or perhaps none, depending on what is drawn.
    AtRandom,
}

impl Digest {
    /// The digest of a scan; with `all_echoes`, no beam with an echo is [`Reported::Surely`].
    pub(super) fn of(returns: &Returns, all_echoes: bool) -> Self {
        let mut digest = Self::default();
        digest.take(returns, all_echoes);
        digest
    }

    /// Replaces the digest with that of another scan.
    pub(super) fn take(&mut self, returns: &Returns, all_echoes: bool) {
        self.beams.clear();
        self.at_random.clear();
        self.beams.extend(returns.iter().map(|found| match found {
            None => Reported::Nothing,
            Some(found) if found.probability >= 1.0 && !all_echoes => Reported::Surely {
                range: found.range(),
                noise_sd: found.noise_sd,
            },
            Some(_) => Reported::AtRandom,
        }));
        let beams = self.beams.iter().enumerate();
        let at_random = beams.filter(|(_, reported)| matches!(reported, Reported::AtRandom));
        self.at_random.extend(at_random.map(|(beam, _)| beam));
    }

    /// The beams whose detection is random.
    pub(super) fn at_random(&self) -> &[usize] {
        &self.at_random
    }
}

impl Readings {
    /// Adds a scan, given what every beam receives and the digest of it.
    pub(super) fn add(
        &mut self,
        laboratory: &Laboratory,
        seen: &Returns,
        digest: &Digest,
        effects: &ScanEffects,
    ) {
        let sensor = &laboratory.sensor;
        let beams = digest.beams.iter().enumerate();
        let known = self.ranges.len();
        self.ranges.extend(beams.map(|(beam, reported)| match *reported {
            Reported::Nothing => NO_RETURN,
            Reported::Surely { range, noise_sd } => {
                sensor.read_echo(range, noise_sd, &effects.without_detection(beam))
            }
            Reported::AtRandom => sensor.read(seen[beam].as_ref(), &effects.of(beam)),
        }));
        sensor.smooth(&mut self.ranges[known..]);
        if let Some(counts) = &mut self.intensities {
            let ranges = self.ranges[known..].iter();
            let beams = ranges.zip(seen).enumerate();
            counts.extend(
                beams.map(|(beam, (range, found))| {
                    sensor.intensity(*range, found.as_ref(), &effects.of(beam))
                }),
            );
        }
        if let Some(echoes) = &mut self.echoes {
            let known = echoes.len();
            let beams = seen.iter().enumerate();
            echoes.extend(beams.map(|(beam, found)| sensor.read_all(found.as_ref(), &effects.of(beam))));
            if let Some(counts) = &mut self.echo_intensities {
                let beams = echoes[known..].iter().zip(seen).enumerate();
                counts.extend(beams.map(|(beam, (ranges, found))| {
                    sensor.intensities(ranges, found.as_ref(), &effects.of(beam))
                }));
            }
        }
    }
}

impl Recorder<'_> {
    /// Adds a scan, given its [`super::Sight::returns`].
    pub fn add(&mut self, returns: &Returns) {
        let digest = Digest::of(returns, self.readings.echoes.is_some());
        let effects = self.effects.next_scan(Some(digest.at_random()));
        self.readings.add(self.laboratory, returns, &digest, effects);
    }

    /// The stretch, with what motion capture saw during it.
    pub fn finish(self) -> Stretch {
        let frames = 0..self.laboratory.frames_of(self.number);
        self.laboratory.stretch_of(self.number, self.readings, frames)
    }
}

impl Laboratory {
    /// Combines readings with motion-capture frames and the label of the stretch.
    pub(super) fn stretch_of(
        &self,
        number: usize,
        readings: Readings,
        frames: std::ops::Range<u64>,
    ) -> Stretch {
        Stretch {
            label: self.label(number),
            start_s: self.start_s(number),
            scan_period_s: self.sensor.scan().scan_period_s(),
            beams: self.sensor.scan().beams(),
            ranges: readings.ranges,
            echoes: readings.echoes,
            intensities: readings.intensities,
            echo_intensities: readings.echo_intensities,
            tracks: self.tracks(number, frames),
        }
    }
}
