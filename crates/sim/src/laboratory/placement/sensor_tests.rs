//! Places the boards of step 1: in front of one undeflected beam, at given distances and incidences.

use super::planned::{Planned, placement_error};
use crate::build::board::{before_beam, stands_in};
use crate::error::SimError;
use crate::scene::Scene;
use catoptric_model::{Pose, PoseKind, TestNote};

/// Plans every stretch of every test, trial by trial.
pub(super) fn plan(scene: &Scene, room_from_sensor: &Pose) -> Result<Vec<Planned>, SimError> {
    let mut planned = Vec::new();
    let mut setting = 0;
    for (index, test) in scene.experiment.test.iter().enumerate() {
        for name in &test.board {
            let board = scene.board.iter().position(|b| b.name == *name);
            let board = board.ok_or_else(|| SimError::UnknownName {
                by: format!("test {index}"),
                what: format!("board {name:?}"),
            })?;
            for &range in &test.range_m {
                for &incidence in &test.incidence_deg {
                    let pose = before_beam(test, range, incidence, room_from_sensor);
                    if !stands_in(&scene.board[board], &pose, &scene.room) {
                        let target = format!("the beam at azimuth {}°", test.azimuth_deg);
                        let reason = format!("at {range} m it would reach through a wall, floor or ceiling");
                        return Err(placement_error(scene, board, target, reason));
                    }
                    for trial in 1..=test.trials as usize {
                        planned.push(Planned {
                            kind: PoseKind::Direct,
                            scans: scene.experiment.scans_per_pose as usize,
                            facet: None,
                            beams: None,
                            board: Some((board, pose)),
                            exact: false,
                            flight: None,
                            test: Some(TestNote {
                                kind: test.kind,
                                setting,
                                trial,
                                spot: None,
                            }),
                        });
                    }
                    setting += 1;
                }
            }
        }
    }
    Ok(planned)
}
