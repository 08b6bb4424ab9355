//! The geometry of a layout for drawing or building it: mirrors, posts, housing, the paths of all beams.

use super::field::{Cell, cells};
use super::footprint::{Footprint, Outlines};
use super::size::HOUSING;
use super::stretch::Stretch;
use super::traced::{Class, exit, trace};
use catoptric_cast::Triangle;
use catoptric_model::{Pose, ScanGeometry};
use catoptric_sim::build::room_from_rig;
use catoptric_sim::build::{BuiltFacet, Structure};
use catoptric_sim::light::{End, Mirrors, Setting};
use catoptric_sim::receive::Sensor;
use catoptric_sim::{Scene, SimError};
use nalgebra::{Point3, Unit, Vector3};

/// Mirrors, bodies and beams in the sensor frame, in meters.
#[derive(Debug, Clone)]
pub struct Drawing {
    /// Name of the scene.
    pub name: String,
    /// Pose of the scanner in the room.
    pub room_from_sensor: Pose,
    /// The mirrors.
    pub facets: Vec<BuiltFacet>,
    /// Posts and housing.
    pub parts: Vec<DrawnPart>,
    /// The path of every beam.
    pub rays: Vec<DrawnRay>,
    /// Footprints of beams on facets, in order of beam and bounce.
    pub footprints: Vec<Footprint>,
    /// The cell that every beam represents in the scan.
    pub cells: Vec<Cell>,
    /// How the scanner scans.
    pub scan: ScanGeometry,
}

/// An opaque body.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnPart {
    /// Name.
    pub name: String,
    /// Its closed surface.
    pub skin: Vec<Triangle>,
    /// Whether it belongs to the scanner.
    pub housing: bool,
}

/// The path of a beam's chief ray.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnRay {
    /// The beam.
    pub beam: usize,
    /// Class of the beam.
    pub class: Class,
    /// Facets hit, by their number.
    pub facets: Vec<usize>,
    /// The scanner, the points on mirrors, and the end on the structure if there is one.
    pub points: Vec<Point3<f64>>,
    /// Direction from the last point; `None` if the ray ends there.
    pub exit: Option<Unit<Vector3<f64>>>,
    /// How curved mirrors stretch its cell.
    pub stretch: Option<Stretch>,
}

impl Drawing {
    /// Traces the geometry of a scene as drawn, or as built under a seed.
    ///
    /// # Errors
    /// As [`analyze`](super::analyze).
    pub fn new(scene: &Scene, seed: Option<u64>) -> Result<Self, SimError> {
        let structure = match seed {
            None => Structure::nominal(scene)?,
            Some(seed) => Structure::as_built(scene, seed)?,
        };
        let sensor = Sensor::new(scene)?;
        let (rays, footprints) = {
            let setting = Setting::new(scene, &structure, Mirrors::Attached, Vec::new())?;
            let traced = trace(&sensor, &setting, scene);
            let rays = traced.iter().map(|t| {
                let mut points = vec![Point3::origin()];
                points.extend(t.chief.points());
                if let End::Hit(hit) = t.chief.end {
                    points.push(hit.point);
                }
                DrawnRay {
                    beam: t.beam,
                    class: t.class(),
                    facets: t.chief.facets().to_vec(),
                    points,
                    exit: exit(&t.chief),
                    stretch: Stretch::of(&structure, t.chief.facets(), sensor.scan().azimuth(t.beam)),
                }
            });
            let outlines = Outlines::new(&sensor, &structure);
            let footprints = traced.iter().flat_map(|t| outlines.of(t));
            (rays.collect(), footprints.collect())
        };
        Ok(Self {
            name: scene.name.clone(),
            room_from_sensor: room_from_rig(&scene.room) * structure.rig_from_sensor,
            rays,
            footprints,
            cells: cells(&sensor),
            scan: *sensor.scan(),
            parts: structure
                .parts
                .iter()
                .map(|part| DrawnPart {
                    name: part.name.clone(),
                    skin: part.shape.triangles(),
                    housing: part.name == HOUSING,
                })
                .collect(),
            facets: structure.facets,
        })
    }
}
