//! Footprints: the 1/e² contour of a beam on each facet that its chief ray hits, and its distance from the facet's
//! edges.
//!
//! The rays of the contour are reflected by the chief ray's facets as if those were unbounded, so that the
//! outline of a footprint is complete even where an edge cuts it, and its margin is then negative. Glass moves a
//! footprint by less than its own thickness; this is neglected.

use super::traced::Traced;
use catoptric_cast::Polygon;
use catoptric_cast::Ray;
use catoptric_model::mirror;
use catoptric_sim::build::{BuiltFacet, Structure};
use catoptric_sim::light::footprint::{SubRay, ray};
use catoptric_sim::receive::Sensor;
use nalgebra::{Point3, Vector3};

/// Number of rays of a contour.
pub const OUTLINE: usize = 16;

/// Shortest distance to a curved surface that a ray does not just leave, in meters.
const LEAVES: f64 = 1e-9;

/// The footprint of a beam on a facet.
#[derive(Debug, Clone, PartialEq)]
pub struct Footprint {
    /// The beam.
    pub beam: usize,
    /// Number of the facet.
    pub facet: usize,
    /// Number of facets hit before it.
    pub bounce: usize,
    /// Point where the chief ray hits it, in the sensor frame, in meters.
    pub center: Point3<f64>,
    /// Points where the rays of the contour hit it.
    pub outline: [Point3<f64>; OUTLINE],
    /// Minimum distance from the contour to an edge, in millimeters; negative beyond it.
    pub margin_mm: f64,
    /// Minimum distance from the contour to the edges above and below, those that are more parallel to the scan's line
    /// on the facet than perpendicular; `None` without such an edge.
    pub across_mm: Option<f64>,
    /// Distance between neighboring beams on the facet, in millimeters.
    pub spacing_mm: f64,
    /// `margin_mm` over `spacing_mm`.
    pub margin_beams: f64,
}

/// The inputs of footprints: the contour of a beam, and the edges of the facets.
pub(crate) struct Outlines<'a> {
    sensor: &'a Sensor,
    structure: &'a Structure,
    contour: [SubRay; OUTLINE],
    edges: Vec<Vec<Edge>>,
}

impl<'a> Outlines<'a> {
    pub(crate) fn new(sensor: &'a Sensor, structure: &'a Structure) -> Self {
        Self {
            sensor,
            structure,
            contour: std::array::from_fn(|k| {
                let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / OUTLINE as f64);
                SubRay {
                    wide: cos,
                    narrow: sin,
                    weight: 0.0,
                }
            }),
            edges: structure.facets.iter().map(|f| edges(&f.face)).collect(),
        }
    }

    /// Returns the footprints of a beam, in order of the bounces.
    pub(crate) fn of(&self, traced: &Traced) -> Vec<Footprint> {
        let facets = traced.chief.facets();
        if facets.is_empty() {
            return Vec::new();
        }
        let (beam, shape) = (traced.beam, self.sensor.shape());
        let chief = SubRay {
            wide: 0.0,
            narrow: 0.0,
            weight: 1.0,
        };
        let azimuth = self.sensor.scan().azimuth(beam);
        let mut rays: [Ray; OUTLINE] = std::array::from_fn(|k| ray(shape, azimuth, &self.contour[k]));
        let mut center = ray(shape, azimuth, &chief);
        let mut neighbor = ray(shape, azimuth + self.sensor.scan().step(), &chief);
        let of_bounce = |(bounce, &facet): (usize, &usize)| {
            let face = &self.structure.facets[facet];
            for ray in rays.iter_mut().chain([&mut center, &mut neighbor]) {
                *ray = reflected(ray, face);
            }
            let outline = rays.map(|r| r.origin);
            let step = neighbor.origin - center.origin;
            let margin = |edge: &Edge| {
                let each = outline.iter().map(|p| edge.inwards.dot(&p.coords) - edge.offset);
                1e3 * each.fold(f64::INFINITY, f64::min)
            };
            let along = step.normalize();
            let edges = &self.edges[facet];
            let beside = edges
                .iter()
                .filter(|e| e.inwards.dot(&along).abs() < std::f64::consts::FRAC_1_SQRT_2);
            let margin_mm = edges.iter().map(margin).fold(f64::INFINITY, f64::min);
            let spacing_mm = 1e3 * step.norm();
            Footprint {
                beam,
                facet,
                bounce,
                center: center.origin,
                outline,
                margin_mm,
                across_mm: beside.map(margin).reduce(f64::min),
                spacing_mm,
                margin_beams: margin_mm / spacing_mm,
            }
        };
        facets.iter().enumerate().map(of_bounce).collect()
    }
}

/// An edge of a polygon: the in-plane unit vector that points inward, and its product with the edge's points.
struct Edge {
    inwards: Vector3<f64>,
    offset: f64,
}

fn edges(face: &Polygon) -> Vec<Edge> {
    let corners = face.corners.iter();
    let next = face.corners.iter().cycle().skip(1);
    corners
        .zip(next)
        .filter_map(|(a, b)| {
            let inwards = face.normal.cross(&(b - a)).try_normalize(f64::MIN_POSITIVE)?;
            Some(Edge {
                offset: inwards.dot(&a.coords),
                inwards,
            })
        })
        .collect()
}

/// Reflects a ray in the unbounded plane or surface of a facet; one that misses a curved surface, in the plane that it
/// touches.
pub(super) fn reflected(ray: &Ray, facet: &BuiltFacet) -> Ray {
    if let Some(bent) = &facet.bent {
        let surface = &bent.face.surface;
        let ahead = surface.roots(&ray.origin, &ray.direction).into_iter().flatten();
        if let Some(distance) = ahead.into_iter().find(|t| *t > LEAVES) {
            let origin = ray.origin + ray.direction.into_inner() * distance;
            let direction = mirror::reflect(&ray.direction, &surface.normal_at(&origin));
            return Ray { origin, direction };
        }
    }
    let face = &facet.face;
    let closing = face.normal.dot(&ray.direction);
    let distance = face.normal.dot(&(face.origin - ray.origin)) / closing;
    Ray {
        origin: ray.origin + ray.direction.into_inner() * distance,
        direction: mirror::reflect(&ray.direction, &face.normal),
    }
}
