//! One beam against one setting: its sub-rays' ways, the echo they make, and the range read off it.
//!
//! Everything here is free of chance; it is the same for every scan of a stretch.

use crate::color::{self, Paint};
use crate::detect::{self, Pulse};
use crate::error::SimError;
use crate::footprint::{self, SubRay};
use crate::optics::{End, MAX_BOUNCES, Path, Role, Setting};
use crate::power::{self, Illumination};
use crate::scanner::{RANGE_MAX_M, RANGE_MIN_M};
use crate::scene::{BeamShape, ErrorModel, Errors, Light, Scene};
use crate::truth::BeamClass;
use catoptric_model::{BiasTerms, RangeBias, beam};

/// The scanner with everything resolved that does not depend on where it looks.
pub struct Sensor {
    shape: BeamShape,
    sub_rays: Vec<SubRay>,
    light: Light,
    mirror_reflectivity: f64,
    pulse_sd: f64,
    threshold: f64,
    reference_walk: f64,
    bias: RangeBias,
    errors: Errors,
}

/// What a beam brings home, each contribution by itself. The reading is their sum, then drift, noise and rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Return {
    /// Surface that dominates the first echo.
    pub role: Role,
    /// Facets on the way there.
    pub facets: Vec<usize>,
    /// Path length to it, of the chief ray if that meets it and else the mean over its light, in metres.
    pub geometric: f64,
    /// Cosine of the incidence on it.
    pub cos_incidence: f64,
    /// Power received from it, in watts.
    pub power: f64,
    /// Share of the beam's energy that falls on it.
    pub share: f64,
    /// Shift of the range because other surfaces are in the same echo, in metres.
    pub mixed: f64,
    /// Shift by pulse and threshold for this surface alone, in metres; 0 unless the error model is physical.
    pub detection: f64,
    /// The biases of Eqs. 3–5, in metres.
    pub bias: BiasTerms,
    /// Standard deviation of its noise, in metres.
    pub noise_sd: f64,
}

impl Return {
    /// The reading without drift, noise and rounding, in metres.
    pub fn range(&self) -> f64 {
        self.geometric + self.mixed + self.detection + self.bias.total()
    }
}

/// The sub-rays that went one way to one surface.
struct Part {
    surface: usize,
    facets: [usize; MAX_BOUNCES],
    count: usize,
    pulses: Vec<Pulse>,
    share: f64,
    power: f64,
    /// Range and cosine of incidence of the chief ray, or of the mean.
    chief: Option<(f64, f64)>,
    mean_range: f64,
    mean_cos: f64,
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
        let biased = matches!(scene.errors.model, ErrorModel::Empirical | ErrorModel::Both);
        Ok(Self {
            shape: scene.scanner.beam_shape(),
            sub_rays: footprint::sub_rays(scene.scanner.sub_rays as usize),
            light: scene.light.clone(),
            mirror_reflectivity: scene.superstructure.mirror.reflectivity,
            pulse_sd,
            threshold,
            reference_walk: pulse_sd * detect::walk(reference, threshold),
            bias: if biased {
                RangeBias {
                    distance: scene.errors.distance.clone(),
                    angle: scene.errors.angle,
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

    fn paths<'a>(
        &'a self,
        setting: &'a Setting<'_>,
        beam: usize,
    ) -> impl Iterator<Item = (&'a SubRay, Path)> {
        let azimuth = beam::azimuth(beam);
        self.sub_rays
            .iter()
            .map(move |s| (s, setting.trace(&footprint::ray(&self.shape, azimuth, s))))
    }

    /// The way of a beam's chief ray.
    pub fn chief_path(&self, setting: &Setting<'_>, beam: usize) -> Path {
        let chief = SubRay {
            wide: 0.0,
            narrow: 0.0,
            weight: 1.0,
        };
        setting.trace(&footprint::ray(&self.shape, beam::azimuth(beam), &chief))
    }

    /// What the structure does to a beam, and the share of its energy that goes the chief ray's way.
    ///
    /// `bare` is a setting without targets, so that light which leaves the structure escapes.
    pub fn classify(&self, bare: &Setting<'_>, beam: usize) -> (BeamClass, f64) {
        let class = |path: &Path| match path.end {
            End::Hit(_) => BeamClass::Blocked,
            End::Trapped => BeamClass::Lost,
            End::Escaped => match path.facets().len() {
                0 => BeamClass::Direct,
                1 => BeamClass::Deflected,
                _ => BeamClass::MultiBounce,
            },
        };
        let chief = self.chief_path(bare, beam);
        let mut whole = true;
        let mut share = 0.0;
        for (sub_ray, path) in self.paths(bare, beam) {
            // Light that ends on the structure is lost to the scanner whatever part of it is met.
            let same = class(&path) == class(&chief)
                && (class(&path) == BeamClass::Blocked || path.facets() == chief.facets());
            if same {
                share += sub_ray.weight;
            } else {
                whole = false;
            }
        }
        (if whole { class(&chief) } else { BeamClass::Split }, share)
    }

    /// What a beam brings home; `None` if no echo reaches the threshold.
    pub fn observe(&self, setting: &Setting<'_>, beam: usize) -> Option<Return> {
        let parts = self.illuminate(setting, beam);
        let physical = matches!(self.errors.model, ErrorModel::Physical | ErrorModel::Both);
        let (part, mixed, detection) = match parts.as_slice() {
            [] => return None,
            [only] if !physical => {
                let edge = detect::leading_edge(&only.pulses, self.pulse_sd, self.threshold);
                edge.map(|_| (only, 0.0, 0.0))?
            }
            _ => self.detect(&parts, physical)?,
        };
        let (geometric, cos_incidence) = part.chief.unwrap_or((part.mean_range, part.mean_cos));
        let paint = setting.paint(part.surface);
        let found = Return {
            role: setting.role(part.surface),
            facets: part.facets[..part.count].to_vec(),
            geometric,
            cos_incidence,
            power: part.power,
            share: part.share,
            mixed,
            detection,
            bias: self.bias.terms(geometric, cos_incidence, &paint.name),
            noise_sd: paint.noise.sd(geometric),
        };
        (found.range() <= RANGE_MAX_M).then_some(found)
    }

    /// The surfaces that a beam's light reaches, each with its pulses.
    fn illuminate(&self, setting: &Setting<'_>, beam: usize) -> Vec<Part> {
        let mut parts: Vec<Part> = Vec::new();
        let azimuth = beam::azimuth(beam);
        for sub_ray in &self.sub_rays {
            let ray = footprint::ray(&self.shape, azimuth, sub_ray);
            let path = setting.trace(&ray);
            let chief = sub_ray.wide == 0.0 && sub_ray.narrow == 0.0;
            self.add_end(&mut parts, setting, sub_ray, &path, chief);
            for ghost in setting.ghosts(&ray, &path) {
                self.add_end(&mut parts, setting, sub_ray, &ghost, false);
            }
            self.add_mirrors(&mut parts, setting, sub_ray, &path);
        }
        if self.sub_rays.iter().all(|s| s.wide != 0.0 || s.narrow != 0.0) {
            Self::add_chief(&mut parts, &self.chief_path(setting, beam));
        }
        for part in parts.iter_mut().filter(|p| p.power > 0.0) {
            part.mean_range /= part.power;
            part.mean_cos /= part.power;
        }
        parts
    }

    /// Adds the light that a sub-ray leaves where its way ends.
    fn add_end(
        &self,
        parts: &mut Vec<Part>,
        setting: &Setting<'_>,
        sub_ray: &SubRay,
        path: &Path,
        chief: bool,
    ) {
        let End::Hit(hit) = path.end else { return };
        let paint: &Paint = setting.paint(hit.surface);
        let on = Illumination {
            reflectivity: paint.reflectivity,
            cos_incidence: hit.normal.dot(&path.last.direction).abs(),
            share: sub_ray.weight,
            range: path.length,
            mirrors: libm::pow(self.mirror_reflectivity, path.silvered as f64) * path.gain,
        };
        self.add_light(parts, (hit.surface, path.facets()), &on, path.gain, chief);
    }

    /// Adds what the mirrors on a sub-ray's way scatter themselves.
    fn add_mirrors(&self, parts: &mut Vec<Part>, setting: &Setting<'_>, sub_ray: &SubRay, path: &Path) {
        let reflectivity = setting.diffuse_reflectivity();
        if reflectivity == 0.0 {
            return;
        }
        for (count, meeting) in path.meetings().enumerate() {
            let on = Illumination {
                reflectivity,
                cos_incidence: meeting.cos_incidence.max(0.0),
                share: sub_ray.weight,
                range: meeting.length,
                mirrors: libm::pow(self.mirror_reflectivity, meeting.silvered as f64) * meeting.gain,
            };
            let chief = sub_ray.wide == 0.0 && sub_ray.narrow == 0.0;
            let way = (meeting.surface, &path.facets()[..count]);
            self.add_light(parts, way, &on, reflectivity * meeting.gain, chief);
        }
    }

    /// Adds light to the part of a surface and the facets on the way there; `gain` is what is left of its energy.
    fn add_light(
        &self,
        parts: &mut Vec<Part>,
        (surface, facets): (usize, &[usize]),
        on: &Illumination,
        gain: f64,
        chief: bool,
    ) {
        let power = power::received(&self.light, on);
        let same_way = |p: &Part| p.surface == surface && p.facets[..p.count] == *facets;
        let index = match parts.iter().position(same_way) {
            Some(index) => index,
            None => {
                parts.push(Part::new(surface, facets));
                parts.len() - 1
            }
        };
        let part = &mut parts[index];
        part.pulses.push(Pulse {
            range: on.range,
            power,
        });
        part.share += on.share * gain;
        part.power += power;
        part.mean_range += power * on.range;
        part.mean_cos += power * on.cos_incidence;
        if chief {
            part.chief = Some((on.range, on.cos_incidence));
        }
    }

    /// Lends the chief ray's range to the part it falls on, where the bundle itself holds no chief ray.
    fn add_chief(parts: &mut [Part], path: &Path) {
        if let End::Hit(hit) = path.end
            && let Some(part) = parts
                .iter_mut()
                .find(|p| p.surface == hit.surface && p.facets[..p.count] == *path.facets())
        {
            part.chief = Some((path.length, hit.normal.dot(&path.last.direction).abs()));
        }
    }

    /// The part that dominates the first echo, the shift that the others cause, and the detector's own.
    ///
    /// Where the detector is not to show itself, both edges have their walk undone, so that a single surface reads its
    /// own range and only the mixture shifts it.
    fn detect<'a>(&self, parts: &'a [Part], physical: bool) -> Option<(&'a Part, f64, f64)> {
        let all: Vec<Pulse> = parts.iter().flat_map(|p| p.pulses.iter().copied()).collect();
        let edge = detect::leading_edge(&all, self.pulse_sd, self.threshold)?;
        let first = edge.compensated(self.pulse_sd, self.threshold);
        let pulse_length = self.pulse_sd * (8.0 * std::f64::consts::LN_2).sqrt();
        let in_echo = |p: &&Part| p.power > 0.0 && p.mean_range <= first + pulse_length;
        let part = parts
            .iter()
            .filter(in_echo)
            .max_by(|a, b| a.power.total_cmp(&b.power))?;
        let geometric = part.chief.map_or(part.mean_range, |(range, _)| range);
        let read = |edge: &detect::Edge| {
            if physical {
                edge.crossing + self.reference_walk
            } else {
                edge.compensated(self.pulse_sd, self.threshold)
            }
        };
        // A surface too dim to be seen without the others stands for its own range.
        let alone = detect::leading_edge(&part.pulses, self.pulse_sd, self.threshold)
            .map_or(geometric, |edge| read(&edge));
        let detection = if physical { alone - geometric } else { 0.0 };
        Some((part, read(&edge) - alone, detection))
    }

    /// A reading of one scan, in metres: the beam's range with drift and noise, rounded, or a code.
    ///
    /// `normal` is a standard normal deviate and `chance` a uniform one. What is no range stays none: noise never
    /// touches a code.
    pub fn read(&self, found: Option<&Return>, drift: f64, normal: f64, chance: f64) -> f64 {
        use catoptric_model::range::{INVALID, NO_RETURN, TOO_CLOSE};
        let Some(found) = found else { return NO_RETURN };
        if self.errors.model == ErrorModel::None {
            return if found.range() < RANGE_MIN_M {
                TOO_CLOSE
            } else {
                found.range()
            };
        }
        if chance < self.errors.dropout {
            return INVALID;
        }
        let range = found.range() + drift + found.noise_sd * normal;
        let step = self.errors.quantization_mm * 1e-3;
        let range = if step > 0.0 {
            (range / step).round() * step
        } else {
            range
        };
        if range < RANGE_MIN_M {
            TOO_CLOSE
        } else if range > RANGE_MAX_M {
            NO_RETURN
        } else {
            range
        }
    }
}

impl Part {
    fn new(surface: usize, facets: &[usize]) -> Self {
        let mut own = [0; MAX_BOUNCES];
        own[..facets.len()].copy_from_slice(facets);
        Self {
            surface,
            facets: own,
            count: facets.len(),
            pulses: Vec::new(),
            share: 0.0,
            power: 0.0,
            chief: None,
            mean_range: 0.0,
            mean_cos: 0.0,
        }
    }
}
