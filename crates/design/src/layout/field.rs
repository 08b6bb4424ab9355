//! Field of regard: the directions that the elements' cells cover, each counted once.
//!
//! Elements whose light hits the same facets in the same order share one isometry of directions, the product of their
//! reflections (facets as planes, without slope errors). Whether a direction is in a cell is evaluated in the scan,
//! where cells are plain rectangles. Sequences of facets are processed one after the other, undeflected elements first.
//! Every cell is divided into parts, and a part counts unless an earlier sequence covers it, so that cells without
//! overlap keep their solid angle exactly. An element whose light hits a curved facet is a sequence of its own, whose cell is
//! stretched as the mirror stretches it.

use super::stretch::Stretch;
use super::traced::{Traced, exit};
use catoptric_model::ScanGeometry;
use catoptric_sim::build::Structure;
use catoptric_sim::receive::Sensor;
use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::f64::consts::TAU;
use std::sync::LazyLock;

/// Angle within which a direction counts as near a beam, in degrees.
pub const NEAR_DEG: f64 = 5.0;

/// Solid angle of all directions.
pub(super) const SPHERE_SR: f64 = 4.0 * std::f64::consts::PI;

/// Number of parts of a cell along the scan and across it.
const PARTS: [usize; 2] = [3, 6];

/// Number of lattice directions for the share near a beam, which is accurate to about 1e-3.
const LATTICE: usize = 8000;

/// Minimum number of directions or cells per thread.
const AT_ONCE: usize = 64;

/// The directions that one element represents in the scan: half-way to its neighbors, and across as far as its beam
/// extends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Azimuth of its center, in radians.
    pub azimuth: f64,
    /// Half its extent across the scan, in radians.
    pub half_height: f64,
    /// Its extent along the scan, in radians.
    pub width: f64,
}

impl Cell {
    /// Returns its solid angle, in steradians: step·2·sin(δ/2).
    pub fn solid_angle(&self) -> f64 {
        2.0 * self.width * libm::sin(self.half_height)
    }
}

/// The seeing elements whose chief rays hit the same facets in the same order.
pub(crate) struct FacetSequence {
    /// The facets in order.
    facets: Vec<usize>,
    /// The product of the reflections: from directions in the scan to exit directions.
    turn: Matrix3<f64>,
    /// Instead of that, for a single element that hits a curved facet.
    stretch: Option<Stretch>,
    /// Number of its elements below each beam: `below[j] - below[i]` of them are in i..j.
    below: Vec<usize>,
    pub(crate) beams: Vec<usize>,
    scan: ScanGeometry,
}

/// All sequences of facets that seeing elements have.
pub(crate) struct FacetSequences(pub(crate) Vec<FacetSequence>);

/// The combined coverage of the elements.
pub(crate) struct Field {
    pub(crate) covered_sr: f64,
    pub(crate) direct_sr: f64,
    pub(crate) near: f64,
    pub(crate) elevation_deg: Option<[f64; 2]>,
    pub(crate) elevation_covered_deg: f64,
    pub(crate) azimuth_covered_deg: f64,
}

/// The cells of all beams.
pub(crate) fn cells(sensor: &Sensor) -> Vec<Cell> {
    let (scan, shape) = (sensor.scan(), sensor.shape());
    let tan = |full_mrad: f64| libm::tan(0.5e-3 * full_mrad);
    let (wide, narrow) = (tan(shape.wide_full_mrad), tan(shape.narrow_full_mrad));
    let cell = |beam| {
        let azimuth = scan.azimuth(beam);
        let (sin, cos) = if shape.turns {
            libm::sincos(azimuth)
        } else {
            (0.0, 1.0)
        };
        Cell {
            azimuth,
            half_height: libm::atan(libm::hypot(wide * sin, narrow * cos)),
            width: scan.step(),
        }
    };
    (0..scan.beams()).map(cell).collect()
}

impl FacetSequences {
    pub(crate) fn new(structure: &Structure, scan: &ScanGeometry, traced: &[&Traced]) -> Self {
        let mut beams: BTreeMap<(Vec<usize>, Option<usize>), Vec<usize>> = BTreeMap::new();
        for t in traced.iter().filter(|t| t.sees) {
            let facets = t.chief.facets();
            let bent = facets.iter().any(|f| structure.facets[*f].bent.is_some());
            let own = if bent { Some(t.beam) } else { None };
            beams.entry((facets.to_vec(), own)).or_default().push(t.beam);
        }
        let sequence = |((facets, own), beams): ((Vec<usize>, Option<usize>), Vec<usize>)| {
            let stretch = own.and_then(|beam| Stretch::of(structure, &facets, scan.azimuth(beam)));
            let turn = facets.iter().fold(Matrix3::identity(), |turn, &facet| {
                let m = structure.facets[facet].face.normal.into_inner();
                (Matrix3::identity() - m * m.transpose() * 2.0) * turn
            });
            let mut below = vec![0; scan.beams() + 1];
            for &beam in &beams {
                below[beam + 1] = 1;
            }
            for beam in 0..scan.beams() {
                below[beam + 1] += below[beam];
            }
            FacetSequence {
                facets,
                turn,
                stretch,
                below,
                beams,
                scan: *scan,
            }
        };
        Self(beams.into_iter().map(sequence).collect())
    }
}

impl FacetSequences {
    /// Factor by which mirrors enlarge the cell of a beam.
    pub(crate) fn growth(&self, beam: usize) -> f64 {
        let own = self.0.iter().find(|s| s.stretch.is_some() && s.beams == [beam]);
        own.and_then(|s| s.stretch)
            .map_or(1.0, |stretch| stretch.growth())
    }
}

impl FacetSequence {
    fn holds(&self, beam: usize) -> bool {
        self.below[beam + 1] > self.below[beam]
    }

    /// Exit direction of a direction in the scan, in the cell of one of its elements, and the solid angle there.
    fn out(&self, cell: &Cell, in_scan: &Vector3<f64>, weight: f64) -> (Vector3<f64>, f64) {
        let Some(stretch) = &self.stretch else {
            return (self.turn * in_scan, weight);
        };
        let along = libm::atan2(in_scan.y, in_scan.x) - cell.azimuth;
        let along = along - TAU * (along / TAU).round();
        let out = stretch.exit(along, libm::asin(in_scan.z));
        (out, weight * stretch.growth())
    }

    /// Returns the sine of the elevation in the scan of an exit direction.
    fn sin_elevation(&self, direction: &Vector3<f64>) -> f64 {
        self.turn.column(2).dot(direction)
    }

    /// Azimuth in the scan of a direction out there.
    fn azimuth(&self, direction: &Vector3<f64>) -> f64 {
        let along = [0, 1].map(|axis| self.turn.column(axis).dot(direction));
        libm::atan2(along[1], along[0])
    }

    /// Whether one of its cells holds an exit direction.
    fn sees(&self, direction: &Vector3<f64>, cells: &[Cell], highest: f64) -> bool {
        if let (Some(stretch), [beam]) = (&self.stretch, self.beams.as_slice()) {
            let cell = &cells[*beam];
            return stretch.in_scan(direction).is_some_and(|[along, across]| {
                along.abs() <= 0.5 * cell.width && across.abs() <= cell.half_height
            });
        }
        let sin = self.sin_elevation(direction);
        if sin.abs() > highest {
            return false;
        }
        let beam = self.scan.nearest(self.azimuth(direction));
        beam.is_some_and(|beam| self.holds(beam) && libm::asin(sin).abs() <= cells[beam].half_height)
    }

    /// Whether one of its beams is within an angle, given by its sine and cosine, of an exit direction.
    fn is_near(&self, direction: &Vector3<f64>, sin_near: f64, cos_near: f64) -> bool {
        if let Some(stretch) = &self.stretch {
            return stretch.cos_to(direction) >= cos_near;
        }
        let sin = self.sin_elevation(direction);
        if sin.abs() > sin_near {
            return false;
        }
        // cos(angle) = cos(elevation)·cos(difference of azimuth).
        let reach = libm::acos((cos_near / (1.0 - sin * sin).sqrt()).min(1.0)) / self.scan.step();
        let (place, turn) = (self.scan.place(self.azimuth(direction)), TAU / self.scan.step());
        // What is near one end of the scan may be a turn away from it.
        [place - turn, place, place + turn]
            .into_iter()
            .any(|place| self.has_beams(place - reach, place + reach))
    }

    /// Whether it has beams between two places in the scan, in steps from beam 0.
    fn has_beams(&self, from: f64, to: f64) -> bool {
        let (first, last) = (from.ceil().max(0.0), to.floor());
        let last = last.min((self.scan.beams() - 1) as f64);
        if first > last {
            return false;
        }
        // Whole numbers within the scan.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let (first, last) = (first as usize, last as usize);
        self.below[last + 1] > self.below[first]
    }
}

/// Computes the combined coverage of all sequences.
pub(crate) fn field(sequences: &FacetSequences, cells: &[Cell], traced: &[&Traced]) -> Field {
    let highest = cells.iter().fold(0.0_f64, |h, c| h.max(libm::sin(c.half_height)));
    let seen_by = |(own, beam): &(usize, usize)| -> f64 {
        let (sequence, before) = (&sequences.0[*own], &sequences.0[..*own]);
        let seen = part_directions(&cells[*beam]).map(|(in_scan, weight)| {
            let (direction, weight) = sequence.out(&cells[*beam], &in_scan, weight);
            let counted = before.iter().any(|w| w.sees(&direction, cells, highest));
            if counted { 0.0 } else { weight }
        });
        seen.sum()
    };
    let all = sequences.0.iter().enumerate();
    let all: Vec<(usize, usize)> = all
        .flat_map(|(own, sequence)| sequence.beams.iter().map(move |beam| (own, *beam)))
        .collect();
    // Summed in order, so that the sum is the same on any number of threads.
    let seen: Vec<f64> = all.par_iter().with_min_len(AT_ONCE).map(seen_by).collect();
    let covered_sr = seen.iter().fold(0.0, |sum, seen| sum + seen);
    let direct = sequences.0.iter().filter(|sequence| sequence.facets.is_empty());
    let direct = direct.flat_map(|sequence| &sequence.beams);
    let direct_sr = direct.fold(0.0, |sum, beam| sum + cells[*beam].solid_angle());
    let seeing = || traced.iter().filter(|t| t.sees).filter_map(|t| exit(&t.chief));
    let elevations: Vec<f64> = seeing()
        .map(|v| libm::atan2(v.z, libm::hypot(v.x, v.y)).to_degrees())
        .collect();
    let azimuths = seeing().map(|v| libm::atan2(v.y, v.x).to_degrees());
    let low = elevations.iter().copied().fold(f64::INFINITY, f64::min);
    let high = elevations.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Field {
        covered_sr,
        direct_sr,
        near: near(sequences),
        elevation_deg: (low <= high).then_some([low, high]),
        elevation_covered_deg: covered(elevations.iter().copied(), 90.0),
        azimuth_covered_deg: covered(azimuths, 180.0),
    }
}

/// Returns the parts of a cell: each a direction in the scan and a solid angle; the solid angles sum to the cell's.
fn part_directions(cell: &Cell) -> impl Iterator<Item = (Vector3<f64>, f64)> {
    let [along, across] = PARTS;
    let (azimuth, top, cell_width) = (cell.azimuth, libm::sin(cell.half_height), cell.width);
    (0..across).flat_map(move |j| {
        // Slices of equal solid angle are slices of equal sine.
        let z = top * ((2 * j + 1) as f64 / across as f64 - 1.0);
        let radius = (1.0 - z * z).sqrt();
        (0..along).map(move |i| {
            let at = azimuth + cell_width * ((2 * i + 1) as f64 / (2 * along) as f64 - 0.5);
            let (sin, cos) = libm::sincos(at);
            let weight = 2.0 * top * cell_width / (along * across) as f64;
            (Vector3::new(radius * cos, radius * sin, z), weight)
        })
    })
}

/// Returns the share of all directions within [`NEAR_DEG`] of a beam, on a spiral of uniform density.
fn near(sequences: &FacetSequences) -> f64 {
    // π·(3 − √5): each turn of the spiral falls between the previous ones.
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    let (sin_near, cos_near) = libm::sincos(NEAR_DEG.to_radians());
    static DIRECTIONS: LazyLock<Vec<Vector3<f64>>> = LazyLock::new(|| {
        let direction = |k: usize| {
            let z = 1.0 - (2 * k + 1) as f64 / LATTICE as f64;
            let (sin, cos) = libm::sincos(GOLDEN_ANGLE * k as f64);
            let radius = (1.0 - z * z).sqrt();
            Vector3::new(radius * cos, radius * sin, z)
        };
        (0..LATTICE).map(direction).collect()
    });
    let is_near = |direction: &&Vector3<f64>| {
        sequences
            .0
            .iter()
            .any(|sequence| sequence.is_near(direction, sin_near, cos_near))
    };
    let directions = DIRECTIONS.par_iter().with_min_len(AT_ONCE);
    directions.filter(is_near).count() as f64 / LATTICE as f64
}

/// Returns the number of whole degrees between −limit and limit that contain a value.
fn covered(values: impl Iterator<Item = f64>, limit: f64) -> f64 {
    let degrees: std::collections::BTreeSet<i64> = values
        // Within ±180.
        .map(|v| {
            #[allow(clippy::cast_possible_truncation)]
            let degree = v.min(limit - 0.5).floor() as i64;
            degree
        })
        .collect();
    degrees.len() as f64
}
