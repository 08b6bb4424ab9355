//! Eight mirrors around a scanner, and what they do to each beam.

use catoptric_cast::area_vector;
use catoptric_model::{MirrorPlane, beam};
use catoptric_sim::build::layout;
use catoptric_sim::scene::{FacetShape, Wedge};
use catoptric_sim::truth::{BeamClass, TrueBeam};
use nalgebra::{Point3, Unit};

/// A mirror, with the azimuths of the beams that it deflects.
pub(super) struct Mirror {
    pub(super) name: &'static str,
    pub(super) corners: Vec<Point3<f64>>,
    pub(super) plane: MirrorPlane,
    pub(super) azimuth_deg: [f64; 2],
}

const NAMES: [&str; 8] = [
    "port 1",
    "port 2",
    "port 3",
    "port 4",
    "starboard 1",
    "starboard 2",
    "starboard 3",
    "starboard 4",
];

/// Four mirrors on each side.
pub(super) fn mirrors() -> Vec<Mirror> {
    let build = |(i, name): (usize, &&'static str)| {
        let side = if i < 4 { 1.0 } else { -1.0 };
        let place = (i % 4) as f64;
        let first = 62.0 + 16.8 * place;
        let azimuth_deg = if side > 0.0 {
            [first, first + 15.0]
        } else {
            [-first - 15.0, -first]
        };
        let up = if i % 2 == 0 { 1.0 } else { -1.0 };
        let corners = layout::corners(&FacetShape::Wedge(Wedge {
            azimuth_deg,
            distance_mm: 62.0 + 7.0 * place,
            exit_azimuth_deg: 0.5 * (azimuth_deg[0] + azimuth_deg[1]) - side * 25.0,
            exit_elevation_deg: up * (42.0 + 8.0 * place),
            height_mm: 14.0,
        }))
        .expect("it is a mirror");
        let normal = Unit::new_normalize(area_vector(&corners));
        Mirror {
            name,
            plane: MirrorPlane::through(corners[0], normal),
            corners,
            azimuth_deg,
        }
    };
    NAMES.iter().enumerate().map(build).collect()
}

/// What becomes of a beam: deflected, split at an edge, direct, or blocked.
pub(super) fn true_beam(beam: usize, mirrors: &[Mirror]) -> TrueBeam {
    let azimuth = beam::azimuth(beam).to_degrees();
    // Half the width of a beam at the mirror, in degrees.
    let half = 0.8;
    let inside = |m: &&Mirror, margin: f64| {
        m.azimuth_deg[0] + margin <= azimuth && azimuth <= m.azimuth_deg[1] - margin
    };
    let (status, mirror) = match mirrors.iter().find(|m| inside(m, 0.0)) {
        Some(m) if inside(&m, half) => (BeamClass::Deflected, Some(m)),
        Some(m) => (BeamClass::Split, Some(m)),
        None if azimuth.abs() < 60.0 => (BeamClass::Direct, None),
        None => (BeamClass::Blocked, None),
    };
    let deflection = mirror.and_then(|m| m.plane.deflect(beam::direction(beam::azimuth(beam))));
    let is_direct = status == BeamClass::Direct;
    TrueBeam {
        beam,
        status,
        facets: mirror.iter().map(|m| m.name.to_owned()).collect(),
        points_m: deflection
            .iter()
            .map(|d| d.deflection_point(beam::azimuth(beam)).coords.into())
            .collect(),
        azimuth_rad: deflection.map(|d| d.azimuth).or(is_direct.then_some(0.0)),
        elevation_rad: deflection.map(|d| d.elevation).or(is_direct.then_some(0.0)),
        distance_m: deflection.map(|d| d.distance),
        chief_energy: if status == BeamClass::Split { 0.7 } else { 1.0 },
    }
}
