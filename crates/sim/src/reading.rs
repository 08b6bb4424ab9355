//! One beam against one setting: its sub-rays' ways, the echo they make, and the range read off it.
//!
//! Everything but `report` is free of chance; it is the same for every scan of a stretch.

mod over;
mod part;
mod receive;
mod report;
mod sub_ray;

pub use part::Parts;
pub use report::{Chance, MAX_ECHOES};
pub use sub_ray::{Light as SubRayLight, Stop, SubRayEnd};

use crate::color;
use crate::detect;
use crate::echo::Receiver;
use crate::error::SimError;
use crate::footprint::{self, Ray, SubRay};
use crate::optics::{End, MAX_BOUNCES, Path, Role, Setting};
use crate::power::{self, Illumination};
use crate::scene::{BeamShape, Detection, EchoChoice, ErrorModel, Errors, Light, Limits, Principle, Scene};
use crate::truth::BeamClass;
use catoptric_model::{BiasTerms, RangeBias, beam};
use part::{Part, Place};
use receive::Seen;
use sub_ray::Arrival;

/// The scanner with everything resolved that does not depend on where it looks.
pub struct Sensor {
    shape: BeamShape,
    sub_rays: Vec<SubRay>,
    light: Light,
    /// What is left of light after so many reflections by silver.
    mirrors: [f64; MAX_BOUNCES + 1],
    limits: Limits,
    detection: Detection,
    receiver: Receiver,
    reference_walk: f64,
    bias: RangeBias,
    errors: Errors,
}

/// What a beam brings home, each contribution by itself. The reading is their sum, then drift, noise and rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Surface that dominates the echo.
    pub role: Role,
    /// Facets on the way there.
    pub facets: Vec<usize>,
    /// Path length to it, of the chief ray if that meets it and else the mean over its light, in metres.
    pub geometric: f64,
    /// Cosine of the incidence on it.
    pub cos_incidence: f64,
    /// Cosine of the incidence on each of the facets, as for the surface of the chief ray or the mean.
    pub facet_cos_incidence: Vec<f64>,
    /// Power received from it, in watts.
    pub power: f64,
    /// Share of the beam's energy that falls on it.
    pub share: f64,
    /// Shift of the range because other surfaces are in the same echo, in metres.
    pub mixed: f64,
    /// Shift by pulse and threshold for this surface alone, in metres; 0 unless the error model is physical. Ranging by
    /// phase has the ambiguities that are missing here, whatever the error model.
    pub detection: f64,
    /// The biases of Eqs. 3–5, in metres.
    pub bias: BiasTerms,
    /// Standard deviation of its noise, in metres.
    pub noise_sd: f64,
    /// Chance that the echo is detected: 1 but near a threshold with noise.
    pub probability: f64,
    /// Other echoes of the beam, each without any of its own: what is reported when this one is missed, in the order
    /// of `detection.echo`, and beside it when that is "all".
    pub others: Vec<Return>,
}

impl Return {
    /// The reading without drift, noise and rounding, in metres.
    pub fn range(&self) -> f64 {
        self.geometric + self.mixed + self.detection + self.bias.total()
    }

    /// This echo and the others, in the order in which they are reported.
    pub fn echoes(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.others)
    }
}

/// A part of a beam's light, as fractions of all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Share {
    /// The surface it ends on; none for light that escapes or is lost between mirrors.
    pub role: Option<Role>,
    /// Facets on the way there.
    pub facets: Vec<usize>,
    /// Share of the beam's energy.
    pub energy: f64,
    /// Power received from it, in watts.
    pub power: f64,
}

impl Sensor {
    /// Resolves a scene's scanner.
    ///
    /// # Errors
    /// [`SimError::UnknownColor`] never happens with the built-in white that the walk is referred to.
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let pulse_sd = detect::pulse_sd(scene.detection.pulse_fwhm_ns);
        let face_on = |reflectivity: f64, range: f64| {
            let on = Illumination {
                reflectivity,
                cos_incidence: 1.0,
                share: 1.0,
                range,
                mirrors: 1.0,
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
            shape: scene.scanner.beam_shape(),
            sub_rays: footprint::sub_rays(scene.scanner.sub_rays as usize),
            light: scene.light.clone(),
            mirrors: std::array::from_fn(|count| {
                libm::pow(scene.superstructure.mirror.reflectivity, count as f64)
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

    /// The biases that act.
    pub fn bias(&self) -> &RangeBias {
        &self.bias
    }

    /// Sub-rays of a beam.
    pub fn sub_rays(&self) -> usize {
        self.sub_rays.len()
    }

    /// Shape of a beam.
    pub fn shape(&self) -> &BeamShape {
        &self.shape
    }

    /// The sub-rays of a beam themselves.
    pub fn bundle(&self) -> &[SubRay] {
        &self.sub_rays
    }

    /// The ways of a beam's sub-rays, in the order in which they are cast.
    pub fn paths<'a>(
        &'a self,
        setting: &'a Setting<'_>,
        beam: usize,
    ) -> impl Iterator<Item = (&'a SubRay, Path)> {
        let rays: Vec<Ray> = self.rays(beam).collect();
        self.sub_rays.iter().zip(setting.trace_beam(&rays))
    }

    /// A beam's sub-rays as they leave the scanner, in the order in which they are cast.
    pub fn rays(&self, beam: usize) -> impl Iterator<Item = Ray> {
        let azimuth = beam::azimuth(beam);
        self.sub_rays
            .iter()
            .map(move |s| footprint::ray(&self.shape, azimuth, s))
    }

    /// A beam's chief ray as it leaves the scanner.
    pub fn chief_ray(&self, beam: usize) -> Ray {
        let chief = SubRay {
            wide: 0.0,
            narrow: 0.0,
            weight: 1.0,
        };
        footprint::ray(&self.shape, beam::azimuth(beam), &chief)
    }

    /// The way of a beam's chief ray.
    pub fn chief_path(&self, setting: &Setting<'_>, beam: usize) -> Path {
        setting.trace(&self.chief_ray(beam))
    }

    /// What the structure does to a beam, and the share of its energy that goes the chief ray's way.
    ///
    /// `bare` is a setting without targets, so that light which leaves the structure escapes.
    pub fn classify(&self, bare: &Setting<'_>, beam: usize) -> (BeamClass, f64) {
        let chief = self.chief_path(bare, beam);
        let paths: Vec<_> = self.paths(bare, beam).collect();
        class(&chief, paths.iter().map(|(sub_ray, path)| (*sub_ray, path)))
    }

    /// What a beam brings home; `None` if no echo reaches the threshold.
    pub fn observe(&self, setting: &Setting<'_>, beam: usize) -> Option<Return> {
        let mut parts = Parts::default();
        self.illuminate(setting, beam, &mut parts);
        self.receive(setting, parts.as_slice())
    }

    /// What the detector makes of a beam's light.
    fn receive(&self, setting: &Setting<'_>, parts: &[Part]) -> Option<Return> {
        let physical = matches!(self.errors.model, ErrorModel::Physical | ErrorModel::Both);
        if !self.takes_one_edge() {
            let seen = match self.detection.principle {
                Principle::Pulsed => self.receive_pulses(parts, physical),
                Principle::Phase => self.receive_phase(parts, physical),
            };
            let mut found = seen.iter().filter_map(|seen| self.returned(setting, seen));
            let mut first = found.next()?;
            // Echoes that are surely detected and alone reported never need a substitute.
            if self.detection.echo == EchoChoice::All || self.detection.noise_over_threshold > 0.0 {
                first.others = found.take(MAX_ECHOES - 1).collect();
            }
            return Some(first);
        }
        let (part, mixed, detection) = match parts {
            [] => return None,
            // One surface reads its own range, wherever on its edge that is.
            [only] if !physical => {
                if !detect::is_seen(&only.pulses, self.receiver.sd, self.receiver.threshold) {
                    return None;
                }
                (only, 0.0, 0.0)
            }
            _ => self.detect(parts, physical)?,
        };
        self.returned(
            setting,
            &Seen {
                part,
                mixed,
                detection,
                probability: 1.0,
            },
        )
    }

    /// An echo with everything that it says of its surface; `None` beyond the longest range.
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
            mixed: seen.mixed,
            detection: seen.detection,
            bias: self.bias.terms(geometric, cos_incidence, &paint.name),
            noise_sd: paint.noise.sd(geometric),
            probability: seen.probability,
            others: Vec::new(),
        };
        (found.range() <= self.limits.range_max_m).then_some(found)
    }

    /// Where a beam's energy goes: what each way and surface gets, and what reaches none.
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
    fn illuminate(&self, setting: &Setting<'_>, beam: usize, parts: &mut Parts) {
        parts.begin();
        let rays: Vec<Ray> = self.rays(beam).collect();
        let paths = setting.trace_beam(&rays);
        for ((sub_ray, ray), path) in self.sub_rays.iter().zip(&rays).zip(&paths) {
            self.illuminate_along(setting, sub_ray, ray, path, parts);
        }
        if self.lacks_chief() {
            Self::add_chief(parts, &self.chief_path(setting, beam));
        }
        parts.end();
    }

    /// What one sub-ray's light reaches on its way.
    fn illuminate_along(
        &self,
        setting: &Setting<'_>,
        sub_ray: &SubRay,
        ray: &Ray,
        path: &Path,
        parts: &mut Parts,
    ) {
        let chief = is_chief(sub_ray);
        if let Some(arrival) = self.at_end(setting, sub_ray, path) {
            self.add(parts, path, &arrival, chief);
        }
        for ghost in setting.ghosts(ray, path) {
            if let Some(arrival) = self.at_end(setting, sub_ray, &ghost) {
                self.add(parts, &ghost, &arrival, false);
            }
        }
        for arrival in self.on_mirrors(setting, sub_ray, path.meetings()) {
            self.add(parts, path, &arrival, chief);
        }
    }

    /// Whether no sub-ray is the chief ray.
    fn lacks_chief(&self) -> bool {
        !self.sub_rays.iter().any(is_chief)
    }

    /// Adds the light of a sub-ray that reaches a surface to the part of that surface and the facets on the way.
    fn add(&self, parts: &mut Parts, path: &Path, arrival: &Arrival, chief: bool) {
        let (on, facets) = (&arrival.on, &path.facets()[..arrival.bounces]);
        let cosines = path.meetings().take(arrival.bounces).map(|m| m.cos_incidence);
        let place = (on.range, on.cos_incidence);
        let (power, share) = (power::received(&self.light, on), on.share * arrival.gain);
        parts.add((arrival.surface, facets), power, share, place, cosines, chief);
    }

    /// Lends the chief ray's range to the part it falls on, where the bundle itself holds no chief ray.
    fn add_chief(parts: &mut Parts, path: &Path) {
        if let End::Hit(hit) = path.end
            && let Some(part) = parts.find(hit.surface, path.facets())
        {
            let cos_incidence = hit.cos_incidence();
            let cosines = path.meetings().take(part.facets().len()).map(|m| m.cos_incidence);
            part.chief = Some(Place::new(path.length, cos_incidence, cosines));
        }
    }

    /// The part that dominates the first echo, the shift that the others cause, and the detector's own.
    ///
    /// Where the detector is not to show itself, both edges have their walk undone, so that a single surface reads its
    /// own range and only the mixture shifts it.
    fn detect<'a>(&self, parts: &'a [Part], physical: bool) -> Option<(&'a Part, f64, f64)> {
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
            if physical {
                edge.crossing + self.reference_walk
            } else {
                edge.compensated(self.receiver.sd, self.receiver.threshold)
            }
        };
        let alone = match parts {
            [_] => read(&edge),
            // A surface too dim to be seen without the others stands for its own range.
            _ => detect::leading_edge(&part.pulses, self.receiver.sd, self.receiver.threshold)
                .map_or(geometric, |edge| read(&edge)),
        };
        let detection = if physical { alone - geometric } else { 0.0 };
        Some((part, read(&edge) - alone, detection))
    }
}

/// Whether a sub-ray is the chief ray.
fn is_chief(sub_ray: &SubRay) -> bool {
    sub_ray.wide == 0.0 && sub_ray.narrow == 0.0
}

/// What the structure does to a beam, from the ways of its chief ray and of its sub-rays past it, and the share of its
/// energy that goes the chief ray's way.
pub fn class<'p>(chief: &Path, paths: impl IntoIterator<Item = (&'p SubRay, &'p Path)>) -> (BeamClass, f64) {
    let of = |path: &Path| match path.end {
        End::Hit(_) => BeamClass::Blocked,
        End::Trapped => BeamClass::Lost,
        End::Escaped => match path.facets().len() {
            0 => BeamClass::Direct,
            1 => BeamClass::Deflected,
            _ => BeamClass::MultiBounce,
        },
    };
    let mut whole = true;
    let mut share = 0.0;
    for (sub_ray, path) in paths {
        // Light that ends on the structure is lost to the scanner whatever part of it is met.
        let same =
            of(path) == of(chief) && (of(path) == BeamClass::Blocked || path.facets() == chief.facets());
        if same {
            share += sub_ray.weight;
        } else {
            whole = false;
        }
    }
    (if whole { of(chief) } else { BeamClass::Split }, share)
}
