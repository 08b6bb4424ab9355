//! Where the boards of step 1 are put: before one undeflected beam, at wanted distances under wanted incidences.

use super::poses::{facing, stands_in};
use super::{Planned, no_place_before};
use crate::error::SimError;
use crate::footprint::Ray;
use crate::scene::{Scene, SensorTest};
use catoptric_model::frame::tangent_basis;
use catoptric_model::{Pose, PoseKind, TestNote, beam};
use nalgebra::Point3;

/// Every stretch of every test, trial after trial.
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
                        return Err(no_place_before(scene, board, target, reason));
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

/// A board whose center is on the test's beam, in the room frame; its x axis is as nearly along the scan as can be.
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
