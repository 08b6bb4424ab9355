//! The depth image of a layout: the range in the scene's room in all directions, and of each element.
//!
//! The image is synthetic, without noise or range errors: chief rays on exact surfaces. Boards are left out, since
//! every pose has another placement of them.

use super::drawing::Drawing;
use catoptric_cast::Ray;
use catoptric_model::{Pose, beam};
use catoptric_sim::trace::{Fate, Scenery, Tracer, Vertex};
use catoptric_sim::{Scene, SimError};
use nalgebra::{Point3, Unit, Vector3};
use rayon::prelude::*;

/// Number of directions along azimuth and along elevation: one every half degree.
const COLUMNS: usize = 720;
const ROWS: usize = 360;

/// Ranges from the scanner, in meters; `None` where no surface is hit.
#[derive(Debug, Clone, PartialEq)]
pub struct Depth {
    /// Number of directions along azimuth; the first is just below 180°, and they decrease.
    pub columns: usize,
    /// Number of directions along elevation; the first is just below 90°, and they decrease.
    pub rows: usize,
    /// Range of the room as seen from the scanner if the rig were not there, row by row.
    pub room_m: Vec<Option<f64>>,
    /// Range of each beam, by its number, along the path via the mirrors. `None` also for beams that do not leave.
    pub read_m: Vec<Option<f64>>,
}

impl Depth {
    /// Returns azimuth and elevation of the center of a cell, in radians.
    pub fn direction(&self, row: usize, column: usize) -> (f64, f64) {
        let middle = |i: usize, count: usize| (i as f64 + 0.5) / count as f64;
        (
            std::f64::consts::PI * (1.0 - 2.0 * middle(column, self.columns)),
            std::f64::consts::PI * (0.5 - middle(row, self.rows)),
        )
    }
}

/// Computes the depth image of a drawing in the room of its scene.
///
/// # Errors
/// As [`Scenery::room`].
pub fn depth(scene: &Scene, drawing: &Drawing) -> Result<Depth, SimError> {
    let scenery = Scenery::room(scene)?;
    let tracer = scenery.tracer(scene.superstructure.max_bounces as usize)?;
    let mut depth = Depth {
        columns: COLUMNS,
        rows: ROWS,
        room_m: Vec::new(),
        read_m: Vec::new(),
    };
    depth.room_m = (0..ROWS * COLUMNS)
        .into_par_iter()
        .map(|i| {
            let (azimuth, elevation) = depth.direction(i / COLUMNS, i % COLUMNS);
            let direction = beam::spherical(azimuth, elevation);
            range(&tracer, &drawing.room_from_sensor, &Point3::origin(), &direction)
        })
        .collect();
    let read = drawing.rays.iter().map(|ray| {
        let (last, exit) = (ray.points.last()?, ray.exit?);
        let before: f64 = ray.points.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
        Some(before + range(&tracer, &drawing.room_from_sensor, last, &exit)?)
    });
    depth.read_m = read.collect();
    Ok(depth)
}

/// Returns the length of a ray's path in the room, with reflections by the room's mirrors; the ray is in the sensor
/// frame.
fn range(
    tracer: &Tracer<'_>,
    room_from_sensor: &Pose,
    origin: &Point3<f64>,
    direction: &Unit<Vector3<f64>>,
) -> Option<f64> {
    let ray = Ray {
        origin: room_from_sensor * origin,
        direction: room_from_sensor * direction,
    };
    let mut vertices: Vec<Vertex> = Vec::new();
    match tracer.follow(&ray, &mut vertices) {
        Fate::Hit => vertices.last().map(|vertex| vertex.path),
        Fate::Escaped | Fate::Trapped => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the distance to the wall of an empty room whose frame is at the center of the floor.
    fn to_wall(size: &[f64; 3], from: &Point3<f64>, v: &Unit<Vector3<f64>>) -> f64 {
        let [x, y, z] = *size;
        let limits = [[-0.5 * x, 0.5 * x], [-0.5 * y, 0.5 * y], [0.0, z]];
        let along = |axis: usize| {
            let [low, high] = limits[axis];
            let limit = if v[axis] > 0.0 { high } else { low };
            if v[axis] == 0.0 {
                f64::INFINITY
            } else {
                (limit - from[axis]) / v[axis]
            }
        };
        (0..3).map(along).fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn all_ranges_are_those_to_the_walls() {
        let scene: Scene =
            toml::from_str(include_str!("../../../../scenes/prototype.toml")).expect("it is a scene");
        let drawing = Drawing::new(&scene, None).expect("it can be drawn");
        let found = depth(&scene, &drawing).expect("its room has walls");
        let room_from_sensor = drawing.room_from_sensor;
        let expected = |from: &Point3<f64>, v: &Unit<Vector3<f64>>| {
            to_wall(
                &scene.room.size_m,
                &(room_from_sensor * from),
                &(room_from_sensor * v),
            )
        };
        for (i, range) in found.room_m.iter().enumerate() {
            let (azimuth, elevation) = found.direction(i / COLUMNS, i % COLUMNS);
            let wall = expected(&Point3::origin(), &beam::spherical(azimuth, elevation));
            assert!(
                range.is_some_and(|r| (r - wall).abs() < 1e-9),
                "{azimuth} {elevation}"
            );
        }
        let (mut bent, mut lost) = (0, 0);
        for (ray, range) in drawing.rays.iter().zip(&found.read_m) {
            let Some(exit) = ray.exit else {
                assert_eq!(*range, None);
                lost += 1;
                continue;
            };
            let length: f64 = ray.points.windows(2).map(|p| (p[1] - p[0]).norm()).sum();
            bent += usize::from(!ray.facets.is_empty());
            let wall = length + expected(ray.points.last().expect("the scanner"), &exit);
            assert!(range.is_some_and(|r| (r - wall).abs() < 1e-9), "{}", ray.beam);
        }
        assert!(bent > 400 && lost > 20, "{bent} {lost}");
    }
}
