//! Which echoes a beam's light produces, and what the detector reads from each of them.

use super::part::{Part, Parts};
use super::returned::{MAX_ECHOES, Return};
use super::sensor::Sensor;
use crate::light::optics::Setting;
use crate::receive::detect;
use crate::receive::echo::Echo;
use crate::receive::phase;
use crate::scene::{Detector, EchoChoice, ErrorModel, Principle};

/// Echoes this many σ of the receiver's noise below the threshold are never detected: the probability is below 3e-7.
const FAINTEST: f64 = 5.0;

/// An echo as it is read: the part that dominates it, and the shifts of its range.
struct Seen<'a> {
    part: &'a Part,
    /// Power of all parts of the echo.
    received: f64,
    mixed: f64,
    detection: f64,
    probability: f64,
}

impl Sensor {
    /// The return that the detector makes of a beam's light.
    pub(super) fn receive(&self, setting: &Setting<'_>, parts: &[Part]) -> Option<Return> {
        let physical = matches!(self.errors.model, ErrorModel::Physical | ErrorModel::Both);
        if !self.takes_one_edge() {
            let seen = match self.detection.principle {
                Principle::Pulsed => self.receive_pulses(parts, physical),
                Principle::Phase => self.receive_phase(parts, physical),
            };
            let mut found = seen.iter().filter_map(|seen| self.returned(setting, seen));
            let mut first = found.next()?;
            // Echoes that are certainly detected and reported alone never need a substitute.
            if self.detection.echo == EchoChoice::All || self.detection.noise_over_threshold > 0.0 {
                first.others = found.take(MAX_ECHOES - 1).collect();
            }
            return Some(first);
        }
        let (part, received, mixed, detection) = match parts {
            [] => return None,
            // A single surface reads its own range, whatever point of its edge is detected.
            [only] if !physical => {
                if !detect::is_seen(&only.pulses, self.receiver.sd, self.receiver.threshold) {
                    return None;
                }
                (only, only.power, 0.0, 0.0)
            }
            _ => self.detect(parts, physical)?,
        };
        self.returned(
            setting,
            &Seen {
                part,
                received,
                mixed,
                detection,
                probability: 1.0,
            },
        )
    }

    /// An echo with everything that is known about its surface; `None` beyond the longest range.
    fn returned(&self, setting: &Setting<'_>, seen: &Seen<'_>) -> Option<Return> {
        let part = seen.part;
        let place = part.place();
        let (geometric, cos_incidence) = (place.range, place.cos_incidence);
        let paint = setting.paint(part.surface);
        let found = Return {
            role: setting.role(part.surface),
            facets: part.facets().to_vec(),
            geometric,
            cos_incidence,
            facet_cos_incidence: place.facets[..part.facets().len()].to_vec(),
            power: part.power,
            share: part.share,
            received: seen.received,
            mixed: seen.mixed,
            detection: seen.detection,
            bias: self.bias.terms(geometric, cos_incidence, &paint.name),
            noise_sd: paint.noise.sd(geometric)
                * self
                    .errors
                    .incidence
                    .as_ref()
                    .map_or(1.0, |table| table.factor(cos_incidence)),
            probability: seen.probability,
            others: Vec::new(),
        };
        (found.range() <= self.limits.range_max_m).then_some(found)
    }

    /// The part that dominates the first echo, the power of all its parts, the shift that the others cause, and the shift
    /// by the detector itself.
    ///
    /// If the error model excludes the detector, both edges are corrected for their walk, so that a single surface
    /// reads its own range and only the mixture shifts it.
    fn detect<'a>(&self, parts: &'a [Part], physical: bool) -> Option<(&'a Part, f64, f64, f64)> {
        let all = Parts::pulses(parts);
        let edge = detect::leading_edge(&all, self.receiver.sd, self.receiver.threshold)?;
        let first = edge.compensated(self.receiver.sd, self.receiver.threshold);
        let pulse_length = detect::pulse_length(self.receiver.sd);
        let in_echo = |p: &&Part| p.power > 0.0 && p.mean.range <= first + pulse_length;
        let part = parts
            .iter()
            .filter(in_echo)
            .max_by(|a, b| a.power.total_cmp(&b.power))?;
        let geometric = part.place().range;
        let read = |edge: &detect::Edge| {
            let compensated = || edge.compensated(self.receiver.sd, self.receiver.threshold);
            self.walked(physical, edge.crossing, compensated)
        };
        let alone = match parts {
            [_] => read(&edge),
            // A surface too dim to be seen without the others is represented by its own range.
            _ => detect::leading_edge(&part.pulses, self.receiver.sd, self.receiver.threshold)
                .map_or(geometric, |edge| read(&edge)),
        };
        let detection = if physical { alone - geometric } else { 0.0 };
        let received = parts.iter().filter(in_echo).map(|p| p.power).sum();
        Some((part, received, read(&edge) - alone, detection))
    }

    /// Where the device takes an echo to be, from where its detector triggers and from where it would without walk.
    fn walked(&self, physical: bool, triggered: f64, compensated: impl FnOnce() -> f64) -> f64 {
        let share = self.detection.walk_compensated;
        match physical {
            false => compensated(),
            true if share == 0.0 => triggered + self.reference_walk,
            true => share * compensated() + (1.0 - share) * (triggered + self.reference_walk),
        }
    }

    /// Whether only the first leading edge counts, which is found faster than all echoes are.
    fn takes_one_edge(&self) -> bool {
        let d = &self.detection;
        d.principle == Principle::Pulsed
            && d.detector == Detector::LeadingEdge
            && d.echo == EchoChoice::First
            && d.noise_over_threshold == 0.0
    }

    /// Smallest height at which an echo may be detected, in watts.
    fn faintest(&self) -> f64 {
        let share = 1.0 - FAINTEST * self.detection.noise_over_threshold;
        (self.receiver.threshold * share).max(f64::MIN_POSITIVE)
    }

    /// Probability that an echo of a given height is detected: Φ((A − V)/σ).
    fn probability(&self, height: f64) -> f64 {
        let noise = self.detection.noise_over_threshold * self.receiver.threshold;
        if noise > 0.0 {
            0.5 * libm::erfc((self.receiver.threshold - height) / (noise * std::f64::consts::SQRT_2))
        } else {
            1.0
        }
    }

    /// The echoes of pulsed light in the order of `detection.echo`.
    fn receive_pulses<'a>(&self, parts: &'a [Part], physical: bool) -> Vec<Seen<'a>> {
        let all = Parts::pulses(parts);
        let mut echoes = self.receiver.echoes(&all, self.faintest());
        match self.detection.echo {
            EchoChoice::First | EchoChoice::All => {}
            EchoChoice::Strongest => echoes.sort_by(|a, b| b.peak.total_cmp(&a.peak)),
            EchoChoice::Last => echoes.reverse(),
        }
        let read = |echo: &Echo| self.walked(physical, echo.place, || echo.compensated);
        let seen = |echo: &Echo| {
            let inside = |p: &&Part| p.power > 0.0 && (echo.start..=echo.end).contains(&p.mean.range);
            let part = parts
                .iter()
                .filter(inside)
                .max_by(|a, b| a.power.total_cmp(&b.power))
                .or_else(|| nearest(parts, echo.compensated))?;
            let geometric = part.place().range;
            // A surface too dim to be seen without the others is represented by its own range.
            let alone = self.receiver.echoes(&part.pulses, self.faintest());
            let alone = alone.iter().max_by(|a, b| a.peak.total_cmp(&b.peak));
            let alone = alone.map_or(geometric, &read);
            Some(Seen {
                part,
                received: parts
                    .iter()
                    .filter(inside)
                    .map(|p| p.power)
                    .sum::<f64>()
                    .max(part.power),
                mixed: read(echo) - alone,
                detection: if physical { alone - geometric } else { 0.0 },
                probability: self.probability(echo.peak),
            })
        };
        echoes.iter().filter_map(seen).collect()
    }

    /// The single range of modulated light.
    fn receive_phase<'a>(&self, parts: &'a [Part], physical: bool) -> Vec<Seen<'a>> {
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
            received: whole.amplitude,
            mixed: range - base,
            detection: base - geometric,
            probability: self.probability(whole.amplitude),
        }]
    }
}

/// The part whose light is closest to a range.
fn nearest(parts: &[Part], range: f64) -> Option<&Part> {
    let away = |p: &&Part| (p.mean.range - range).abs();
    parts
        .iter()
        .filter(|p| p.power > 0.0)
        .min_by(|a, b| away(a).total_cmp(&away(b)))
}
