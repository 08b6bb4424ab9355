//! Facet by facet: its elements, the extent of its fan, its margins, and the effect of its errors.

use super::element::LayoutElement;
use super::field::SPHERE_SR;
use super::footprint::Footprint;
use super::sensitivity::{RANGE_M, Shift, shifts};
use super::traced::{Class, Traced, exit};
use catoptric_cast::area_vector;
use catoptric_model::ScanGeometry;
use catoptric_sim::build::Structure;
use serde::Serialize;

/// Turn of a facet for which its sensitivity is stated, in degrees.
const TURN_DEG: f64 = 0.1;

/// Shift of a facet for which its sensitivity is stated, in millimeters.
const SHIFT_MM: f64 = 0.1;

/// The elements of one facet, and the effect of its errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetView {
    /// The facet.
    pub name: String,
    /// Number of elements that it deflects alone and that have a direction.
    pub elements: usize,
    /// The first and last of them.
    pub beams: Option<[usize; 2]>,
    /// Number of elements that hit it and leave after other facets too.
    pub multi_bounce: usize,
    /// Number of elements whose chief ray hits it and that an edge cuts.
    pub split: usize,
    /// Number of elements that hit it and then end on the structure.
    pub shaded: usize,
    /// Minimum and maximum azimuth of its fan, in degrees; the first may be below −180.
    pub exit_azimuth_deg: Option<[f64; 2]>,
    /// Minimum and maximum elevation of its fan, in degrees.
    pub exit_elevation_deg: Option<[f64; 2]>,
    /// Solid angle of its elements' cells, in steradians.
    pub solid_angle_sr: f64,
    /// The same as a share of 4π.
    pub field_of_regard: f64,
    /// Minimum and maximum length of the path from the scanner to it, in meters.
    pub mirror_at_m: Option<[f64; 2]>,
    /// Range of the farthest face-on white target that all of its elements detect, in meters from the scanner.
    pub range_max_white_m: Option<f64>,
    /// Range of the farthest face-on target of 10 % that all of its elements detect, in meters from the scanner.
    pub range_max_dark_m: Option<f64>,
    /// Minimum distance of an unsplit element's footprint from any edge, in millimeters.
    pub margin_mm: Option<f64>,
    /// The same over the distance between neighboring beams on the facet.
    pub margin_beams: Option<f64>,
    /// Minimum distance of an unsplit element's footprint from the edges above and below the scan's line, in
    /// millimeters: how far the scan may rise or sink.
    pub margin_across_mm: Option<f64>,
    /// Area, in square millimeters.
    pub area_mm2: f64,
    /// Displacement of the point at 4 m for a turn of the facet by 0.1° about the worst axis, root mean square over the
    /// elements that hit it and have a direction, in millimeters.
    pub point_at_4m_per_0_1_deg_rms_mm: Option<f64>,
    /// The maximum of the same.
    pub point_at_4m_per_0_1_deg_max_mm: Option<f64>,
    /// Displacement of the point at 4 m for a shift of the facet by 0.1 mm along its normal, in millimeters.
    pub point_at_4m_per_0_1_mm_mm: Option<f64>,
}

/// Returns the results for all facets.
pub(crate) fn facets(
    scan: &ScanGeometry,
    structure: &Structure,
    elements: &[LayoutElement],
    traced: &[&Traced],
    solid_angle: &dyn Fn(usize) -> f64,
    footprints: &[&Footprint],
) -> Vec<FacetView> {
    (0..structure.facets.len())
        .map(|facet| view(scan, structure, facet, elements, traced, solid_angle, footprints))
        .collect()
}

fn view(
    scan: &ScanGeometry,
    structure: &Structure,
    facet: usize,
    elements: &[LayoutElement],
    traced: &[&Traced],
    solid_angle: &dyn Fn(usize) -> f64,
    footprints: &[&Footprint],
) -> FacetView {
    let built = &structure.facets[facet];
    let meets = |t: &Traced| t.chief.facets().contains(&facet);
    let of_class = |class: Class| {
        let met = elements.iter().zip(traced).filter(|(_, t)| meets(t));
        met.filter(|(e, _)| e.class == class).collect::<Vec<_>>()
    };
    let own = of_class(Class::Deflected);
    let extremes = |value: &dyn Fn(&LayoutElement) -> Option<f64>| {
        let values = || own.iter().filter_map(|(e, _)| value(e));
        Some([values().reduce(f64::min)?, values().reduce(f64::max)?])
    };
    let angles = own.iter().map(|(e, _)| solid_angle(e.beam));
    // An empty sum is −0.
    let solid_angle_sr = angles.fold(0.0, |sum, angle| sum + angle);
    let sees = |f: &&&Footprint| f.facet == facet && elements[f.beam].class.sees();
    let nearest = footprints
        .iter()
        .filter(sees)
        .min_by(|a, b| a.margin_mm.total_cmp(&b.margin_mm));
    let across = footprints
        .iter()
        .filter(sees)
        .filter_map(|f| f.across_mm)
        .reduce(f64::min);
    // A curved mirror that moves also shows another part of itself, which these figures know nothing of.
    let all_flat = |t: &Traced| {
        t.chief
            .facets()
            .iter()
            .all(|f| structure.facets[*f].bent.is_none())
    };
    let moved: Vec<(f64, f64)> = elements
        .iter()
        .zip(traced)
        .filter(|(e, t)| e.class.sees() && meets(t) && all_flat(t))
        .map(|(e, t)| {
            let faces = t.chief.facets().iter().map(|&f| &structure.facets[f].face);
            let all = shifts(scan.azimuth(e.beam), faces, RANGE_M);
            // A facet that is met twice moves the point twice.
            let own = all.iter().zip(t.chief.facets()).filter(|(_, f)| **f == facet);
            let sum = own.fold(Shift::default(), |sum, (shift, _)| sum + *shift);
            let turn = 1e3 * sum.worst_turn() * TURN_DEG.to_radians();
            (turn, sum.shift.norm() * SHIFT_MM)
        })
        .collect();
    let square: f64 = moved.iter().map(|(turn, _)| turn * turn).sum();
    FacetView {
        name: built.name.clone(),
        elements: own.len(),
        beams: scan.shortest_run(&own.iter().map(|(e, _)| e.beam).collect::<Vec<_>>()),
        multi_bounce: of_class(Class::MultiBounce).len(),
        split: of_class(Class::Split).len(),
        shaded: of_class(Class::Shaded).len(),
        exit_azimuth_deg: azimuths(&own),
        exit_elevation_deg: extremes(&|e| e.exit_elevation_deg),
        solid_angle_sr,
        field_of_regard: solid_angle_sr / SPHERE_SR,
        mirror_at_m: extremes(&|e| Some(e.mirror_at_m)),
        range_max_white_m: extremes(&|e| e.range_max_white_m).map(|[min, _]| min),
        range_max_dark_m: extremes(&|e| e.range_max_dark_m).map(|[min, _]| min),
        margin_mm: nearest.map(|f| f.margin_mm),
        margin_beams: nearest.map(|f| f.margin_beams),
        margin_across_mm: across,
        area_mm2: 0.5e6 * area_vector(&built.face.corners).norm(),
        point_at_4m_per_0_1_deg_rms_mm: (!moved.is_empty()).then(|| (square / moved.len() as f64).sqrt()),
        point_at_4m_per_0_1_deg_max_mm: moved.iter().map(|(turn, _)| *turn).reduce(f64::max),
        point_at_4m_per_0_1_mm_mm: moved.iter().map(|(_, shift)| *shift).reduce(f64::max),
    }
}

/// Returns minimum and maximum azimuth of a fan, in degrees, measured from its middle to avoid a jump at ±180°.
fn azimuths(own: &[(&LayoutElement, &&Traced)]) -> Option<[f64; 2]> {
    let (_, middle) = own.get(own.len() / 2)?;
    let middle = exit(&middle.chief)?;
    let from = libm::atan2(middle.y, middle.x);
    let offsets = || {
        own.iter().filter_map(|(_, t)| {
            let v = exit(&t.chief)?;
            let turn = libm::atan2(v.y, v.x) - from;
            Some(turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round())
        })
    };
    let (low, high) = (offsets().reduce(f64::min)?, offsets().reduce(f64::max)?);
    Some([(from + low).to_degrees(), (from + high).to_degrees()])
}
