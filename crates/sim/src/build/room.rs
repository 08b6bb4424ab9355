//! The room: the pose of the rig in it, and its walls.

use crate::scene::{Room, Scene};
use catoptric_model::Pose;
use catoptric_model::frame::yaw_pitch_roll;
use nalgebra::{Point3, Translation3, Vector3};

/// Pose of the rig in the room.
pub fn room_from_rig(room: &Room) -> Pose {
    Pose::from_parts(
        Translation3::from(Vector3::from(room.rig_position_m)),
        yaw_pitch_roll(room.rig_yaw_deg.to_radians(), 0.0, 0.0),
    )
}

/// Names of the two walls of each axis.
const WALLS: [[&str; 2]; 3] = [
    ["-x wall", "+x wall"],
    ["-y wall", "+y wall"],
    ["floor", "ceiling"],
];

/// Names and corners of walls, floor and ceiling in the room frame; each outline is counter-clockwise seen from inside.
pub(crate) fn walls(scene: &Scene) -> Vec<(&'static str, Vec<Point3<f64>>)> {
    let [x, y, z] = scene.room.size_m;
    let (low, high) = (
        Vector3::new(-0.5 * x, -0.5 * y, 0.0),
        Vector3::new(0.5 * x, 0.5 * y, z),
    );
    let mut walls = Vec::new();
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        for (at, inwards) in [(low[axis], true), (high[axis], false)] {
            let corner = |pa: f64, pb: f64| {
                let mut p = Vector3::zeros();
                (p[axis], p[a], p[b]) = (at, pa, pb);
                Point3::from(p)
            };
            let mut corners = vec![
                corner(low[a], low[b]),
                corner(high[a], low[b]),
                corner(high[a], high[b]),
                corner(low[a], high[b]),
            ];
            // The axes a, b, axis are right-handed: on the low side, this order faces along +axis, into the room.
            if !inwards {
                corners.reverse();
            }
            walls.push((WALLS[axis][usize::from(!inwards)], corners));
        }
    }
    walls
}
