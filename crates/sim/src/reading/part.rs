//! The light of a beam by the surfaces that it reaches and the ways it goes there.

use crate::detect::Pulse;
use crate::optics::{Beyond, MAX_BOUNCES};
use std::borrow::Cow;

/// The sub-rays that went one way to one surface.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) surface: usize,
    facets: [usize; MAX_BOUNCES],
    count: usize,
    pub(super) pulses: Vec<Pulse>,
    pub(super) share: f64,
    pub(super) power: f64,
    /// Where the chief ray meets it.
    pub(super) chief: Option<Place>,
    /// Where its light does on the average.
    pub(super) mean: Place,
}

/// Where light meets a surface.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Place {
    pub(super) range: f64,
    pub(super) cos_incidence: f64,
    /// Cosine of the incidence on each of the facets before.
    pub(super) facets: [f64; MAX_BOUNCES],
}

/// The parts of one beam after another; what one needed in memory the next one uses.
#[derive(Debug, Default)]
pub struct Parts {
    live: Vec<Part>,
    spare: Vec<Part>,
    pub(super) beyond: Beyond,
}

impl Place {
    /// A place with the cosines of the incidence on the facets before it.
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

    /// Adds another with a weight.
    fn add(&mut self, weight: f64, range: f64, cos_incidence: f64, cosines: impl Iterator<Item = f64>) {
        self.range += weight * range;
        self.cos_incidence += weight * cos_incidence;
        for (sum, cos) in self.facets.iter_mut().zip(cosines) {
            *sum += weight * cos;
        }
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
    /// The facets before the surface, in order.
    pub(super) fn facets(&self) -> &[usize] {
        &self.facets[..self.count]
    }

    /// Where the chief ray meets it, or where its light does on the average if that goes elsewhere.
    pub(super) fn place(&self) -> &Place {
        self.chief.as_ref().unwrap_or(&self.mean)
    }

    fn went(&self, surface: usize, facets: &[usize]) -> bool {
        self.surface == surface && self.facets().iter().eq(facets)
    }

    /// Begins anew with nothing in it.
    fn begin(&mut self, surface: usize, facets: &[usize]) {
        self.surface = surface;
        self.facets[..facets.len()].copy_from_slice(facets);
        self.count = facets.len();
        self.pulses.clear();
        (self.share, self.power) = (0.0, 0.0);
        (self.chief, self.mean) = (None, Place::default());
    }
}

impl Parts {
    /// Begins with a beam.
    pub(super) fn begin(&mut self) {
        self.spare.append(&mut self.live);
    }

    /// The parts of the beam.
    pub(super) fn as_slice(&self) -> &[Part] {
        &self.live
    }

    /// The part of a surface and the facets on the way, if any light went there.
    pub(super) fn find(&mut self, surface: usize, facets: &[usize]) -> Option<&mut Part> {
        self.live.iter_mut().find(|p| p.went(surface, facets))
    }

    /// Adds light that reaches a surface at a range under an incidence, after incidences on facets; `share` is that of the
    /// beam's energy.
    pub(super) fn add(
        &mut self,
        (surface, facets): (usize, &[usize]),
        power: f64,
        share: f64,
        (range, cos_incidence): (f64, f64),
        cosines: impl Iterator<Item = f64> + Clone,
        chief: bool,
    ) {
        let known = self.live.iter().position(|p| p.went(surface, facets));
        let index = known.unwrap_or_else(|| {
            let mut part = self.spare.pop().unwrap_or_default();
            part.begin(surface, facets);
            self.live.push(part);
            self.live.len() - 1
        });
        let part = &mut self.live[index];
        part.pulses.push(Pulse { range, power });
        part.share += share;
        part.power += power;
        part.mean.add(power, range, cos_incidence, cosines.clone());
        if chief {
            part.chief = Some(Place::new(range, cos_incidence, cosines));
        }
    }

    /// Ends a beam: sums become means.
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
