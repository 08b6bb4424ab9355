//! The traced paths of a beam: how its light ends, and from where to where a target can be detected.
//!
//! A face-on target of reflectivity ρ is detected as far as Eq. (1) keeps its echo above the threshold. Let the
//! threshold be set by a target of reflectivity ρ_t at R_t, and let g = Σ share·(ρ_mirrorⁿ·gain)² be what two passes
//! via n mirrors leave of the light on the chief ray's path. Then
//!
//! ```text
//! R = R_t·√(g·ρ/ρ_t)         limited by the scanner's maximum range, along the whole path from the scanner
//! ```
//!
//! Behind a curved mirror it is the longest path from which as much light comes back as from that R behind a flat one.

use catoptric_sim::Scene;
use catoptric_sim::build::color;
use catoptric_sim::light::{End, RayPath, Setting, Spread, Trail};
use catoptric_sim::receive::{Sensor, class};
use catoptric_sim::truth::BeamClass;
use nalgebra::{Unit, Vector3};
use rayon::prelude::*;
use serde::Serialize;
use std::borrow::Cow;

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

/// The paths of one beam.
pub(crate) struct Traced {
    pub(crate) beam: usize,
    pub(crate) chief: RayPath,
    pub(crate) status: BeamClass,
    pub(crate) chief_energy: f64,
    /// What two passes leave of the light on the chief ray's path.
    pub(crate) light: f64,
    /// How curved mirrors spread the light of the chief ray.
    spread: Option<Spread>,
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

/// Returns the exit direction of a path; `None` if it does not leave.
pub(crate) fn exit(path: &RayPath) -> Option<Unit<Vector3<f64>>> {
    matches!(path.end, End::Escaped).then_some(path.last.direction)
}

/// Returns the length of a path to its last mirror, in meters.
pub(super) fn mirror_at(path: &RayPath) -> f64 {
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
    let (mut sub_rays, mut rays) = (Cow::Borrowed(sensor.sub_ray_list()), sensor.seeking_rays(beam));
    let extra = rays.len() > sub_rays.len();
    rays.push(sensor.chief_ray(beam));
    let (mut paths, mut trail) = bare.trace_with_trail(&rays);
    if extra && paths.iter().any(|path| !path.goes_like(&paths[0])) {
        // One for each path: that is where all of its light goes.
        sub_rays = Cow::Owned(sensor.divided(bare, beam, 1));
        rays = sensor
            .rays(beam, &sub_rays)
            .chain([sensor.chief_ray(beam)])
            .collect();
        (paths, trail) = bare.trace_with_trail(&rays);
        // The edges were found by more rays than these.
        trail.take_any();
    }
    let chief = paths[paths.len() - 1];
    let paths = || sub_rays.iter().zip(&paths);
    let (status, chief_energy) = class(&chief, paths());
    let along = rays.iter().zip(paths());
    let along = along.filter(|(_, (_, p))| exit(p).is_some() && p.facets() == chief.facets());
    let light = along.map(|(ray, (s, p))| {
        let pass = sensor.reflected(bare, beam, ray, p) * p.gain;
        s.weight * pass * pass
    });
    let shown = sensor.shown(bare, beam, chief.facets());
    let mut traced = Traced {
        beam,
        status,
        chief_energy,
        light: light.sum::<f64>() * shown,
        sees: false,
        spread: bare.spread_along(&rays[rays.len() - 1], &chief),
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
pub(super) fn white(scene: &Scene) -> f64 {
    color::paint(scene, "white").map_or(1.0, |paint| paint.reflectivity)
}

/// Returns the range of the farthest face-on target of a reflectivity, along the whole path.
pub(super) fn farthest(scene: &Scene, traced: &Traced, reflectivity: f64) -> f64 {
    let detection = &scene.detection;
    let brightness = traced.light * reflectivity / detection.threshold_reflectivity;
    let seen = detection.threshold_range_m * brightness.sqrt();
    // Without a threshold everything is detected, except where there is no light at all (0/0).
    let seen = if seen.is_nan() { 0.0 } else { seen };
    let seen = traced.spread.map_or(seen, |spread| spread.reach(seen));
    seen.min(scene.scanner.limits().range_max_m)
}

/// Returns the shortest path that is reported and leads beyond the last mirror.
pub(super) fn nearest(scene: &Scene, traced: &Traced) -> f64 {
    scene.scanner.limits().range_min_m.max(mirror_at(&traced.chief))
}
