//! Where the boards stood, and what every beam reads of them without any error.

use super::structure::Mirror;
use catoptric_model::{BoardPlane, Deflection, Pose, PoseKind, PoseLabel, PoseRecord, Session, beam, range};
use catoptric_sim::truth::{BeamClass, TrueBeam};
use nalgebra::{Translation3, Unit, Vector3};

/// Boards of a facet: six around the fan's middle, each tilted another way.
pub(super) fn boards_of(mirror: &Mirror, room_from_sensor: &Pose) -> Vec<Pose> {
    let middle = 0.5 * (mirror.azimuth_deg[0] + mirror.azimuth_deg[1]);
    let azimuth = middle.to_radians();
    let deflection = mirror
        .plane
        .deflect(beam::direction(azimuth))
        .expect("it faces the scanner");
    let exit = deflection.exit_direction(azimuth);
    (0..6)
        .map(|k| {
            let turn = std::f64::consts::TAU * f64::from(k) / 6.0;
            let range = 0.9 + 0.15 * f64::from(k % 3);
            let point = deflection.deflection_point(azimuth) + exit.into_inner() * range;
            let (across, up) = catoptric_model::frame::tangent_basis(&exit);
            let tilt = across.into_inner() * turn.cos() + up.into_inner() * turn.sin();
            let normal = -exit.into_inner() + tilt * 0.8;
            let rotation = nalgebra::UnitQuaternion::rotation_between(&Vector3::z(), &normal)
                .expect("a board does not face straight down");
            room_from_sensor * Pose::from_parts(Translation3::from(point.coords), rotation)
        })
        .collect()
}

/// A stretch that nothing has been read in yet.
pub(super) fn record(
    pose: usize,
    kind: PoseKind,
    facet: Option<&str>,
    room_from_rig: Pose,
    board: Option<Pose>,
) -> PoseRecord {
    PoseRecord {
        label: PoseLabel {
            board: board.map(|_| "board".to_owned()),
            color: board.map(|_| "white".to_owned()),
            facet: facet.map(str::to_owned),
            ..PoseLabel::of(pose, kind, 2)
        },
        room_from_rig,
        room_from_board: board,
        motion: None,
        watched: Vec::new(),
        beams: beam::COUNT,
        ranges: Vec::new(),
    }
}

/// What a beam reads: the board it falls on, else the wall behind.
pub(super) fn reading(b: &TrueBeam, pose: &PoseRecord, session: &Session, room_from_sensor: &Pose) -> f64 {
    let deflection = match b.status {
        BeamClass::Blocked => return 0.06,
        BeamClass::Direct => Deflection::NONE,
        _ => b.deflection().expect("it is deflected"),
    };
    let azimuth = beam::azimuth(b.beam);
    let exit = deflection.exit_direction(azimuth);
    if let Some(room_from_board) = pose.room_from_board {
        let sensor_from_board = room_from_sensor.inverse() * room_from_board;
        let plane = BoardPlane::of_pose(&sensor_from_board);
        if let Some(r) = range::predict(&deflection, azimuth, &plane) {
            let hit = deflection.deflection_point(azimuth) + exit.into_inner() * (r - deflection.distance);
            let sheet = &session.boards[0];
            if sheet
                .outline()
                .contains(&(sensor_from_board.inverse() * hit), 0.0)
            {
                return r;
            }
        }
    }
    let origin = room_from_sensor * deflection.deflection_point(azimuth);
    let exit = Unit::new_unchecked(room_from_sensor * exit.into_inner());
    let wall = session.room.as_ref().and_then(|room| room.cast(&origin, &exit));
    wall.map_or(range::NO_RETURN, |(s, _)| deflection.distance + s)
}
