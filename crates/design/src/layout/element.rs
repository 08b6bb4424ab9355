//! Element by element: the class of its light, its direction, and its limits of range.
//!
//! A face-on target of reflectivity ρ is detected as far as Eq. (1) keeps its echo above the threshold. Let the
//! threshold be set by a target of reflectivity ρ_t at R_t, and let g = Σ share·(ρ_mirrorⁿ·gain)² be what two passes
//! via n mirrors leave of the light on the chief ray's path. Then
//!
//! ```text
//! R = R_t·√(g·ρ/ρ_t)         limited by the scanner's maximum range, along the whole path from the scanner
//! ```

use super::footprint::Footprint;
use catoptric_cast::Ray;
use catoptric_model::ScanGeometry;
use catoptric_sim::Scene;
use catoptric_sim::build::Structure;
use catoptric_sim::build::color;
use catoptric_sim::light::{End, Path, Setting, Trail};
use catoptric_sim::receive::{Sensor, class};
use catoptric_sim::truth::BeamClass;
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;
use serde::Serialize;

/// Reflectivity of the dark target for which data sheets state ranges.
pub const DARK: f64 = 0.1;

catoptric_model::closed_set! {
    /// How an element's light ends.
    #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
    #[serde(rename_all = "snake_case")]
    pub enum Class {
        /// All of it passes by the structure.
        Direct,
        /// All of it leaves by one facet.
        Deflected,
        /// All of it leaves after more than one facet.
        MultiBounce,
        /// An edge divides it between paths.
        Split,
        /// All of it ends on the structure without hitting a mirror first.
        HitsStructure,
        /// All of it hits a mirror and then ends on the structure.
        Shaded,
        /// All of it is still between mirrors after the last bounce allowed.
        Trapped,
        /// It leaves, but even a white target returns too little of it.
        TooFaint,
    }
}

/// One element of the scan.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Element {
    /// Index of the beam.
    pub beam: usize,
    /// Its azimuth in the scan, in degrees.
    pub scan_azimuth_deg: f64,
    /// Its class.
    pub class: Class,
    /// Its class as the truth of a recording states it.
    pub status: BeamClass,
    /// Facets that its chief ray hits, in order.
    pub facets: Vec<String>,
    /// What its chief ray's path ends on.
    pub stopped_by: Option<String>,
    /// Share of its energy on the chief ray's path.
    pub chief_energy: f64,
    /// Exit azimuth of its chief ray, in degrees.
    pub exit_azimuth_deg: Option<f64>,
    /// Exit elevation of its chief ray, in degrees.
    pub exit_elevation_deg: Option<f64>,
    /// Length of the path to the last mirror, in meters; 0 without a mirror.
    pub mirror_at_m: f64,
    /// Shortest range that is reported and beyond the last mirror, in meters from the scanner.
    pub range_min_m: Option<f64>,
    /// Range of the farthest face-on white target that is detected, in meters from the scanner.
    pub range_max_white_m: Option<f64>,
    /// Range of the farthest face-on target of 10 % that is detected, in meters from the scanner.
    pub range_max_dark_m: Option<f64>,
    /// Minimum distance of its footprint from an edge of the mirrors it hits, in millimeters; negative where an edge
    /// cuts it.
    pub margin_mm: Option<f64>,
    /// The same, over the distance between neighboring beams there.
    pub margin_beams: Option<f64>,
}

/// The paths of one beam.
pub(crate) struct Traced {
    pub(crate) beam: usize,
    pub(crate) chief: Path,
    pub(crate) status: BeamClass,
    pub(crate) chief_energy: f64,
    /// What two passes leave of the light on the chief ray's path.
    pub(crate) light: f64,
    pub(crate) sees: bool,
    /// Where its light passed the structure.
    pub(crate) trail: Trail,
}

impl Traced {
    /// Returns the class of the element.
    pub(crate) fn class(&self) -> Class {
        match self.status {
            BeamClass::Split => Class::Split,
            BeamClass::Blocked if !self.chief.facets().is_empty() => Class::Shaded,
            BeamClass::Blocked => Class::HitsStructure,
            BeamClass::Lost => Class::Trapped,
            _ if !self.sees => Class::TooFaint,
            BeamClass::Direct => Class::Direct,
            BeamClass::Deflected => Class::Deflected,
            BeamClass::MultiBounce => Class::MultiBounce,
        }
    }
}

impl Class {
    /// Whether such an element has a direction of its own.
    pub fn sees(self) -> bool {
        matches!(self, Self::Direct | Self::Deflected | Self::MultiBounce)
    }

    /// Returns its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Deflected => "deflected",
            Self::MultiBounce => "multi_bounce",
            Self::Split => "split",
            Self::HitsStructure => "hits_structure",
            Self::Shaded => "shaded",
            Self::Trapped => "trapped",
            Self::TooFaint => "too_faint",
        }
    }

    /// Returns its name for people.
    pub fn words(self) -> &'static str {
        match self {
            Self::Direct => "direct",
            Self::Deflected => "deflected by one facet",
            Self::MultiBounce => "leaving after several facets",
            Self::Split => "split at an edge",
            Self::HitsStructure => "ending on the structure",
            Self::Shaded => "ending on the structure after a mirror",
            Self::Trapped => "trapped between mirrors",
            Self::TooFaint => "too faint",
        }
    }
}

/// Returns the exit direction of a path; `None` if it does not leave.
pub(crate) fn exit(path: &Path) -> Option<Unit<Vector3<f64>>> {
    matches!(path.end, End::Escaped).then_some(path.last.direction)
}

/// Returns the length of a path to its last mirror, in meters.
fn mirror_at(path: &Path) -> f64 {
    match path.end {
        End::Escaped | End::Trapped => path.length,
        End::Hit(hit) => path.length - hit.distance,
    }
}

/// Traces every beam through a setting without targets.
pub(crate) fn trace(sensor: &Sensor, bare: &Setting<'_>, scene: &Scene) -> Vec<Traced> {
    let beams = (0..sensor.scan().beams()).into_par_iter();
    beams.map(|beam| trace_one(sensor, bare, scene, beam)).collect()
}

/// Traces a beam through a setting without targets.
pub(crate) fn trace_one(sensor: &Sensor, bare: &Setting<'_>, scene: &Scene, beam: usize) -> Traced {
    let rays: Vec<Ray> = sensor.rays(beam).chain([sensor.chief_ray(beam)]).collect();
    let (paths, trail) = bare.trace_with_trail(&rays);
    let chief = paths[paths.len() - 1];
    let paths = || sensor.sub_ray_list().iter().zip(&paths);
    let (status, chief_energy) = class(&chief, paths());
    let along = paths().filter(|(_, p)| exit(p).is_some() && p.facets() == chief.facets());
    let light = along.map(|(s, p)| {
        let pass = libm::pow(scene.superstructure.mirror.reflectivity, p.silvered as f64) * p.gain;
        s.weight * pass * pass
    });
    let mut traced = Traced {
        beam,
        status,
        chief_energy,
        light: light.sum(),
        sees: false,
        chief,
        trail,
    };
    let leaves = matches!(
        status,
        BeamClass::Direct | BeamClass::Deflected | BeamClass::MultiBounce
    );
    traced.sees = leaves && farthest(scene, &traced, white(scene)) > nearest(scene, &traced);
    traced
}

/// Returns the reflectivity of the scene's color `white`.
fn white(scene: &Scene) -> f64 {
    color::paint(scene, "white").map_or(1.0, |paint| paint.reflectivity)
}

/// Returns the range of the farthest face-on target of a reflectivity, along the whole path.
fn farthest(scene: &Scene, traced: &Traced, reflectivity: f64) -> f64 {
    let detection = &scene.detection;
    let brightness = traced.light * reflectivity / detection.threshold_reflectivity;
    let seen = detection.threshold_range_m * brightness.sqrt();
    // Without a threshold everything is detected, except where there is no light at all (0/0).
    let seen = if seen.is_nan() { 0.0 } else { seen };
    seen.min(scene.scanner.limits().range_max_m)
}

/// Returns the shortest path that is reported and leads beyond the last mirror.
fn nearest(scene: &Scene, traced: &Traced) -> f64 {
    scene.scanner.limits().range_min_m.max(mirror_at(&traced.chief))
}

/// Returns the results for every element.
pub(crate) fn elements(
    scene: &Scene,
    scan: &ScanGeometry,
    structure: &Structure,
    names: &[&str],
    traced: &[&Traced],
    footprints: &[&Footprint],
) -> Vec<Element> {
    let white = white(scene);
    let mut margins: Vec<Option<(f64, f64)>> = vec![None; traced.len()];
    for footprint in footprints {
        let margin = &mut margins[footprint.beam];
        if margin.is_none_or(|(mm, _)| footprint.margin_mm < mm) {
            *margin = Some((footprint.margin_mm, footprint.margin_beams));
        }
    }
    let of_one = |t: &Traced| {
        let leaves = exit(&t.chief);
        let reach = |reflectivity| t.sees.then(|| farthest(scene, t, reflectivity));
        Element {
            beam: t.beam,
            scan_azimuth_deg: scan.azimuth(t.beam).to_degrees(),
            class: t.class(),
            status: t.status,
            facets: t
                .chief
                .facets()
                .iter()
                .map(|&f| structure.facets[f].name.clone())
                .collect(),
            stopped_by: match t.chief.end {
                End::Hit(hit) => Some(names[hit.surface].to_owned()),
                End::Escaped | End::Trapped => None,
            },
            chief_energy: t.chief_energy,
            exit_azimuth_deg: leaves.map(|v| libm::atan2(v.y, v.x).to_degrees()),
            exit_elevation_deg: leaves.map(|v| libm::atan2(v.z, libm::hypot(v.x, v.y)).to_degrees()),
            mirror_at_m: mirror_at(&t.chief),
            range_min_m: t.sees.then(|| nearest(scene, t)),
            range_max_white_m: reach(white),
            range_max_dark_m: reach(DARK),
            margin_mm: margins[t.beam].map(|(mm, _)| mm),
            margin_beams: margins[t.beam].map(|(_, beams)| beams),
        }
    };
    traced.iter().map(|t| of_one(t)).collect()
}
