//! Checks of room and procedure: whether everything fits in the room, and whether beams hit the boards.

use super::outline::{Meets, Obstacles, nominal_room_from_sensor};
use crate::build::board::{before_beam, stands_in};
use crate::findings::{Findings, suggestion};
use crate::scene::facet::outline::{reach, rounded};
use crate::scene::{Board, BoardPose, Scene, SensorTest};
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::place::KeyPath;
use catoptric_model::{BoardPlane, Pose, Rectangle, ScanGeometry, beam};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Names of the two walls of each axis.
const WALLS: [[&str; 2]; 3] = [
    ["-x wall", "+x wall"],
    ["-y wall", "+y wall"],
    ["floor", "ceiling"],
];

pub(super) fn check(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let before = found.0.len();
    // A flight has the rig elsewhere.
    if !scene.only_flies() {
        check_rig(scene, scan, found);
    }
    let rig_has_its_place = found.0.len() == before;
    check_boards(scene, found);
    let obstacles = Obstacles::of(scene, scan);
    let met = obstacles.met_by_beams();
    let bench = Bench {
        scene,
        scan,
        room_from_sensor: nominal_room_from_sensor(scene),
        obstacles,
        met,
    };
    for (i, pose) in scene.experiment.pose.iter().enumerate() {
        bench.check_pose(
            pose,
            &KeyPath::of("experiment").key("pose").index(i),
            rig_has_its_place,
            found,
        );
    }
    for (i, test) in scene.experiment.test.iter().enumerate() {
        bench.check_test(
            test,
            &KeyPath::of("experiment").key("test").index(i),
            rig_has_its_place,
            found,
        );
    }
    let chosen = scene.experiment.pose.is_empty() && scene.experiment.direct_poses > 0;
    if chosen && !scene.board.is_empty() && bench.met.iter().all(Option::is_some) {
        found.add(
            &KeyPath::of("experiment").key("direct_poses"),
            format_args!(
                "asks for {} boards in front of undeflected beams, but there is no such beam",
                scene.experiment.direct_poses
            ),
            "set it to 0, or leave part of the scan free".to_owned(),
        );
    }
}

fn check_rig(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let room = &scene.room;
    let path = KeyPath::of("room").key("rig_position_m");
    let rig = Point3::from(Vector3::from(room.rig_position_m));
    if let Some((wall, beyond)) = outside(&rig, &room.size_m) {
        found.add(
            &path,
            format_args!("puts the rig {} m beyond the {wall}", rounded(beyond)),
            room_extent(&room.size_m),
        );
        return;
    }
    let room_from_sensor = nominal_room_from_sensor(scene);
    let sensor = room_from_sensor * Point3::origin();
    if let Some((wall, beyond)) = outside(&sensor, &room.size_m) {
        found.add(
            &path,
            format_args!(
                "and `scanner.mount.position_mm` put the sensor {} m beyond the {wall}",
                rounded(beyond)
            ),
            room_extent(&room.size_m),
        );
        return;
    }
    for (i, facet) in scene.superstructure.facet.iter().enumerate() {
        let corners = facet.shape.corners(scan).unwrap_or_default();
        let beyond = corners
            .iter()
            .find_map(|c| outside(&(room_from_sensor * c), &room.size_m));
        if let Some((wall, beyond)) = beyond {
            found.add(
                &KeyPath::of("superstructure").key("facet").index(i),
                format_args!("has a corner {} m beyond the {wall}", rounded(beyond)),
                room_extent(&room.size_m),
            );
        }
    }
}

fn check_boards(scene: &Scene, found: &mut Findings) {
    if scene.board.is_empty() && !scene.only_flies() {
        let experiment = &scene.experiment;
        if scene.superstructure.facet.is_empty() {
            found.add(
                &KeyPath::of("board"),
                "is empty and so is `superstructure.facet`: there would be nothing to record",
                "add a table [[board]], [[superstructure.facet]] or [[flight]]".to_owned(),
            );
        } else if experiment.pose.is_empty() {
            found.add(
                &KeyPath::of("board"),
                "is empty; the experiment needs at least 1 board to place",
                "add a table [[board]] with name, width_mm and height_mm".to_owned(),
            );
        }
    }
    for (i, board) in scene.board.iter().enumerate() {
        let half = [0.5 * board.width_mm, 0.5 * board.height_mm];
        for (m, marker) in board.marker.iter().enumerate() {
            let [x, y, _] = marker.position_mm;
            if x.abs() > half[0] || y.abs() > half[1] {
                found.add(
                    &KeyPath::of("board")
                        .index(i)
                        .key("marker")
                        .index(m)
                        .key("position_mm"),
                    format_args!(
                        "is ({x}, {y}) mm, off the board, which reaches ±{} mm by ±{} mm",
                        half[0], half[1]
                    ),
                    None,
                );
            }
        }
    }
}

/// The wall that a point is beyond, and by how much.
pub(super) fn outside(point: &Point3<f64>, size_m: &[f64; 3]) -> Option<(&'static str, f64)> {
    let low = [-0.5 * size_m[0], -0.5 * size_m[1], 0.0];
    (0..3).find_map(|axis| {
        let under = low[axis] - point[axis];
        let over = point[axis] - (low[axis] + size_m[axis]);
        let side = usize::from(over > under);
        let beyond = under.max(over);
        (beyond > 0.0).then(|| (WALLS[axis][side], beyond))
    })
}

pub(super) fn room_extent(size_m: &[f64; 3]) -> String {
    let [x, y, z] = *size_m;
    format!(
        "the room reaches from ({}, {}, 0) m to ({}, {}, {z}) m; its origin is the center of the floor",
        -0.5 * x,
        -0.5 * y,
        0.5 * x,
        0.5 * y
    )
}

/// The pose of a board as the scene gives it; `None` for a zero-length normal.
fn room_from_board(pose: &BoardPose) -> Option<Pose> {
    let normal = Unit::try_new(Vector3::from(pose.normal), f64::MIN_POSITIVE)?;
    // On a horizontal board every direction is horizontal; use x.
    let across = Unit::try_new(Vector3::z().cross(&normal), 1e-9).unwrap_or(Vector3::x_axis());
    let axes = Matrix3::from_columns(&[across.into_inner(), normal.cross(&across), normal.into_inner()]);
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let turn = yaw_pitch_roll(pose.turn_deg.to_radians(), 0.0, 0.0);
    Some(Pose::from_parts(
        Translation3::from(Vector3::from(pose.center_m)),
        rotation * turn,
    ))
}

/// The experiment as drawn.
struct Bench<'a> {
    scene: &'a Scene,
    scan: &'a ScanGeometry,
    room_from_sensor: Pose,
    obstacles: Obstacles,
    met: Vec<Option<Meets>>,
}

impl Bench<'_> {
    fn check_pose(&self, pose: &BoardPose, path: &KeyPath, place: bool, found: &mut Findings) {
        let scene = self.scene;
        let boards = scene.board.iter().map(|b| b.name.as_str());
        let board = scene.board.iter().find(|b| b.name == pose.board);
        if board.is_none() {
            found.add(
                &path.key("board"),
                format_args!("is {:?}; there is no such board", pose.board),
                suggestion(&pose.board, "boards", boards),
            );
        }
        let facets = &scene.superstructure.facet;
        let facet = pose
            .facet
            .as_ref()
            .map(|name| facets.iter().position(|f| f.name == *name).ok_or(name));
        if let Some(Err(name)) = facet {
            found.add(
                &path.key("facet"),
                format_args!("is {name:?}; there is no such facet"),
                suggestion(name, "facets", facets.iter().map(|f| f.name.as_str())),
            );
        }
        let Some(room_from_board) = room_from_board(pose) else {
            let path = path.key("normal");
            found.add(
                &path,
                "has length 0; a normal of any other length is allowed",
                None,
            );
            return;
        };
        let Some(board) = board else { return };
        let outline = rectangle(board);
        let beyond = outline
            .corners()
            .iter()
            .filter_map(|c| outside(&(room_from_board * c), &scene.room.size_m))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((wall, beyond)) = beyond {
            found.add(
                &path.key("center_m"),
                format_args!(
                    "puts a corner of board {:?} {} m beyond the {wall}",
                    board.name,
                    rounded(beyond)
                ),
                room_extent(&scene.room.size_m),
            );
            return;
        }
        if !place {
            return;
        }
        let sensor_from_board = self.room_from_sensor.inverse() * room_from_board;
        match facet {
            None => self.check_direct(&outline, &sensor_from_board, path, found),
            Some(Ok(facet)) => self.check_in_fan(facet, &outline, &sensor_from_board, path, found),
            Some(Err(_)) => {}
        }
    }

    /// Checks boards in front of one beam of the bare sensor.
    fn check_test(&self, test: &SensorTest, path: &KeyPath, place: bool, found: &mut Findings) {
        let scene = self.scene;
        let mut boards = Vec::new();
        for (i, name) in test.board.iter().enumerate() {
            match scene.board.iter().find(|b| b.name == *name) {
                Some(board) => boards.push(board),
                None => found.add(
                    &path.key("board").index(i),
                    format_args!("is {name:?}; there is no such board"),
                    suggestion(name, "boards", scene.board.iter().map(|b| b.name.as_str())),
                ),
            }
        }
        if !place {
            return;
        }
        let beam = self.scan.nearest(test.azimuth_deg.to_radians());
        if beam.is_none() {
            found.add(
                &path.key("azimuth_deg"),
                format_args!("is {}°; {}", test.azimuth_deg, reach(self.scan)),
                None,
            );
            return;
        }
        if let Some(met) = beam.and_then(|b| self.met[b]) {
            let what = match met {
                Meets::Facet(facet) => format!("facet {:?}", scene.superstructure.facet[facet].name),
                _ => "the structure".to_owned(),
            };
            found.add(
                &path.key("azimuth_deg"),
                format_args!("is {}°, where the beam hits {what}", test.azimuth_deg),
                "a test of the bare sensor needs an undeflected beam".to_owned(),
            );
            return;
        }
        for (i, &range) in test.range_m.iter().enumerate() {
            let too_wide = boards.iter().find_map(|board| {
                let fits = |incidence: &f64| {
                    let pose = before_beam(test, range, *incidence, &self.room_from_sensor);
                    stands_in(board, &pose, &scene.room)
                };
                let incidence = test.incidence_deg.iter().find(|incidence| !fits(incidence))?;
                Some((board, incidence))
            });
            if let Some((board, incidence)) = too_wide {
                found.add(
                    &path.key("range_m").index(i),
                    format_args!(
                        "is {range} m, where board {:?} at {incidence}° would reach through a wall, floor or ceiling",
                        board.name
                    ),
                    room_extent(&scene.room.size_m),
                );
            }
        }
    }

    /// Checks a board in front of undeflected beams.
    fn check_direct(
        &self,
        outline: &Rectangle,
        sensor_from_board: &Pose,
        path: &KeyPath,
        found: &mut Findings,
    ) {
        let center = sensor_from_board.translation.vector;
        let azimuth = libm::atan2(center.y, center.x).to_degrees();
        if self.scan.nearest(azimuth.to_radians()).is_none() {
            found.add(
                &path.key("center_m"),
                format_args!(
                    "puts the board behind the sensor: at azimuth {}°, {}",
                    rounded(azimuth),
                    reach(self.scan)
                ),
                self.forward_help(),
            );
            return;
        }
        if shows_its_back(sensor_from_board, &Point3::origin()) {
            self.add_back(path, "the sensor", found);
            return;
        }
        let direct = self.met.iter().enumerate().filter(|(_, met)| met.is_none());
        let mut rays = direct.map(|(i, _)| (Point3::origin(), beam::direction(self.scan.azimuth(i))));
        if !rays.any(|(origin, v)| meets(outline, sensor_from_board, &origin, &v)) {
            found.add(
                &path.key("center_m"),
                format_args!(
                    "puts the board where no undeflected beam hits it: at azimuth {}°, {} m {} the scan plane",
                    rounded(azimuth),
                    rounded(center.z.abs()),
                    if center.z < 0.0 { "below" } else { "above" }
                ),
                "name the `facet` if the board is in the fan of a mirror".to_owned(),
            );
        }
    }

    /// Checks a board in the fan of a facet.
    fn check_in_fan(
        &self,
        facet: usize,
        outline: &Rectangle,
        sensor_from_board: &Pose,
        path: &KeyPath,
        found: &mut Findings,
    ) {
        let Some(face) = &self.obstacles.facets[facet] else {
            return;
        };
        let rays: Vec<(Point3<f64>, Unit<Vector3<f64>>)> = (0..self.scan.beams())
            .filter(|i| self.met[*i] == Some(Meets::Facet(facet)))
            .filter_map(|i| {
                let azimuth = self.scan.azimuth(i);
                let deflection = face.deflect(&beam::direction(azimuth))?;
                Some((
                    deflection.deflection_point(azimuth),
                    deflection.exit_direction(azimuth),
                ))
            })
            .collect();
        // A facet without beams is already reported by the checks of the structure.
        let Some((origin, v)) = rays.get(rays.len() / 2) else {
            return;
        };
        let center = Point3::from(sensor_from_board.translation.vector);
        let name = &self.scene.superstructure.facet[facet].name;
        let ahead = (center - origin).dot(v);
        let fan_at = self.room_from_sensor * (origin + v.into_inner() * ahead.max(1.0));
        let help = format!(
            "the middle of the fan passes through ({}, {}, {}) m in the room",
            rounded(fan_at.x),
            rounded(fan_at.y),
            rounded(fan_at.z)
        );
        if ahead <= 0.0 {
            found.add(
                &path.key("center_m"),
                format_args!("puts the board behind facet {name:?}: the fan points away from it"),
                help,
            );
        } else if shows_its_back(sensor_from_board, origin) {
            self.add_back(path, &format!("facet {name:?}"), found);
        } else if !rays.iter().any(|(o, v)| meets(outline, sensor_from_board, o, v)) {
            found.add(
                &path.key("center_m"),
                format_args!("puts the board where no beam of facet {name:?} hits it"),
                help,
            );
        }
    }

    fn add_back(&self, path: &KeyPath, seen_from: &str, found: &mut Findings) {
        found.add(
            &path.key("normal"),
            format_args!("turns the back of the board to {seen_from}"),
            "reverse the normal: it points from the board's face into the room".to_owned(),
        );
    }

    fn forward_help(&self) -> String {
        let v = self.room_from_sensor * Vector3::x();
        let sensor = self.room_from_sensor.translation.vector;
        format!(
            "the sensor is at ({}, {}, {}) m and looks along ({}, {}, 0)",
            rounded(sensor.x),
            rounded(sensor.y),
            rounded(sensor.z),
            rounded(v.x),
            rounded(v.y)
        )
    }
}

fn rectangle(board: &Board) -> Rectangle {
    Rectangle {
        width: board.width_mm * 1e-3,
        height: board.height_mm * 1e-3,
    }
}

fn shows_its_back(sensor_from_board: &Pose, seen_from: &Point3<f64>) -> bool {
    (sensor_from_board.inverse() * seen_from).z < 0.0
}

fn meets(
    outline: &Rectangle,
    sensor_from_board: &Pose,
    origin: &Point3<f64>,
    v: &Unit<Vector3<f64>>,
) -> bool {
    let plane = BoardPlane::of_pose(sensor_from_board);
    plane.distance_along(origin, v).is_some_and(|s| {
        let point = origin + v.into_inner() * s;
        outline.contains(&(sensor_from_board.inverse() * point), 0.0)
    })
}
