//! Where one board stands, and how it is turned.

use super::groups::Group;
use crate::footprint::Ray;
use crate::noise::Draws;
use crate::scene::{Board, Experiment, Room};
use catoptric_model::frame::tangent_basis;
use catoptric_model::{Pose, Rectangle};
use nalgebra::{Matrix3, Point3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};

/// Least distance between a board and the shell of the room, in metres.
const WALL_CLEARANCE: f64 = 0.03;

/// Least distance between a board and the mirror it stands before, in metres.
const LEAST_RANGE: f64 = 0.4;

/// Fractions of a pose's tilt and distance to fall back on when it does not fit.
const TILT_FALLBACK: [f64; 4] = [1.0, 0.85, 0.7, 0.55];

const RANGE_FALLBACK: [f64; 8] = [1.0, 0.93, 0.86, 0.79, 0.72, 0.65, 0.58, 0.5];

/// A pose for a board before a group: number `index` of its series, `group` being the group's number.
///
/// Over a series of K poses the tilt direction goes once round in even steps, and every group starts elsewhere. Tilt
/// and distance step through their bounds by the golden ratio, so that no two of them go together.
pub(super) fn place(
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

/// Times that chance is asked for a pose that stands in the room.
const ATTEMPTS: u64 = 1000;

/// A pose by chance for a board before a group: aimed at one of its beams, with tilt, direction of tilt and distance
/// uniform within their bounds. What does not stand in the room is drawn anew.
pub(super) fn place_at_random(
    board: &Board,
    group: &Group,
    experiment: &Experiment,
    room: &Room,
    index: usize,
    draws: impl Fn() -> Draws,
) -> Result<Pose, String> {
    group.middle().ok_or("no beam leaves towards it")?;
    let (first, last) = (&group.rays[0], &group.rays[group.rays.len() - 1]);
    let fan = last.direction.into_inner() - first.direction.into_inner();
    let mut draws = draws();
    let within = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
    for attempt in 0..ATTEMPTS {
        draws.seek(index as u64 * ATTEMPTS + attempt);
        // Below the number of rays.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let aimed = (draws.uniform() * group.rays.len() as f64) as usize;
        let range = within(experiment.range_m, draws.uniform());
        let tilt = within(experiment.tilt_deg, draws.uniform()).to_radians();
        let turn = std::f64::consts::TAU * draws.uniform();
        let pose = facing(&group.rays[aimed], fan, range, tilt, turn);
        if stands_in(board, &pose, room) {
            return Ok(pose);
        }
    }
    Err(format!(
        "of {ATTEMPTS} poses by chance, none stands within the room's walls, floor and ceiling"
    ))
}

/// A board on a ray, tilted against it; its x axis lies along the fan as far as the tilt allows.
pub(super) fn facing(ray: &Ray, fan: Vector3<f64>, distance: f64, tilt: f64, turn: f64) -> Pose {
    let (across, up) = tangent_basis(&ray.direction);
    let (sin_turn, cos_turn) = libm::sincos(turn);
    let (sin_tilt, cos_tilt) = libm::sincos(tilt);
    let sideways = across.into_inner() * cos_turn + up.into_inner() * sin_turn;
    let normal = Unit::new_normalize(sideways * sin_tilt - ray.direction.into_inner() * cos_tilt);
    attitude(ray.origin + ray.direction.into_inner() * distance, &normal, fan)
}

/// The pose of a board with a given center and normal whose x axis is as near to `along` as it can be.
pub(super) fn attitude(center: Point3<f64>, normal: &Unit<Vector3<f64>>, along: Vector3<f64>) -> Pose {
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
pub(crate) fn stands_in(board: &Board, room_from_board: &Pose, room: &Room) -> bool {
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

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::beam;

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
