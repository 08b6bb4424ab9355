//! A board: its outline, its markers, and its pose in the room.

use crate::scene::{Board, Marker, Room, SensorTest};
use catoptric_cast::Ray;
use catoptric_model::frame::tangent_basis;
use catoptric_model::{Pose, Rectangle, beam};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Minimum distance between a board and the shell of the room, in meters.
const WALL_CLEARANCE: f64 = 0.03;

/// Outline of a board, in meters.
pub(crate) fn outline(board: &Board) -> Rectangle {
    Rectangle {
        width: board.width_mm * 1e-3,
        height: board.height_mm * 1e-3,
    }
}

/// Marker positions in the frame of their body, in meters.
pub(crate) fn points(markers: &[Marker]) -> Vec<Point3<f64>> {
    markers
        .iter()
        .map(|m| Point3::from(Vector3::from(m.position_mm) * 1e-3))
        .collect()
}

/// The board's own markers, or five placed asymmetrically near its edges.
pub(crate) fn board_markers(board: &Board) -> Vec<Marker> {
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

/// Pose of a board centered on a ray and tilted against it. Its x axis follows the fan as far as the tilt allows.
pub(crate) fn facing(ray: &Ray, fan: Vector3<f64>, distance: f64, tilt: f64, turn: f64) -> Pose {
    let (across, up) = tangent_basis(&ray.direction);
    let (sin_turn, cos_turn) = libm::sincos(turn);
    let (sin_tilt, cos_tilt) = libm::sincos(tilt);
    let sideways = across.into_inner() * cos_turn + up.into_inner() * sin_turn;
    let normal = Unit::new_normalize(sideways * sin_tilt - ray.direction.into_inner() * cos_tilt);
    attitude(ray.origin + ray.direction.into_inner() * distance, &normal, fan)
}

/// Pose of a board with a given center and normal, its x axis as close to `along` as possible.
pub(crate) fn attitude(center: Point3<f64>, normal: &Unit<Vector3<f64>>, along: Vector3<f64>) -> Pose {
    let flat = |v: Vector3<f64>| Unit::try_new(v - normal.into_inner() * normal.dot(&v), 1e-9);
    let x = flat(along).unwrap_or_else(|| tangent_basis(normal).0);
    let y = normal.cross(&x);
    let rotation =
        Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x.into_inner(), y, normal.into_inner()]));
    Pose::from_parts(
        Translation3::from(center.coords),
        UnitQuaternion::from_rotation_matrix(&rotation),
    )
}

/// Whether all corners of a board are inside the room, clear of its shell.
pub(crate) fn stands_in(board: &Board, room_from_board: &Pose, room: &Room) -> bool {
    let [x, y, z] = room.size_m;
    outline(board).corners().iter().all(|corner| {
        let p = room_from_board * corner;
        p.x.abs() <= 0.5 * x - WALL_CLEARANCE
            && p.y.abs() <= 0.5 * y - WALL_CLEARANCE
            && p.z >= WALL_CLEARANCE
            && p.z <= z - WALL_CLEARANCE
    })
}

/// Pose, in the room frame, of a board centered on the test's beam. Its x axis is as close to the scan direction as
/// possible.
pub(crate) fn before_beam(
    test: &SensorTest,
    range: f64,
    incidence_deg: f64,
    room_from_sensor: &Pose,
) -> Pose {
    let ray = Ray {
        origin: Point3::origin(),
        direction: beam::direction(test.azimuth_deg.to_radians()),
    };
    let (across, _) = tangent_basis(&ray.direction);
    room_from_sensor
        * facing(
            &ray,
            across.into_inner(),
            range,
            incidence_deg.to_radians(),
            test.direction_deg.to_radians(),
        )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_faces_its_ray_at_the_requested_tilt() {
        let ray = Ray {
            origin: Point3::new(0.1, 0.2, 1.5),
            direction: beam::spherical(1.0, 0.6),
        };
        for k in 0..7 {
            let pose = facing(&ray, Vector3::y(), 1.2, 0.7, f64::from(k));
            let normal = pose * Vector3::z();
            assert!((beam::angle_between(&Unit::new_normalize(-normal), &ray.direction) - 0.7).abs() < 1e-12);
            assert!(
                (pose.translation.vector - (ray.origin + ray.direction.into_inner() * 1.2).coords).norm()
                    < 1e-12
            );
        }
    }
}
