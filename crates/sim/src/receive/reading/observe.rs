//! What a beam receives in one setting, and where all of its light goes.

use super::part::{Parts, Place};
use super::returned::Return;
use super::sensor::{BeamIn, Sensor, is_chief, lacks_chief};
use super::sub_ray::Arrival;
use crate::light::footprint::SubRay;
use crate::light::optics::{End, RayPath, Role, Setting};
use crate::light::power;
use catoptric_cast::Ray;

/// A part of a beam's light, as fractions of the whole.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The surface on which it ends; none for light that escapes or is lost between mirrors.
    pub role: Option<Role>,
    /// Facets on the path there.
    pub facets: Vec<usize>,
    /// Share of the beam's energy.
    pub energy: f64,
    /// Power received from it, in watts.
    pub power: f64,
}

impl Sensor {
    /// What a beam receives; `None` if no echo reaches the threshold.
    pub fn observe(&self, setting: &Setting<'_>, beam: usize) -> Option<Return> {
        let mut parts = Parts::default();
        self.illuminate(setting, beam, &mut parts);
        self.receive(setting, parts.as_slice())
    }

    /// Where a beam's energy goes: what arrives along each path at each surface, and what arrives nowhere.
    pub fn shares(&self, setting: &Setting<'_>, beam: usize) -> Vec<Share> {
        let mut parts = Parts::default();
        self.illuminate(setting, beam, &mut parts);
        let mut shares: Vec<Share> = parts
            .as_slice()
            .iter()
            .map(|part| Share {
                role: Some(setting.role(part.surface)),
                facets: part.facets().to_vec(),
                energy: part.share,
                power: part.power,
            })
            .collect();
        for (sub_ray, path) in self.paths(setting, beam) {
            if matches!(path.end, End::Hit(_)) {
                continue;
            }
            let same = |s: &&mut Share| s.role.is_none() && s.facets == path.facets();
            match shares.iter_mut().find(same) {
                Some(share) => share.energy += sub_ray.weight,
                None => shares.push(Share {
                    role: None,
                    facets: path.facets().to_vec(),
                    energy: sub_ray.weight,
                    power: 0.0,
                }),
            }
        }
        shares
    }

    /// The surfaces that a beam's light reaches, each with its pulses.
    pub(super) fn illuminate(&self, setting: &Setting<'_>, beam: usize, parts: &mut Parts) {
        parts.begin();
        let within = self.beam_in(setting, beam);
        let sub_rays = self.sub_rays_in(setting, beam);
        let rays: Vec<Ray> = self.rays(beam, sub_rays).collect();
        let paths = setting.trace_beam(&rays);
        for ((sub_ray, ray), path) in sub_rays.iter().zip(&rays).zip(&paths) {
            self.illuminate_along(&within, sub_ray, ray, path, parts);
        }
        if lacks_chief(sub_rays) {
            Self::add_chief(parts, &self.chief_path(setting, beam));
        }
        self.vignette(setting, beam, parts);
        parts.end();
    }

    /// What one sub-ray's light reaches along its path.
    pub(super) fn illuminate_along(
        &self,
        within: &BeamIn<'_>,
        sub_ray: &SubRay,
        ray: &Ray,
        path: &RayPath,
        parts: &mut Parts,
    ) {
        let chief = is_chief(sub_ray);
        if let Some(arrival) = self.at_end(within, (sub_ray, ray), path) {
            self.add(parts, path, &arrival, chief);
        }
        for ghost in within.setting.ghosts(ray, path) {
            if let Some(arrival) = self.at_end(within, (sub_ray, ray), &ghost) {
                self.add(parts, &ghost, &arrival, false);
            }
        }
        for arrival in self.on_mirrors(within, (sub_ray, ray), path.meetings()) {
            self.add(parts, path, &arrival, chief);
        }
    }

    /// Adds the light that a sub-ray brings to a surface to the part with that surface and those facets.
    fn add(&self, parts: &mut Parts, path: &RayPath, arrival: &Arrival, chief: bool) {
        let (on, facets) = (&arrival.on, &path.facets()[..arrival.bounces]);
        let cosines = path.meetings().take(arrival.bounces).map(|m| m.cos_incidence);
        let place = (on.range, on.cos_incidence);
        let (power, share) = (power::received(&self.light, on), on.share * arrival.gain);
        parts.add((arrival.surface, facets), power, share, place, cosines, chief);
    }

    /// Assigns the chief ray's range to the part that it hits, for beams whose sub-rays do not include the chief ray.
    pub(super) fn add_chief(parts: &mut Parts, path: &RayPath) {
        if let End::Hit(hit) = path.end
            && let Some(part) = parts.find(hit.surface, path.facets())
        {
            let cos_incidence = hit.cos_incidence();
            let cosines = path.meetings().take(part.facets().len()).map(|m| m.cos_incidence);
            part.chief = Some(Place::new(path.length, cos_incidence, cosines));
        }
    }
}
