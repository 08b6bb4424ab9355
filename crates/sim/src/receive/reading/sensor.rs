//! The scanner with everything resolved that does not depend on its surroundings.

use super::part::Parts;
use crate::build::color;
use crate::error::SimError;
use crate::light::edges::{self, EdgeRays, Place};
use crate::light::footprint::{self, SubRay};
use crate::light::optics::{MAX_BOUNCES, Meeting, RayPath, Setting};
use crate::light::power::{self, Illumination};
use crate::light::view::{BeamView, Lens};
use crate::receive::detect;
use crate::receive::echo::Receiver;
use crate::scene::{BeamShape, Detection, ErrorModel, Errors, Light, Limits, Scene};
use catoptric_cast::Ray;
use catoptric_model::{RangeBias, ScanGeometry};
use nalgebra::Vector3;
use rayon::prelude::*;

/// The scanner with everything resolved that does not depend on its surroundings.
pub struct Sensor {
    pub(super) scan: ScanGeometry,
    pub(super) shape: BeamShape,
    pub(super) sub_rays: Vec<SubRay>,
    /// Number of sub-rays of a beam that an edge divides, if it is treated differently.
    edge_rays: Option<usize>,
    pub(super) light: Light,
    pub(super) lens: Lens,
    /// Share of the light that is left after a number of reflections by silver.
    pub(super) mirrors: [f64; MAX_BOUNCES + 1],
    pub(super) limits: Limits,
    pub(super) detection: Detection,
    pub(super) receiver: Receiver,
    pub(super) reference_walk: f64,
    pub(super) bias: RangeBias,
    pub(super) errors: Errors,
}

/// A beam in a setting, and the receiver as it sees the beam.
#[derive(Clone, Copy)]
pub(super) struct BeamIn<'a> {
    pub(super) setting: &'a Setting<'a>,
    beam: usize,
    /// `None` if every spot is seen by all of the lens.
    view: Option<BeamView>,
}

impl BeamIn<'_> {
    /// Share of the lens that sees a sub-ray's spot at a range.
    #[inline]
    pub(super) fn overlap(&self, sub_ray: &SubRay, range: f64) -> f64 {
        self.view
            .as_ref()
            .map_or(1.0, |view| view.overlap(sub_ray, range))
    }
}

impl Sensor {
    /// Resolves a scene's scanner.
    ///
    /// # Errors
    /// [`SimError::UnknownColor`], which cannot happen: the walk is relative to the built-in white.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let pulse_sd = detect::pulse_sd(scene.detection.pulse_fwhm_ns);
        let face_on = |reflectivity: f64, range: f64| {
            let on = Illumination {
                reflectivity,
                cos_incidence: 1.0,
                share: 1.0,
                range,
                mirrors: 1.0,
                seen: 1.0,
            };
            power::received(&scene.light, &on)
        };
        let threshold = face_on(
            scene.detection.threshold_reflectivity,
            scene.detection.threshold_range_m,
        );
        let white = color::paint(scene, "white")?.reflectivity;
        let reference = face_on(white, scene.detection.reference_range_m);
        let receiver = Receiver {
            detector: scene.detection.detector,
            fraction: scene.detection.fraction,
            sd: pulse_sd,
            threshold,
            saturation: if scene.detection.saturation_over_threshold > 0.0 {
                scene.detection.saturation_over_threshold * threshold
            } else {
                f64::INFINITY
            },
        };
        let biased = matches!(scene.errors.model, ErrorModel::Empirical | ErrorModel::Both);
        Ok(Self {
            scan: scene.scanner.scan()?,
            shape: scene.scanner.beam_shape(),
            sub_rays: footprint::sub_rays(scene.scanner.sub_rays as usize),
            edge_rays: scene.scanner.edge_rays(),
            light: scene.light.clone(),
            lens: Lens::of(&scene.light),
            mirrors: std::array::from_fn(|count| {
                libm::pow(scene.superstructure.mirror.reflected(), count as f64)
            }),
            limits: scene.scanner.limits(),
            detection: scene.detection.clone(),
            receiver,
            reference_walk: receiver.lead(reference),
            bias: if biased {
                RangeBias {
                    distance: scene.errors.distance.clone(),
                    angle: scene.errors.angle.clone(),
                    color: scene.errors.color.clone(),
                }
            } else {
                RangeBias::default()
            },
            errors: scene.errors.clone(),
        })
    }

    /// How it scans.
    pub fn scan(&self) -> &ScanGeometry {
        &self.scan
    }

    /// The biases that act.
    pub fn bias(&self) -> &RangeBias {
        &self.bias
    }

    /// Number of sub-rays of a beam that no edge divides.
    pub fn sub_rays(&self) -> usize {
        self.sub_rays.len()
    }

    /// Shape of a beam.
    pub fn shape(&self) -> &BeamShape {
        &self.shape
    }

    /// The sub-rays of a beam that no edge divides.
    pub fn sub_ray_list(&self) -> &[SubRay] {
        &self.sub_rays
    }

    /// The sub-rays of a beam in a setting: those of its own if edges of the structure [divide](Sensor::edge_rays) it.
    pub fn sub_rays_in<'a>(&'a self, setting: &'a Setting<'_>, beam: usize) -> &'a [SubRay] {
        let divided = setting.edge_rays().and_then(|lists| lists.of(beam));
        divided.unwrap_or(&self.sub_rays)
    }

    /// The paths of a beam's sub-rays, in the order in which they are cast.
    pub fn paths<'a>(
        &'a self,
        setting: &'a Setting<'_>,
        beam: usize,
    ) -> impl Iterator<Item = (&'a SubRay, RayPath)> {
        let sub_rays = self.sub_rays_in(setting, beam);
        let rays: Vec<Ray> = self.rays(beam, sub_rays).collect();
        sub_rays.iter().zip(setting.trace_beam(&rays))
    }

    /// Some sub-rays of a beam as they leave the scanner, in the order in which they are cast.
    pub fn rays<'a>(&'a self, beam: usize, sub_rays: &'a [SubRay]) -> impl Iterator<Item = Ray> + 'a {
        let azimuth = self.scan.azimuth(beam);
        sub_rays
            .iter()
            .map(move |s| footprint::ray(&self.shape, azimuth, s))
    }

    /// The sub-rays of all beams that edges of the structure divide; `None` if the scene does not treat them differently.
    /// `bare` is the structure alone.
    pub fn edge_rays(&self, bare: &Setting<'_>) -> Option<EdgeRays> {
        let count = self.edge_rays?;
        let of_beam = |beam| {
            let seeking = self.seeking_rays(beam);
            let routes = bare.routes(&seeking);
            let is_divided = routes.windows(2).any(|pair| pair[0] != pair[1]);
            is_divided.then(|| self.divided(bare, beam, count))
        };
        let lists: Vec<_> = (0..self.scan.beams()).into_par_iter().map(of_beam).collect();
        Some(lists.into_iter().collect())
    }

    /// The rays that show whether an edge divides a beam: its sub-rays, then, if the scene treats divided beams
    /// differently, others around them where the beam ends.
    pub fn seeking_rays(&self, beam: usize) -> Vec<Ray> {
        let around = edges::around().filter(|_| self.edge_rays.is_some());
        let around = around.map(|place| self.ray_from(beam, &place));
        self.rays(beam, &self.sub_rays).chain(around).collect()
    }

    /// The light of a beam that edges of the structure divide: about as many sub-rays as wanted, and one for each path at
    /// least.
    pub fn divided(&self, bare: &Setting<'_>, beam: usize, count: usize) -> Vec<SubRay> {
        edges::divided(count, |places| {
            let rays: Vec<Ray> = places.iter().map(|place| self.ray_from(beam, place)).collect();
            bare.routes(&rays)
        })
    }

    fn ray_from(&self, beam: usize, [wide, narrow]: &Place) -> Ray {
        let sub_ray = SubRay {
            wide: *wide,
            narrow: *narrow,
            weight: 0.0,
        };
        footprint::ray(&self.shape, self.scan.azimuth(beam), &sub_ray)
    }

    /// A beam's chief ray as it leaves the scanner.
    pub fn chief_ray(&self, beam: usize) -> Ray {
        let chief = SubRay {
            wide: 0.0,
            narrow: 0.0,
            weight: 1.0,
        };
        footprint::ray(&self.shape, self.scan.azimuth(beam), &chief)
    }

    /// The path of a beam's chief ray.
    pub fn chief_path(&self, setting: &Setting<'_>, beam: usize) -> RayPath {
        setting.trace(&self.chief_ray(beam))
    }

    /// A beam in a setting.
    pub(super) fn beam_in<'a>(&self, setting: &'a Setting<'a>, beam: usize) -> BeamIn<'a> {
        BeamIn {
            setting,
            beam,
            view: self.lens.seen_by(&self.shape, self.scan.azimuth(beam)),
        }
    }

    /// Along the long axis of a beam's ellipse.
    pub(super) fn long_axis(&self, beam: usize) -> Vector3<f64> {
        footprint::axes(&self.shape, self.scan.azimuth(beam))[0]
    }

    /// Share of a ray's light that the mirrors on its path reflect, as an amplitude: its square is the share of
    /// the round trip.
    pub fn reflected(&self, setting: &Setting<'_>, beam: usize, ray: &Ray, path: &RayPath) -> f64 {
        self.passed(&self.beam_in(setting, beam), ray, path.meetings(), path.silvered)
    }

    /// The same for the mirrors that are met, some of which reflect by their silver.
    pub(super) fn passed(
        &self,
        within: &BeamIn<'_>,
        ray: &Ray,
        meetings: impl Iterator<Item = Meeting>,
        silvered: usize,
    ) -> f64 {
        match within.setting.finishes() {
            Some(finishes) => {
                let hops = meetings.map(|m| m.hop());
                finishes.passed(&ray.direction, &self.long_axis(within.beam), hops)
            }
            None => self.mirrors[silvered],
        }
    }

    /// Counts only that part of the lens from which the mirrors show each part of a beam's light.
    pub(super) fn vignette(&self, setting: &Setting<'_>, beam: usize, parts: &mut Parts) {
        if self.lens.vignettes() {
            let chief = self.chief_ray(beam).direction;
            parts.dim(|part| {
                let spot = (Some(part.surface), part.range());
                setting.shown(&self.lens, &chief, part.facets(), spot)
            });
        }
    }

    /// Share of the receiver's lens from which the mirrors on a path show a spot at the longest range.
    pub fn shown(&self, setting: &Setting<'_>, beam: usize, facets: &[usize]) -> f64 {
        if !self.lens.vignettes() {
            return 1.0;
        }
        let chief = self.chief_ray(beam).direction;
        setting.shown(&self.lens, &chief, facets, (None, self.limits.range_max_m))
    }
}

/// Whether none of a beam's sub-rays is the chief ray.
pub(super) fn lacks_chief(sub_rays: &[SubRay]) -> bool {
    !sub_rays.iter().any(is_chief)
}

/// Whether a sub-ray is the chief ray.
pub(super) fn is_chief(sub_ray: &SubRay) -> bool {
    sub_ray.wide == 0.0 && sub_ray.narrow == 0.0
}
