//! The sub-rays of a beam one by one: the path of each, where it ends, and the light that it returns.
//!
//! The beam's echo consists of the same light: every entry with a power is one of its pulses.

use super::part::Parts;
use super::sensor::{BeamIn, Sensor};
use crate::light::footprint::{self, SubRay};
use crate::light::optics::{End, Meeting, RayPath, Setting};
use crate::light::power::{self, Illumination};
use catoptric_cast::Ray;
use nalgebra::Point3;

/// Which part of a sub-ray's light took a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Light {
    /// What mirrors reflect.
    Beam,
    /// What the front of a mirror's glass reflects.
    Ghost,
    /// What a mirror itself scatters.
    Mirror,
}

/// How a path ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SubRayStop {
    /// On a surface.
    Hit {
        /// Index of the surface in [`Setting::names`].
        surface: usize,
        /// Where, in the sensor frame, in meters.
        point: Point3<f64>,
        /// Cosine of the incidence, from 0 to 1.
        cos_incidence: f64,
        /// Power received from there, in watts.
        power: f64,
    },
    /// In the open.
    Escaped,
    /// Between mirrors after the last bounce that is allowed, or in the rim of a mirror's glass.
    Trapped,
}

/// One path of a sub-ray's light.
#[derive(Debug, Clone, PartialEq)]
pub struct SubRayEnd {
    /// Number of the sub-ray in the beam.
    pub number: usize,
    /// Its position in the ellipse and its share of the beam's energy; the shares of [`Light::Beam`] sum to one.
    pub sub_ray: SubRay,
    /// Which part of the light took the path.
    pub light: Light,
    /// Indices of the mirrors on the path.
    pub facets: Vec<usize>,
    /// Optical path length to the end, in meters; to the last mirror if there is no end.
    pub path: f64,
    /// How it ends.
    pub stop: SubRayStop,
}

/// Light that reaches a surface.
pub(super) struct Arrival {
    pub(super) surface: usize,
    /// Number of mirrors on the path before it.
    pub(super) bounces: usize,
    pub(super) on: Illumination,
    /// Share of the sub-ray's energy that is left.
    pub(super) gain: f64,
}

impl Sensor {
    /// Every path of every sub-ray of a beam in a setting, in the order in which the sub-rays are cast.
    ///
    /// Each sub-ray has one path of [`Light::Beam`]; its ghosts follow, then what the mirrors on its path scatter.
    pub fn sub_ray_ends(&self, setting: &Setting<'_>, beam: usize) -> Vec<SubRayEnd> {
        let sub_rays = self.sub_rays_in(setting, beam);
        let mut ends = Vec::with_capacity(sub_rays.len());
        let azimuth = self.scan.azimuth(beam);
        let within = self.beam_in(setting, beam);
        // What the mirrors hide from the lens is the same for all sub-rays of a part.
        let mut parts = Parts::default();
        if self.lens.vignettes() {
            self.illuminate(setting, beam, &mut parts);
        }
        let power = |arrival: &Arrival, facets: &[usize]| {
            power::received(&self.light, &arrival.on) * parts.shown(arrival.surface, facets)
        };
        for (number, sub_ray) in sub_rays.iter().enumerate() {
            let ray = footprint::ray(&self.shape, azimuth, sub_ray);
            let path = setting.trace(&ray);
            let end = |light, path: &RayPath| SubRayEnd {
                number,
                sub_ray: *sub_ray,
                light,
                facets: path.facets().to_vec(),
                path: path.length,
                stop: self.stop(&within, (sub_ray, &ray), path, power),
            };
            ends.push(end(Light::Beam, &path));
            ends.extend(setting.ghosts(&ray, &path).map(|ghost| end(Light::Ghost, &ghost)));
            for arrival in self.on_mirrors(&within, (sub_ray, &ray), path.meetings()) {
                ends.push(SubRayEnd {
                    number,
                    sub_ray: *sub_ray,
                    light: Light::Mirror,
                    facets: path.facets()[..arrival.bounces].to_vec(),
                    path: arrival.on.range,
                    stop: SubRayStop::Hit {
                        surface: arrival.surface,
                        point: path.points()[arrival.bounces],
                        cos_incidence: arrival.on.cos_incidence,
                        power: power(&arrival, &path.facets()[..arrival.bounces]),
                    },
                });
            }
        }
        ends
    }

    fn stop(
        &self,
        within: &BeamIn<'_>,
        sub_ray: (&SubRay, &Ray),
        path: &RayPath,
        power: impl Fn(&Arrival, &[usize]) -> f64,
    ) -> SubRayStop {
        match (path.end, self.at_end(within, sub_ray, path)) {
            (End::Hit(hit), Some(arrival)) => SubRayStop::Hit {
                surface: hit.surface,
                point: hit.point,
                cos_incidence: arrival.on.cos_incidence,
                power: power(&arrival, path.facets()),
            },
            (End::Trapped, _) => SubRayStop::Trapped,
            (End::Escaped | End::Hit(_), _) => SubRayStop::Escaped,
        }
    }

    /// The light that a sub-ray leaves where its path ends; `None` if it does not end on a surface.
    pub(super) fn at_end(
        &self,
        within: &BeamIn<'_>,
        (sub_ray, ray): (&SubRay, &Ray),
        path: &RayPath,
    ) -> Option<Arrival> {
        let End::Hit(hit) = path.end else { return None };
        let spread = within.setting.spread_along(ray, path);
        let overlap = within.overlap(sub_ray, path.length);
        Some(Arrival {
            surface: hit.surface,
            bounces: path.facets().len(),
            on: Illumination {
                reflectivity: within.setting.paint(hit.surface).reflectivity,
                cos_incidence: hit.cos_incidence(),
                share: sub_ray.weight,
                range: path.length,
                mirrors: self.passed(within, ray, path.meetings(), path.silvered) * path.gain,
                seen: spread.map_or(overlap, |s| overlap * s.gain(path.length, self.lens.area())),
            },
            gain: path.gain,
        })
    }

    /// The light that the mirrors on a sub-ray's path scatter themselves.
    pub(super) fn on_mirrors(
        &self,
        within: &BeamIn<'_>,
        (sub_ray, ray): (&SubRay, &Ray),
        meetings: impl Iterator<Item = Meeting> + Clone,
    ) -> impl Iterator<Item = Arrival> {
        let reflectivity = within.setting.diffuse_reflectivity();
        let all = meetings.clone();
        let meetings = meetings.enumerate().filter(move |_| reflectivity > 0.0);
        meetings.map(move |(bounces, meeting)| Arrival {
            surface: meeting.surface,
            bounces,
            on: Illumination {
                reflectivity,
                cos_incidence: meeting.cos_incidence.max(0.0),
                share: sub_ray.weight,
                range: meeting.length,
                mirrors: self.passed(within, ray, all.clone().take(bounces), meeting.silvered) * meeting.gain,
                seen: within.overlap(sub_ray, meeting.length),
            },
            gain: reflectivity * meeting.gain,
        })
    }
}
