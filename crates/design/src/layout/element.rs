//! Element by element: the class of its light, its direction, and its limits of range.

use super::footprint::Footprint;
use super::traced::{Class, Traced, exit, farthest, mirror_at, nearest, white};
use catoptric_model::ScanGeometry;
use catoptric_sim::Scene;
use catoptric_sim::build::Structure;
use catoptric_sim::light::End;
use catoptric_sim::truth::BeamClass;
use serde::Serialize;

/// Reflectivity of the dark target for which data sheets state ranges.
pub const DARK: f64 = 0.1;

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
