//! The room's walls, and the boards and bodies in it.

use crate::scene::{Board, Marker, Scene};
use catoptric_model::Rectangle;
use nalgebra::{Point3, Vector3};

/// A board's outline, in metres.
pub(super) fn outline(board: &Board) -> Rectangle {
    Rectangle {
        width: board.width_mm * 1e-3,
        height: board.height_mm * 1e-3,
    }
}

/// Places of markers in their body's frame, in metres.
pub(super) fn points(markers: &[Marker]) -> Vec<Point3<f64>> {
    markers
        .iter()
        .map(|m| Point3::from(Vector3::from(m.position_mm) * 1e-3))
        .collect()
}

/// A board's own markers, or five near its edges in no symmetry.
pub fn board_markers(board: &Board) -> Vec<Marker> {
    if !board.marker.is_empty() {
        return board.marker.clone();
    }
    let (x, y) = (0.5 * board.width_mm, 0.5 * board.height_mm);
    let places = [
        (-0.92, -0.9),
        (0.92, -0.85),
        (-0.88, 0.92),
        (0.9, 0.9),
        (0.35, 0.94),
    ];
    let names = ["P_p1", "P_p2", "P_p3", "P_p4", "P_p5"];
    let place = |(fx, fy): (f64, f64)| [fx * x, fy * y, 0.0];
    names
        .iter()
        .zip(places)
        .map(|(name, at)| Marker {
            name: (*name).to_owned(),
            position_mm: place(at),
        })
        .collect()
}

/// Names of the two walls of each axis.
const WALLS: [[&str; 2]; 3] = [
    ["-x wall", "+x wall"],
    ["-y wall", "+y wall"],
    ["floor", "ceiling"],
];

/// Names and corners of walls, floor and ceiling in the room frame, each counter-clockwise seen from inside.
pub(super) fn walls(scene: &Scene) -> Vec<(&'static str, Vec<Point3<f64>>)> {
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
            // The axes a, b, axis are right-handed: this order faces along +axis, into the room from the low side.
            if !inwards {
                corners.reverse();
            }
            walls.push((WALLS[axis][usize::from(!inwards)], corners));
        }
    }
    walls
}
