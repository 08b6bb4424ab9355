//! Plans where the boards are placed: Cooper, steps 1 and 7 to 10, carried out on the drawing as a person would.
//!
//! Every facet's beams are divided into groups that one board can serve. In front of each group a board is set up in
//! several poses: its tilt direction rotates evenly, its tilt and distance vary, and it must be inside the room and
//! catch the whole group with some margin. The mirrors as built are not known here.

mod groups;
mod planned;
mod poses;
mod sensor_tests;

pub use groups::served_beams;
pub use planned::Planned;

use crate::build::board::attitude;
use crate::build::room::room_from_rig;
use crate::build::structure::{self, Structure};
use crate::error::SimError;
use crate::light::optics::{Mirrors, RayPath, Setting};
use crate::noise::{Draws, Purpose};
use crate::receive::reading::Sensor;
use crate::scene::{BoardPose, Design, Scene};
use catoptric_model::frame::tangent_basis;
use catoptric_model::{PoseKind, ScanGeometry};
use groups::{Group, direct_groups, facet_groups};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};
use planned::placement_error;
use poses::{place, place_at_random};

/// Plans the whole procedure: bare structure, empty room, tests of the bare sensor, boards in front of undeflected
/// beams, boards in front of every facet, flights.
///
/// # Errors
/// [`SimError::Placement`] for a board that fits nowhere, [`SimError::UnknownName`] for a pose that refers to an
/// unknown name.
pub fn plan(scene: &Scene, sensor: &Sensor, seed: u64) -> Result<Vec<Planned>, SimError> {
    let mut planned = procedure(scene, sensor, seed)?;
    let scan_period_s = sensor.scan().scan_period_s();
    planned.extend(scene.flight.iter().enumerate().map(|(index, flight)| Planned {
        kind: PoseKind::Flight,
        scans: flight.scans(scan_period_s),
        facet: None,
        beams: None,
        board: None,
        exact: false,
        test: None,
        flight: Some(index),
    }));
    Ok(planned)
}

/// Plans everything except flights.
fn procedure(scene: &Scene, sensor: &Sensor, seed: u64) -> Result<Vec<Planned>, SimError> {
    let structure = Structure::nominal(scene)?;
    let setting = Setting::new(scene, &structure, Mirrors::Attached, Vec::new())?;
    let room_from_sensor = room_from_rig(&scene.room) * structure::nominal_mount(scene);
    let paths: Vec<RayPath> = (0..sensor.scan().beams())
        .map(|b| sensor.chief_path(&setting, b))
        .collect();
    let experiment = &scene.experiment;
    let scans = experiment.scans_per_pose as usize;
    let without_board = |kind, scans: u32| Planned {
        kind,
        scans: scans as usize,
        facet: None,
        beams: None,
        board: None,
        exact: false,
        test: None,
        flight: None,
    };
    let mut planned = Vec::new();
    let drawn = &scene.superstructure;
    // With flights but no structure there is nothing to measure.
    let measured_otherwise = experiment.bare_distance_sd_mm.is_some();
    if !measured_otherwise && (scene.flight.is_empty() || !(drawn.facet.is_empty() && drawn.post.is_empty()))
    {
        planned.push(without_board(PoseKind::Bare, experiment.bare_scans));
    }
    if scene.room.has_walls() {
        planned.push(without_board(PoseKind::Room, experiment.room_scans));
    }
    planned.extend(sensor_tests::plan(scene, &room_from_sensor)?);
    if !experiment.pose.is_empty() {
        for (index, pose) in experiment.pose.iter().enumerate() {
            planned.push(given(scene, sensor.scan(), &paths, pose, index)?);
        }
        return Ok(planned);
    }
    if scene.board.is_empty() {
        return Ok(planned);
    }
    let scan = sensor.scan();
    let direct = direct_groups(
        &paths,
        scan,
        experiment.direct_poses as usize,
        experiment.group_span_deg,
    );
    for (index, [first, last]) in direct.into_iter().enumerate() {
        let group = Group::new(None, scan, [first, last], &paths, &room_from_sensor);
        let board = index % scene.board.len();
        let pose = place(&scene.board[board], &group, experiment, &scene.room, index, 0)
            .map_err(|reason| no_place(scene, board, &group, reason))?;
        planned.push(Planned {
            kind: PoseKind::Direct,
            scans,
            facet: None,
            beams: Some([first, last]),
            board: Some((board, pose)),
            exact: false,
            test: None,
            flight: None,
        });
    }
    for (number, (facet, first, last)) in facet_groups(
        &paths,
        scan,
        scene.superstructure.facet.len(),
        experiment.group_span_deg,
    )
    .into_iter()
    .enumerate()
    {
        let group = Group::new(Some(facet), scan, [first, last], &paths, &room_from_sensor);
        for index in 0..experiment.poses_per_group as usize {
            let board = index % scene.board.len();
            let sheet = &scene.board[board];
            let pose = match experiment.design {
                Design::Even => place(sheet, &group, experiment, &scene.room, index, number),
                Design::Random => place_at_random(sheet, &group, experiment, &scene.room, index, || {
                    Draws::new(seed, Purpose::Design, number as u64)
                }),
            }
            .map_err(|reason| no_place(scene, board, &group, reason))?;
            let exact = experiment.design == Design::Random;
            planned.push(Planned {
                kind: PoseKind::Facet,
                scans,
                facet: Some(facet),
                beams: Some([first, last]),
                board: Some((board, pose)),
                exact,
                test: None,
                flight: None,
            });
        }
    }
    Ok(planned)
}

fn no_place(scene: &Scene, board: usize, group: &Group, reason: String) -> SimError {
    let target = match group.facet {
        Some(facet) => format!("facet {:?}", scene.superstructure.facet[facet].name),
        None => format!("beams {} to {}", group.first, group.last),
    };
    placement_error(scene, board, target, reason)
}

/// A pose that the scene gives itself.
fn given(
    scene: &Scene,
    scan: &ScanGeometry,
    paths: &[RayPath],
    pose: &BoardPose,
    index: usize,
) -> Result<Planned, SimError> {
    let unknown = |what: String| SimError::UnknownName {
        by: format!("pose {index}"),
        what,
    };
    let board = scene.board.iter().position(|b| b.name == pose.board);
    let board = board.ok_or_else(|| unknown(format!("board {:?}", pose.board)))?;
    let facet = match &pose.facet {
        None => None,
        Some(name) => Some(
            scene
                .superstructure
                .facet
                .iter()
                .position(|f| f.name == *name)
                .ok_or_else(|| unknown(format!("facet {name:?}")))?,
        ),
    };
    let normal = Unit::try_new(Vector3::from(pose.normal), f64::MIN_POSITIVE)
        .ok_or_else(|| unknown("a normal of nonzero length".to_owned()))?;
    let center = Point3::from(Vector3::from(pose.center_m));
    let level = attitude(center, &normal, tangent_basis(&normal).0.into_inner());
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.turn_deg.to_radians());
    let beams = match facet {
        Some(facet) => served_beams(paths, scene.superstructure.facet.len(), scan)[facet],
        None => None,
    };
    Ok(Planned {
        kind: if facet.is_some() {
            PoseKind::Facet
        } else {
            PoseKind::Direct
        },
        scans: scene.experiment.scans_per_pose as usize,
        facet,
        beams,
        board: Some((board, level * turn)),
        exact: true,
        test: None,
        flight: None,
    })
}
