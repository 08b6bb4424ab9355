//! Which echoes a beam's light makes, and what the detector reads in each of them.

use super::Sensor;
use super::part::{Part, Parts};
use crate::echo::Echo;
use crate::phase;
use crate::scene::{Detector, EchoChoice, Principle};

/// Echoes this many σ of the receiver's noise below the threshold are never detected: the chance is below 3e-7.
const FAINTEST: f64 = 5.0;

/// An echo as it is read: the part that dominates it, and what the detector makes of it.
pub(super) struct Seen<'a> {
    pub(super) part: &'a Part,
    pub(super) mixed: f64,
    pub(super) detection: f64,
    pub(super) probability: f64,
}

impl Sensor {
    /// Whether the first leading edge is all that counts: it is found faster than all echoes are.
    pub(super) fn takes_one_edge(&self) -> bool {
        let d = &self.detection;
        d.principle == Principle::Pulsed
            && d.detector == Detector::LeadingEdge
            && d.echo == EchoChoice::First
            && d.noise_over_threshold == 0.0
    }

    /// Least height at which an echo has a chance of being detected, in watts.
    fn faintest(&self) -> f64 {
        let share = 1.0 - FAINTEST * self.detection.noise_over_threshold;
        (self.receiver.threshold * share).max(f64::MIN_POSITIVE)
    }

    /// Chance that an echo of a height is detected: Φ((A − V)/σ).
    fn probability(&self, height: f64) -> f64 {
        let noise = self.detection.noise_over_threshold * self.receiver.threshold;
        if noise > 0.0 {
            0.5 * libm::erfc((self.receiver.threshold - height) / (noise * std::f64::consts::SQRT_2))
        } else {
            1.0
        }
    }

    /// The echoes of pulsed light in the order of `detection.echo`.
    pub(super) fn receive_pulses<'a>(&self, parts: &'a [Part], physical: bool) -> Vec<Seen<'a>> {
        let all = Parts::pulses(parts);
        let mut echoes = self.receiver.echoes(&all, self.faintest());
        match self.detection.echo {
            EchoChoice::First | EchoChoice::All => {}
            EchoChoice::Strongest => echoes.sort_by(|a, b| b.peak.total_cmp(&a.peak)),
            EchoChoice::Last => echoes.reverse(),
        }
        let read = |echo: &Echo| {
            if physical {
                echo.place + self.reference_walk
            } else {
                echo.compensated
            }
        };
        let seen = |echo: &Echo| {
            let inside = |p: &&Part| p.power > 0.0 && (echo.start..=echo.end).contains(&p.mean.range);
            let part = parts
                .iter()
                .filter(inside)
                .max_by(|a, b| a.power.total_cmp(&b.power))
                .or_else(|| nearest(parts, echo.compensated))?;
            let geometric = part.place().range;
            // A surface too dim to be seen without the others stands for its own range.
            let alone = self.receiver.echoes(&part.pulses, self.faintest());
            let alone = alone.iter().max_by(|a, b| a.peak.total_cmp(&b.peak));
            let alone = alone.map_or(geometric, &read);
            Some(Seen {
                part,
                mixed: read(echo) - alone,
                detection: if physical { alone - geometric } else { 0.0 },
                probability: self.probability(echo.peak),
            })
        };
        echoes.iter().filter_map(seen).collect()
    }

    /// The one range of modulated light.
    pub(super) fn receive_phase<'a>(&self, parts: &'a [Part], physical: bool) -> Vec<Seen<'a>> {
        let ambiguity = phase::ambiguity(self.detection.modulation_hz);
        let all = Parts::pulses(parts);
        let strongest = parts.iter().max_by(|a, b| a.power.total_cmp(&b.power));
        let Some((part, whole)) = strongest.zip(phase::sum(&all, ambiguity)) else {
            return Vec::new();
        };
        if whole.amplitude < self.faintest() {
            return Vec::new();
        }
        let geometric = part.place().range;
        let alone = phase::sum(&part.pulses, ambiguity).map_or(geometric, |p| p.range);
        let base = if physical {
            alone
        } else {
            phase::fold(geometric, ambiguity)
        };
        let range = phase::fold(base + phase::wrap(whole.range - alone, ambiguity), ambiguity);
        vec![Seen {
            part,
            mixed: range - base,
            detection: base - geometric,
            probability: self.probability(whole.amplitude),
        }]
    }
}

/// The part whose light is nearest to a range.
fn nearest(parts: &[Part], range: f64) -> Option<&Part> {
    let away = |p: &&Part| (p.mean.range - range).abs();
    parts
        .iter()
        .filter(|p| p.power > 0.0)
        .min_by(|a, b| away(a).total_cmp(&away(b)))
}
