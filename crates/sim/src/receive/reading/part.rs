//! The light of a beam, by the surfaces that it reaches and the paths that it takes there.

use crate::light::optics::{Beyond, MAX_BOUNCES};
use crate::receive::detect::Pulse;
use std::borrow::Cow;

/// The sub-rays that took one path to one surface.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) surface: usize,
    facets: [usize; MAX_BOUNCES],
    count: usize,
    pub(super) pulses: Vec<Pulse>,
    pub(super) share: f64,
    pub(super) power: f64,
    /// Share of the lens from which mirrors show it.
    pub(super) shown: f64,
    /// Where the chief ray hits it.
    pub(super) chief: Option<Place>,
    /// Where its light hits it on average.
    pub(super) mean: Place,
}

/// Where light hits a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) range: f64,
    pub(super) cos_incidence: f64,
    /// Cosine of the incidence on each of the facets on the path.
    pub(super) facets: [f64; MAX_BOUNCES],
}

/// The parts of one beam after another; the memory of one beam is used for the next.
#[derive(Debug, Default)]
pub struct Parts {
    live: Vec<Part>,
    spare: Vec<Part>,
    pub(super) beyond: Beyond,
}

impl Place {
    /// A place with the cosines of the incidence on the facets on the path.
    pub(super) fn new(range: f64, cos_incidence: f64, cosines: impl Iterator<Item = f64>) -> Self {
        let mut place = Self {
            range,
            cos_incidence,
            ..Self::default()
        };
        for (own, cos) in place.facets.iter_mut().zip(cosines) {
            *own = cos;
        }
        place
    }

    fn divide(&mut self, by: f64, facets: usize) {
        self.range /= by;
        self.cos_incidence /= by;
        for cos in &mut self.facets[..facets] {
            *cos /= by;
        }
    }
}

impl Part {
    /// The facets on the path to the surface, in order.
    pub(super) fn facets(&self) -> &[usize] {
        &self.facets[..self.count]
    }

    /// Where the chief ray hits it, or where its light does on average if the chief ray goes elsewhere.
    pub(super) fn place(&self) -> &Place {
        self.chief.as_ref().unwrap_or(&self.mean)
    }

    fn is_for(&self, surface: usize, facets: &[usize]) -> bool {
        self.surface == surface && self.facets().iter().eq(facets)
    }

    /// Adds pulses, each with its share of the beam's energy and its incidence.
    pub(super) fn add(&mut self, light: impl Iterator<Item = (Pulse, f64, f64)>) {
        let (mut all, mut power, mut mean) = (self.share, self.power, self.mean);
        self.pulses.extend(light.map(|(pulse, share, cos_incidence)| {
            all += share;
            power += pulse.power;
            mean.range += pulse.power * pulse.range;
            mean.cos_incidence += pulse.power * cos_incidence;
            pulse
        }));
        (self.share, self.power, self.mean) = (all, power, mean);
    }

    /// Adds the incidences on the facets on the path for all pulses after the first `known`.
    pub(super) fn add_cosines(
        &mut self,
        known: usize,
        added: impl Iterator<Item = impl Iterator<Item = f64>>,
    ) {
        for (pulse, cosines) in self.pulses[known..].iter().zip(added) {
            for (sum, cos) in self.mean.facets.iter_mut().zip(cosines) {
                *sum += pulse.power * cos;
            }
        }
    }

    /// Mean range of the pulses before the sums become means.
    pub(super) fn range(&self) -> f64 {
        self.mean.range / self.power
    }

    /// Leaves a share of the light.
    fn dim(&mut self, shown: f64) {
        self.shown = shown;
        self.pulses.iter_mut().for_each(|pulse| pulse.power *= shown);
        self.power *= shown;
        self.mean.divide(1.0 / shown.max(f64::MIN_POSITIVE), self.count);
    }

    /// Starts over, without light.
    fn begin(&mut self, surface: usize, facets: &[usize]) {
        self.surface = surface;
        self.facets[..facets.len()].copy_from_slice(facets);
        self.count = facets.len();
        self.pulses.clear();
        (self.share, self.power, self.shown) = (0.0, 0.0, 1.0);
        (self.chief, self.mean) = (None, Place::default());
    }
}

impl Parts {
    /// Starts a beam.
    pub(super) fn begin(&mut self) {
        self.spare.append(&mut self.live);
    }

    /// The parts of the beam.
    pub(super) fn as_slice(&self) -> &[Part] {
        &self.live
    }

    /// Share of the lens from which mirrors show the light on a surface that took a path.
    pub(super) fn shown(&self, surface: usize, facets: &[usize]) -> f64 {
        let part = self.live.iter().find(|p| p.is_for(surface, facets));
        part.map_or(1.0, |part| part.shown)
    }

    /// The part of a surface and the facets on the path to it, if any light took that path.
    pub(super) fn find(&mut self, surface: usize, facets: &[usize]) -> Option<&mut Part> {
        self.live.iter_mut().find(|p| p.is_for(surface, facets))
    }

    /// The part of a surface and the facets on the path to it, created if it is new.
    pub(super) fn of(&mut self, surface: usize, facets: &[usize]) -> &mut Part {
        let known = self.live.iter().position(|p| p.is_for(surface, facets));
        let index = known.unwrap_or_else(|| {
            let mut part = self.spare.pop().unwrap_or_default();
            part.begin(surface, facets);
            self.live.push(part);
            self.live.len() - 1
        });
        &mut self.live[index]
    }

    /// Adds light that reaches a surface at a range and incidence, after incidences on facets; `share` is its share of
    /// the beam's energy.
    pub(super) fn add(
        &mut self,
        (surface, facets): (usize, &[usize]),
        power: f64,
        share: f64,
        (range, cos_incidence): (f64, f64),
        cosines: impl Iterator<Item = f64> + Clone,
        chief: bool,
    ) {
        let part = self.of(surface, facets);
        let known = part.pulses.len();
        part.add(std::iter::once((Pulse { range, power }, share, cos_incidence)));
        part.add_cosines(known, std::iter::once(cosines.clone()));
        if chief {
            part.chief = Some(Place::new(range, cos_incidence, cosines));
        }
    }

    /// Leaves a share of the light of each part.
    pub(super) fn dim(&mut self, shown: impl Fn(&Part) -> f64) {
        for part in self.live.iter_mut().filter(|p| p.power > 0.0) {
            part.dim(shown(part));
        }
    }

    /// Finishes a beam: sums become means.
    pub(super) fn end(&mut self) {
        for part in self.live.iter_mut().filter(|p| p.power > 0.0) {
            part.mean.divide(part.power, part.count);
        }
    }

    /// All pulses, part by part.
    pub(super) fn pulses(parts: &[Part]) -> Cow<'_, [Pulse]> {
        match parts {
            [only] => Cow::Borrowed(&only.pulses),
            _ => parts.iter().flat_map(|p| p.pulses.iter().copied()).collect(),
        }
    }
}
