//! Chooses position and orientation of one board.

use super::groups::Group;
use crate::build::board::{facing, stands_in};
use crate::noise::Draws;
use crate::scene::{Board, Experiment, Room};
use catoptric_model::Pose;

/// Minimum distance between a board and the mirror that it faces, in meters.
const MIN_RANGE: f64 = 0.4;

/// Fractions of the planned tilt and distance that are tried when a pose does not fit.
const TILT_FALLBACK: [f64; 4] = [1.0, 0.85, 0.7, 0.55];

const RANGE_FALLBACK: [f64; 8] = [1.0, 0.93, 0.86, 0.79, 0.72, 0.65, 0.58, 0.5];

/// A pose for a board in front of a group: number `index` of its series, for group number `number`.
///
/// Over a series of K poses the tilt direction makes one turn in even steps, with another start for every group. Tilt
/// and distance step through their bounds by the golden ratio, so that no two of the three are correlated.
pub(super) fn place(
    board: &Board,
    group: &Group,
    experiment: &Experiment,
    room: &Room,
    index: usize,
    number: usize,
) -> Result<Pose, String> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let middle = group.middle().ok_or("no beam leaves toward it")?;
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
            if distance < MIN_RANGE {
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
        _ if fits => Err("no beam of the group would hit it well inside its edges".to_owned()),
        _ => Err(format!(
            "it would reach through a wall, floor or ceiling at every distance from {MIN_RANGE} to {range:.2} m"
        )),
    }
}

/// Maximum number of random poses tried until one is inside the room.
const ATTEMPTS: u64 = 1000;

/// A random pose for a board in front of a group: aimed at one of its beams, with tilt, direction of tilt and distance
/// uniform within their bounds. A pose that is not inside the room is drawn again.
pub(super) fn place_at_random(
    board: &Board,
    group: &Group,
    experiment: &Experiment,
    room: &Room,
    index: usize,
    draws: impl Fn() -> Draws,
) -> Result<Pose, String> {
    group.middle().ok_or("no beam leaves toward it")?;
    let (first, last) = (&group.rays[0], &group.rays[group.rays.len() - 1]);
    let fan = last.direction.into_inner() - first.direction.into_inner();
    let mut draws = draws();
    let within = |[low, high]: [f64; 2], share: f64| low + (high - low) * share;
    for attempt in 0..ATTEMPTS {
        draws.seek(index as u64 * ATTEMPTS + attempt);
        // Less than the number of rays.
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
        "none of {ATTEMPTS} random poses is inside the room's walls, floor and ceiling"
    ))
}
