//! Describes a pose to a person, and merges beams into runs.

use super::answer::{Open, PlannedPose, Standing};
use super::candidates::PoseCandidate;
use catoptric_model::Pose;
use catoptric_model::frame::tangent_basis;
use nalgebra::{Unit, Vector3};

/// A chosen pose and its effect.
pub(super) fn planned(candidate: &PoseCandidate, before: Standing, after: Standing) -> PlannedPose {
    let pose = &candidate.room_from_board;
    let (normal, turn_deg) = facing(pose);
    let axes = pose.rotation.to_rotation_matrix();
    let m = axes.matrix();
    let attitude = [
        libm::atan2(m[(1, 0)], m[(0, 0)]),
        libm::asin((-m[(2, 0)]).clamp(-1.0, 1.0)),
        libm::atan2(m[(2, 1)], m[(2, 2)]),
    ];
    PlannedPose {
        board: candidate.board.clone(),
        center_m: pose.translation.vector.into(),
        normal,
        turn_deg,
        yaw_pitch_roll_deg: attitude.map(f64::to_degrees),
        beam: candidate.beam,
        range_m: candidate.range_m,
        tilt_deg: candidate.tilt_deg,
        direction_deg: candidate.direction_deg,
        words: format!(
            "{:.2} m out along beam {}, tilted {:.0}° toward ψ = {:.0}°",
            candidate.range_m, candidate.beam, candidate.tilt_deg, candidate.direction_deg
        ),
        beams: runs(&candidate.beams),
        before,
        after,
    }
}

/// Normal of a board's face, and the board's rotation about it in degrees: 0 with its x axis horizontal.
pub fn facing(room_from_board: &Pose) -> ([f64; 3], f64) {
    let normal = Unit::new_normalize(room_from_board.rotation * Vector3::z());
    let (level, _) = tangent_basis(&normal);
    let x = room_from_board.rotation * Vector3::x();
    let turn = libm::atan2(normal.cross(&level).dot(&x), level.dot(&x));
    (normal.into_inner().into(), turn.to_degrees())
}

/// First and last of each run of neighbors; the beams are in order.
fn runs(beams: &[usize]) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for beam in beams {
        match runs.last_mut() {
            Some(run) if run[1] + 1 == *beam => run[1] = *beam,
            _ => runs.push([*beam, *beam]),
        }
    }
    runs
}

/// Runs of neighbors with the same reason; the beams are in order.
pub(super) fn runs_with_reasons(open: &[(usize, String)]) -> Vec<Open> {
    let mut runs: Vec<Open> = Vec::new();
    for (beam, reason) in open {
        match runs.last_mut() {
            Some(run) if run.beams[1] + 1 == *beam && run.reason == *reason => run.beams[1] = *beam,
            _ => runs.push(Open {
                beams: [*beam, *beam],
                reason: reason.clone(),
            }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbors_are_merged() {
        assert_eq!(runs(&[3, 4, 5, 9, 11, 12]), vec![[3, 5], [9, 9], [11, 12]]);
        let open = |beam: usize, reason: &str| (beam, reason.to_owned());
        let found = runs_with_reasons(&[open(3, "a"), open(4, "a"), open(5, "b"), open(7, "b")]);
        let beams: Vec<[usize; 2]> = found.iter().map(|o| o.beams).collect();
        assert_eq!(beams, vec![[3, 4], [5, 5], [7, 7]]);
    }
}
