//! What a ray in the sensor frame hits: the board of the pose, or the known room.

use crate::readings::observations::{BoardInSensor, cone_half_angle};
use catoptric_model::{BoardPlane, Pose, Session, frame};
use nalgebra::{Point3, Unit, Vector3};

/// Disagreement that is always allowed, in meters: survey of the room, beam size, whole millimeters.
pub(crate) const AGREEMENT_FLOOR: f64 = 0.02;

/// A surface ahead of a ray, as far as it is known.
pub(crate) struct Ahead {
    pub(crate) distance: f64,
    pub(crate) plane: BoardPlane,
    /// Change of the range where part of the beam hits another surface, in meters: zero on one surface, the difference
    /// of two walls in a corner of the room, infinite at the edge of a board.
    pub(crate) spread: f64,
}

/// What a ray in the sensor frame hits, board or room, and the surface's color; `None` if no room is known.
pub(crate) fn ahead<'s>(
    session: &'s Session,
    room_from_sensor: &Pose,
    board: Option<&'s BoardInSensor>,
    origin: &Point3<f64>,
    direction: &Unit<Vector3<f64>>,
) -> Option<(Ahead, &'s str)> {
    let room = session.room.as_ref()?;
    let wall =
        |v: &Unit<Vector3<f64>>| room.cast(&(room_from_sensor * origin), &(room_from_sensor.rotation * v));
    let (distance, plane) = wall(direction)?;
    let cone = cone_half_angle(session);
    let path = origin.coords.norm();
    if let Some((board, hit)) = board.and_then(|b| Some((b, b.hit(origin, direction)?))) {
        let radius = cone * (path + hit.distance);
        // An edge of the board as well as its corners: covered by a margin of twice the spot outside.
        let near = board.holds(&hit, -2.0 * radius, -AGREEMENT_FLOOR);
        if near && hit.distance < distance {
            let whole = board.holds(&hit, radius, AGREEMENT_FLOOR);
            let ahead = Ahead {
                distance: hit.distance,
                plane: board.plane,
                spread: if whole { 0.0 } else { f64::INFINITY },
            };
            return Some((ahead, &board.color));
        }
    }
    let (across, up) = frame::tangent_basis(direction);
    let spread = [across, -across, up, -up].iter().fold(0.0, |spread: f64, side| {
        let near = Unit::new_normalize(direction.into_inner() + side.into_inner() * cone);
        match wall(&near) {
            Some((_, other)) if other.normal == plane.normal => spread,
            Some((there, _)) => spread.max((there - distance).abs()),
            None => f64::INFINITY,
        }
    });
    let sensor_from_room = room_from_sensor.inverse();
    let plane = BoardPlane::new(
        sensor_from_room * plane.point,
        Unit::new_unchecked(sensor_from_room.rotation * plane.normal.into_inner()),
    );
    let ahead = Ahead {
        distance,
        plane,
        spread,
    };
    Some((ahead, &room.color))
}
