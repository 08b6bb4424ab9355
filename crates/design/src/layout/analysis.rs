//! The analysis of a layout: its figures, and everything that they summarize.

use super::accuracy::Accuracy;
use super::element::{LayoutElement, elements};
use super::facet::{FacetView, facets};
use super::field::{FacetSequences, SPHERE_SR, cells, field};
use super::footprint::Footprint;
use super::incremental::Layout;
use super::size::{Size, size};
use super::traced::{Class, Traced};
use catoptric_model::ScanGeometry;
use catoptric_sim::SimError;
use catoptric_sim::build::Structure;
use catoptric_sim::receive::Sensor;
use serde::Serialize;
use std::collections::BTreeMap;

/// Version of the format of an analysis.
pub const SCHEMA_VERSION: u32 = 1;

/// Ranges at which the spot is stated, in meters.
pub const SPOT_RANGES_M: [f64; 3] = [1.0, 4.0, 10.0];

/// What a layout sees, loses and allows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Analysis {
    /// Version of this format.
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the structure as built; `None` for the drawing.
    pub seed: Option<u64>,
    /// Number of sub-rays per beam.
    pub sub_rays: usize,
    /// Number of elements of each class.
    pub counts: BTreeMap<Class, usize>,
    /// Number of elements with a direction of their own: direct, deflected, or leaving after several mirrors.
    pub seeing: usize,
    /// Number of elements without one.
    pub lost: usize,
    /// Number of elements whose chief ray ends on a facet: on one that shades others, or on the back of one.
    pub stopped_by_facets: usize,
    /// Longest run of neighboring elements without one, in degrees of the scan.
    pub largest_gap_deg: f64,
    /// Share of all directions, 4π, that the cells of the seeing elements cover.
    pub field_of_regard: f64,
    /// The same in steradians.
    pub solid_angle_sr: f64,
    /// Share of 4π that undeflected elements cover.
    pub direct_field_of_regard: f64,
    /// Share of all directions within 5° of a seeing element's beam.
    pub share_within_5_deg: f64,
    /// Minimum and maximum elevation of a seeing element, in degrees; `None` without any.
    pub elevation_deg: Option<[f64; 2]>,
    /// Degrees of elevation, of 180, in which an element looks.
    pub elevation_covered_deg: f64,
    /// Degrees of azimuth, of 360, in which an element looks.
    pub azimuth_covered_deg: f64,
    /// Facet by facet.
    pub facets: Vec<FacetView>,
    /// Spot and spacing of the beams at several ranges.
    pub spots: Vec<Spot>,
    /// Size, mirror area and mass.
    pub size: Size,
    /// The accuracy that a calibration can reach; `None` if not requested.
    pub accuracy: Option<Accuracy>,
    /// Runs of neighboring elements that end the same way, in order.
    pub runs: Vec<ElementRun>,
    /// Every element.
    pub elements: Vec<LayoutElement>,
}

/// Spot and spacing at a range; they do not depend on the mirrors of the path, since a plane mirror changes neither.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spot {
    /// Length of the path from the scanner, in meters.
    pub range_m: f64,
    /// Full width of the 1/e² contour along its long axis, in millimeters.
    pub wide_mm: f64,
    /// Full width along its short axis, in millimeters.
    pub narrow_mm: f64,
    /// Distance between neighboring beams of a fan, in millimeters.
    pub spacing_mm: f64,
}

/// A run of neighboring elements of one class that hit the same surfaces.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ElementRun {
    /// First and last beam.
    pub beams: [usize; 2],
    /// Interval of azimuth in the scan, in degrees.
    pub azimuth_deg: [f64; 2],
    /// Their class.
    pub class: Class,
    /// Facets that they hit.
    pub facets: Vec<String>,
    /// What their paths end on.
    pub stopped_by: Option<String>,
}

impl Layout {
    /// Returns what the layout sees, loses and allows.
    ///
    /// # Errors
    /// As [`Layout::new`]; a layout that was constructed has none.
    pub fn analysis(&self) -> Result<Analysis, SimError> {
        let traced: Vec<&Traced> = self.beams.iter().map(|beam| &beam.traced).collect();
        let footprints: Vec<&Footprint> = self.beams.iter().flat_map(|beam| &beam.footprints).collect();
        Ok(analysis(self, &self.setting()?.names(), &traced, &footprints))
    }
}

/// Returns the results for a layout whose beams have been traced.
fn analysis(layout: &Layout, names: &[&str], traced: &[&Traced], footprints: &[&Footprint]) -> Analysis {
    let Layout {
        scene,
        structure,
        sensor,
        ..
    } = layout;
    let sequences = FacetSequences::new(structure, sensor.scan(), traced);
    let cells = cells(sensor);
    let elements = elements(scene, sensor.scan(), structure, names, traced, footprints);
    let field = field(&sequences, &cells, traced);
    let mut counts: BTreeMap<Class, usize> = Class::ALL.map(|class| (class, 0)).into();
    for element in &elements {
        *counts.entry(element.class).or_default() += 1;
    }
    let seeing = elements.iter().filter(|e| e.class.sees()).count();
    let runs = runs(&elements, sensor.scan());
    Analysis {
        schema_version: SCHEMA_VERSION,
        name: scene.name.clone(),
        seed: layout.seed,
        sub_rays: sensor.sub_rays(),
        counts,
        seeing,
        lost: elements.len() - seeing,
        stopped_by_facets: stopped_by_facets(structure, &elements),
        largest_gap_deg: largest_gap(&elements, sensor.scan()),
        field_of_regard: field.covered_sr / SPHERE_SR,
        solid_angle_sr: field.covered_sr,
        direct_field_of_regard: field.direct_sr / SPHERE_SR,
        share_within_5_deg: field.near,
        elevation_deg: field.elevation_deg,
        elevation_covered_deg: field.elevation_covered_deg,
        azimuth_covered_deg: field.azimuth_covered_deg,
        facets: facets(
            sensor.scan(),
            structure,
            &elements,
            traced,
            &|beam| cells[beam].solid_angle() * sequences.growth(beam),
            footprints,
        ),
        spots: spots(sensor),
        size: size(scene, structure),
        accuracy: None,
        runs,
        elements,
    }
}

/// Returns the 1/e² full widths of the beam at every range, from its divergence and its width at the exit of the
/// scanner.
fn spots(sensor: &Sensor) -> Vec<Spot> {
    let shape = sensor.shape();
    let width = |aperture_mm: f64, full_mrad: f64, range: f64| {
        aperture_mm + 2e3 * range * libm::tan(0.5e-3 * full_mrad)
    };
    SPOT_RANGES_M
        .map(|range_m| Spot {
            range_m,
            wide_mm: width(shape.wide_aperture_mm, shape.wide_full_mrad, range_m),
            narrow_mm: width(shape.narrow_aperture_mm, shape.narrow_full_mrad, range_m),
            spacing_mm: 2e3 * range_m * libm::sin(0.5 * sensor.scan().step()),
        })
        .to_vec()
}

fn runs(elements: &[LayoutElement], scan: &ScanGeometry) -> Vec<ElementRun> {
    let same = |a: &LayoutElement, b: &LayoutElement| {
        a.class == b.class && a.facets == b.facets && a.stopped_by == b.stopped_by
    };
    let half_step = 0.5 * scan.step().to_degrees();
    elements
        .chunk_by(same)
        .filter_map(|run| {
            let (first, last) = (run.first()?, run.last()?);
            Some(ElementRun {
                beams: [first.beam, last.beam],
                azimuth_deg: [
                    first.scan_azimuth_deg.min(last.scan_azimuth_deg) - half_step,
                    first.scan_azimuth_deg.max(last.scan_azimuth_deg) + half_step,
                ],
                class: first.class,
                facets: first.facets.clone(),
                stopped_by: first.stopped_by.clone(),
            })
        })
        .collect()
}

fn stopped_by_facets(structure: &Structure, elements: &[LayoutElement]) -> usize {
    let is_facet = |name: &str| structure.facets.iter().any(|f| f.name == name);
    let stopped = elements.iter().filter_map(|e| e.stopped_by.as_deref());
    stopped.filter(|name| is_facet(name)).count()
}

/// The longest run of elements that do not see, in degrees of the scan; it goes over the seam of a scan that closes.
fn largest_gap(elements: &[LayoutElement], scan: &ScanGeometry) -> f64 {
    // From the first element on that sees: before it no run goes on.
    let sees = |e: &LayoutElement| e.class.sees();
    let start = match scan.closes() {
        true => elements.iter().position(sees).unwrap_or(0),
        false => 0,
    };
    let (before, after) = elements.split_at(start);
    let (mut longest, mut run) = (0, 0);
    for element in after.iter().chain(before) {
        run = if sees(element) { 0 } else { run + 1 };
        longest = longest.max(run);
    }
    longest as f64 * scan.step().to_degrees()
}
