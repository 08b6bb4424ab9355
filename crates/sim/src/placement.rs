//! Where the boards are put: Cooper, steps 7 to 10, carried out on the drawing as a person would.
//!
//! Every facet's beams are divided into groups that one board can serve. Before each group a board is set up in
//! several poses: its tilt direction goes round evenly, its tilt and its distance vary, and it must stand in the room
//! and catch the whole group with some margin. The mirrors as built are not known here.

use crate::error::SimError;
use crate::footprint::Ray;
use crate::optics::{End, Mirrors, Path, Setting};
use crate::reading::Sensor;
use crate::scene::{Board, BoardPose, Experiment, Room, Scene};
use crate::structure::{self, Structure};
use catoptric_model::frame::{tangent_basis, yaw_pitch_roll};
use catoptric_model::{Pose, PoseKind, Rectangle, beam};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// A stretch as it is meant to be recorded.
#[derive(Debug, Clone)]
pub struct Planned {
    /// What it is for.
    pub kind: PoseKind,
    /// Scans.
    pub scans: usize,
    /// Facet in whose fan the board stands, by its index.
    pub facet: Option<usize>,
    /// First and last beam it is set up for.
    pub beams: Option<[usize; 2]>,
    /// The board, by its index, and where it is meant to stand.
    pub board: Option<(usize, Pose)>,
}

/// Beams that one board serves.
struct Group {
    facet: Option<usize>,
    first: usize,
    last: usize,
    /// The rays that leave towards the board, in the room frame, of every beam of the group.
    rays: Vec<Ray>,
}

/// Least distance between a board and the shell of the room, in metres.
const WALL_CLEARANCE: f64 = 0.03;
/// Least distance between a board and the mirror it stands before, in metres.
const LEAST_RANGE: f64 = 0.4;
/// Part of a board's edge that no beam of its group should come near, in metres, and its growth with distance: beams
/// leave up to a few degrees off the drawing.
const EDGE_MARGIN: (f64, f64) = (0.02, 0.05);
/// Narrowest undeflected sector in which a board is set up, in radians.
const LEAST_SECTOR: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// Where rig and nominal sensor stand in the room.
pub fn room_from_rig(room: &Room) -> Pose {
    Pose::from_parts(
        Translation3::from(Vector3::from(room.rig_position_m)),
        yaw_pitch_roll(room.rig_yaw_deg.to_radians(), 0.0, 0.0),
    )
}

/// The whole procedure: bare structure, empty room, boards before undeflected beams, boards before every facet.
///
/// # Errors
/// [`SimError::Placement`] where a board fits nowhere, [`SimError::UnknownName`] for a pose that refers to nothing.
pub fn plan(scene: &Scene, sensor: &Sensor) -> Result<Vec<Planned>, SimError> {
    let structure = Structure::nominal(scene)?;
    let setting = Setting::new(scene, &structure, Mirrors::Attached, Vec::new())?;
    let room_from_sensor = room_from_rig(&scene.room) * structure::nominal_mount(scene);
    let paths: Vec<Path> = (0..beam::COUNT).map(|b| sensor.chief_path(&setting, b)).collect();
    let experiment = &scene.experiment;
    let scans = experiment.scans_per_pose as usize;
    let without_board = |kind, scans: u32| Planned {
        kind,
        scans: scans as usize,
        facet: None,
        beams: None,
        board: None,
    };
    let mut planned = vec![
        without_board(PoseKind::Bare, experiment.bare_scans),
        without_board(PoseKind::Room, experiment.room_scans),
    ];
    if !experiment.pose.is_empty() {
        for (index, pose) in experiment.pose.iter().enumerate() {
            planned.push(given(scene, &paths, pose, index)?);
        }
        return Ok(planned);
    }
    if scene.board.is_empty() {
        return Ok(planned);
    }
    let direct = direct_groups(
        &paths,
        experiment.direct_poses as usize,
        experiment.group_span_deg,
    );
    for (index, [first, last]) in direct.into_iter().enumerate() {
        let group = Group::new(None, first, last, &paths, &room_from_sensor);
        let board = index % scene.board.len();
        let pose = place(&scene.board[board], &group, experiment, &scene.room, index, 0)
            .map_err(|reason| no_place(scene, board, &group, reason))?;
        planned.push(Planned {
            kind: PoseKind::Direct,
            scans,
            facet: None,
            beams: Some([first, last]),
            board: Some((board, pose)),
        });
    }
    for (number, (facet, first, last)) in facet_groups(
        &paths,
        scene.superstructure.facet.len(),
        experiment.group_span_deg,
    )
    .into_iter()
    .enumerate()
    {
        let group = Group::new(Some(facet), first, last, &paths, &room_from_sensor);
        for index in 0..experiment.poses_per_group as usize {
            let board = index % scene.board.len();
            let pose = place(
                &scene.board[board],
                &group,
                experiment,
                &scene.room,
                index,
                number,
            )
            .map_err(|reason| no_place(scene, board, &group, reason))?;
            planned.push(Planned {
                kind: PoseKind::Facet,
                scans,
                facet: Some(facet),
                beams: Some([first, last]),
                board: Some((board, pose)),
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
    SimError::Placement {
        board: scene.board[board].name.clone(),
        target,
        reason,
    }
}

/// The facet that a chief ray leaves by, if it leaves by one alone.
fn leaves_by(path: &Path) -> Option<usize> {
    match (path.end, path.facets()) {
        (End::Escaped, &[facet]) => Some(facet),
        _ => None,
    }
}

/// First and last beam of every facet in the drawing.
pub fn served_beams(paths: &[Path], facets: usize) -> Vec<Option<[usize; 2]>> {
    (0..facets)
        .map(|facet| {
            let mut served = (0..paths.len()).filter(|&b| leaves_by(&paths[b]) == Some(facet));
            let first = served.next()?;
            Some([first, served.next_back().unwrap_or(first)])
        })
        .collect()
}

/// Each facet's beams, cut into equal groups no wider than the span.
fn facet_groups(paths: &[Path], facets: usize, span_deg: f64) -> Vec<(usize, usize, usize)> {
    let mut groups = Vec::new();
    for (facet, served) in served_beams(paths, facets).into_iter().enumerate() {
        let Some([first, last]) = served else { continue };
        for [first, last] in cut(first, last, span_deg) {
            groups.push((facet, first, last));
        }
    }
    groups
}

/// A run of beams cut into the fewest equal pieces no wider than the span.
fn cut(first: usize, last: usize, span_deg: f64) -> Vec<[usize; 2]> {
    let beams = last - first + 1;
    let span = span_deg.to_radians() / beam::STEP;
    // Both are small positive numbers.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let pieces = ((beams as f64 / span).ceil() as usize).clamp(1, beams);
    (0..pieces)
        .map(|k| [first + beams * k / pieces, first + beams * (k + 1) / pieces - 1])
        .collect()
}

/// Runs of undeflected beams around the centers at which boards are set up, spread over the free sectors.
fn direct_groups(paths: &[Path], count: usize, span_deg: f64) -> Vec<[usize; 2]> {
    let free = |b: usize| matches!(paths[b].end, End::Escaped) && paths[b].facets().is_empty();
    let mut sectors: Vec<[usize; 2]> = Vec::new();
    for b in (0..paths.len()).filter(|&b| free(b)) {
        match sectors.last_mut() {
            Some(sector) if sector[1] + 1 == b => sector[1] = b,
            _ => sectors.push([b, b]),
        }
    }
    sectors.retain(|s| (s[1] - s[0]) as f64 * beam::STEP >= LEAST_SECTOR);
    let total: usize = sectors.iter().map(|s| s[1] - s[0] + 1).sum();
    if total == 0 {
        return Vec::new();
    }
    // Centers evenly over the free beams laid end to end. Successive poses jump by a third of the way, so that
    // neighbours in tilt are not neighbours in azimuth.
    let half = 0.5 * span_deg.to_radians() / beam::STEP;
    (0..count)
        .map(|k| {
            let slot = (k % 3) * count.div_ceil(3) + k / 3;
            let along = (2 * (slot % count) + 1) * total / (2 * count);
            let mut rest = along;
            let sector = sectors.iter().find(|s| {
                let beams = s[1] - s[0] + 1;
                let here = rest < beams;
                if !here {
                    rest -= beams;
                }
                here
            });
            let sector = sector.copied().unwrap_or(sectors[0]);
            let center = sector[0] + rest;
            // Small positive number.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let half = half as usize;
            [
                center.saturating_sub(half).max(sector[0]),
                (center + half).min(sector[1]),
            ]
        })
        .collect()
}

impl Group {
    fn new(facet: Option<usize>, first: usize, last: usize, paths: &[Path], room_from_sensor: &Pose) -> Self {
        let leaves = |path: &Path| match facet {
            Some(_) => leaves_by(path) == facet,
            None => path.facets().is_empty() && matches!(path.end, End::Escaped),
        };
        let rays = paths[first..=last]
            .iter()
            .filter(|p| leaves(p))
            .map(|p| Ray {
                origin: room_from_sensor * p.last.origin,
                direction: Unit::new_unchecked(room_from_sensor.rotation * p.last.direction.into_inner()),
            })
            .collect();
        Self {
            facet,
            first,
            last,
            rays,
        }
    }

    /// The ray of the middle beam.
    fn middle(&self) -> Option<&Ray> {
        self.rays.get(self.rays.len() / 2)
    }

    /// Share of the group's rays that meet a board well inside its edges.
    fn caught(&self, board: &Board, room_from_board: &Pose) -> f64 {
        let outline = Rectangle {
            width: board.width_mm * 1e-3,
            height: board.height_mm * 1e-3,
        };
        let inside = |ray: &&Ray| {
            let origin = room_from_board.inverse_transform_point(&ray.origin);
            let direction = room_from_board.inverse_transform_vector(&ray.direction);
            let distance = -origin.z / direction.z;
            distance > 0.0
                && outline.contains(
                    &(origin + direction * distance),
                    EDGE_MARGIN.0 + EDGE_MARGIN.1 * distance,
                )
        };
        self.rays.iter().filter(inside).count() as f64 / self.rays.len() as f64
    }
}

/// Fractions of a pose's tilt and distance to fall back on when it does not fit.
const TILT_FALLBACK: [f64; 4] = [1.0, 0.85, 0.7, 0.55];
const RANGE_FALLBACK: [f64; 8] = [1.0, 0.93, 0.86, 0.79, 0.72, 0.65, 0.58, 0.5];

/// A pose for a board before a group: number `index` of its series, `group` being the group's number.
///
/// The tilt direction steps by the golden angle's complement to an even spread: over a series of K poses the
/// directions 2π·k/K go once round, and each group starts elsewhere.
fn place(
    board: &Board,
    group: &Group,
    experiment: &Experiment,
    room: &Room,
    index: usize,
    number: usize,
) -> Result<Pose, String> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let middle = group.middle().ok_or("no beam leaves towards it")?;
    let series = match group.facet {
        Some(_) => experiment.poses_per_group,
        None => experiment.direct_poses,
    };
    let turn = (f64::from(u32::try_from(index).unwrap_or(u32::MAX)) / f64::from(series)
        + number as f64 * GOLDEN)
        .fract();
    let spread =
        |[low, high]: [f64; 2], phase: f64| low + (high - low) * (index as f64 * GOLDEN + phase).fract();
    let tilt = spread(experiment.tilt_deg, 0.5).to_radians();
    let range = spread(experiment.range_m, 0.25);
    let (first, last) = (&group.rays[0], &group.rays[group.rays.len() - 1]);
    let fan = last.direction.into_inner() - first.direction.into_inner();
    let mut best: Option<(f64, Pose)> = None;
    let mut fits = false;
    for tilt_fraction in TILT_FALLBACK {
        for range_fraction in RANGE_FALLBACK {
            let distance = range * range_fraction;
            if distance < LEAST_RANGE {
                continue;
            }
            let pose = facing(
                middle,
                fan,
                distance,
                tilt * tilt_fraction,
                turn * std::f64::consts::TAU,
            );
            if !stands_in(board, &pose, room) {
                continue;
            }
            fits = true;
            let caught = group.caught(board, &pose);
            if caught == 1.0 {
                return Ok(pose);
            }
            if best.as_ref().is_none_or(|(most, _)| caught > *most) {
                best = Some((caught, pose));
            }
        }
    }
    match best {
        Some((caught, pose)) if caught > 0.0 => Ok(pose),
        _ if fits => Err("no beam of the group would meet it well inside its edges".to_owned()),
        _ => Err(format!(
            "it would reach through a wall, floor or ceiling at every distance from {LEAST_RANGE} to {range:.2} m"
        )),
    }
}

/// A board on a ray, tilted against it; its x axis lies along the fan as far as the tilt allows.
fn facing(ray: &Ray, fan: Vector3<f64>, distance: f64, tilt: f64, turn: f64) -> Pose {
    let (across, up) = tangent_basis(&ray.direction);
    let (sin_turn, cos_turn) = libm::sincos(turn);
    let (sin_tilt, cos_tilt) = libm::sincos(tilt);
    let sideways = across.into_inner() * cos_turn + up.into_inner() * sin_turn;
    let normal = Unit::new_normalize(sideways * sin_tilt - ray.direction.into_inner() * cos_tilt);
    attitude(ray.origin + ray.direction.into_inner() * distance, &normal, fan)
}

/// The pose of a board with a given center and normal whose x axis is as near to `along` as it can be.
fn attitude(center: Point3<f64>, normal: &Unit<Vector3<f64>>, along: Vector3<f64>) -> Pose {
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

/// Whether all corners of a board lie inside the room.
fn stands_in(board: &Board, room_from_board: &Pose, room: &Room) -> bool {
    let outline = Rectangle {
        width: board.width_mm * 1e-3,
        height: board.height_mm * 1e-3,
    };
    let [x, y, z] = room.size_m;
    outline.corners().iter().all(|corner| {
        let p = room_from_board * corner;
        p.x.abs() <= 0.5 * x - WALL_CLEARANCE
            && p.y.abs() <= 0.5 * y - WALL_CLEARANCE
            && p.z >= WALL_CLEARANCE
            && p.z <= z - WALL_CLEARANCE
    })
}

/// A pose that the scene gives itself.
fn given(scene: &Scene, paths: &[Path], pose: &BoardPose, index: usize) -> Result<Planned, SimError> {
    let unknown = |what: String| SimError::UnknownName { pose: index, what };
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
        .ok_or_else(|| unknown("a direction without length".to_owned()))?;
    let center = Point3::from(Vector3::from(pose.center_m));
    let level = attitude(center, &normal, tangent_basis(&normal).0.into_inner());
    let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), pose.turn_deg.to_radians());
    let beams = match facet {
        Some(facet) => served_beams(paths, scene.superstructure.facet.len())[facet],
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
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_cover_their_run_without_overlap() {
        let groups = cut(100, 279, 16.0);
        assert_eq!(groups, vec![[100, 159], [160, 219], [220, 279]]);
        assert_eq!(cut(5, 5, 16.0), vec![[5, 5]]);
    }

    #[test]
    fn a_board_faces_its_ray_under_the_wanted_tilt() {
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
