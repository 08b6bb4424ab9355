//! Sets up the experiment: a structure as built, a sensor, a procedure.

use super::belief::believed_bias;
use crate::build::board;
use crate::build::room::room_from_rig;
use crate::build::stage::Stage;
use crate::build::structure::Structure;
use crate::build::trajectory::Trajectory;
use crate::error::SimError;
use crate::laboratory::placement::{self, Planned};
use crate::light::edges::EdgeRays;
use crate::light::optics::Rig;
use crate::noise::{Draws, Purpose};
use crate::receive::reading::Sensor;
use crate::scene::{ErrorModel, Scene};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::tracking::solve_pose;
use catoptric_model::{Pose, RangeBias};
use nalgebra::{Point3, Translation3, UnitQuaternion};
use std::sync::OnceLock;

/// A scene ready to be recorded.
pub struct Laboratory {
    pub(super) scene: Scene,
    pub(super) seed: u64,
    pub(super) sensor: Sensor,
    pub(super) structure: Structure,
    /// Everything fixed in the room, in the frame of the sensor at rest; `None` if all stretches are flights.
    pub(super) stage: Option<Stage>,
    pub(super) planned: Vec<Planned>,
    /// True pose of each planned board, in the room frame.
    pub(super) boards: Vec<Option<Pose>>,
    /// Trajectories of the flights.
    pub(super) trajectories: Vec<Trajectory>,
    /// Beliefs about the biases, from step 1.
    pub(super) believed: RangeBias,
    /// With the mirrors and without, once each is compiled.
    pub(super) compiled: [OnceLock<Compiled>; 2],
}

/// What light does past the structure, wherever the sensor is.
pub(super) struct Compiled {
    /// Paths of all sub-rays.
    pub(super) rig: Rig,
    /// Sub-rays of the beams that edges divide, if they are treated differently.
    pub(super) edge_rays: Option<EdgeRays>,
}

impl Laboratory {
    /// Builds the structure and plans the procedure.
    ///
    /// # Errors
    /// A facet without a shape, an unknown color, a board that fits nowhere, an invalid flight.
    pub fn new(scene: &Scene, seed: u64) -> Result<Self, SimError> {
        // Boards need a room; a flight does not.
        if scene.has_no_laboratory()
            || scene.only_shows_mirrors()
            || !(scene.room.has_walls() || scene.only_flies())
        {
            return Err(SimError::NoLaboratory);
        }
        let sensor = Sensor::new(scene)?;
        let planned = placement::plan(scene, &sensor, seed)?;
        let boards = planned
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let (_, meant) = p.board?;
                Some(if p.exact {
                    meant
                } else {
                    misplaced(scene, seed, i, &meant)
                })
            })
            .collect();
        let trajectory = |flight| {
            Trajectory::of(flight).ok_or_else(|| SimError::Flight {
                name: flight.name.clone(),
            })
        };
        let trajectories = scene.flight.iter().map(trajectory).collect::<Result<_, _>>()?;
        let structure = Structure::as_built(scene, seed)?;
        let room_from_sensor = room_from_rig(&scene.room) * structure.rig_from_sensor;
        let laboratory = Self {
            seed,
            stage: match planned.iter().all(|p| p.flight.is_some()) {
                true => None,
                false => Some(Stage::new(scene, &room_from_sensor.inverse())?),
            },
            structure,
            believed: believed_bias(scene, seed, sensor.bias()),
            scene: scene.clone(),
            sensor,
            planned,
            boards,
            trajectories,
            compiled: [OnceLock::new(), OnceLock::new()],
        };
        laboratory.check_markers()?;
        laboratory.check_mishaps()?;
        Ok(laboratory)
    }

    fn check_markers(&self) -> Result<(), SimError> {
        let spans = |template: &[Point3<f64>]| {
            let all: Vec<_> = template.iter().copied().map(Some).collect();
            solve_pose(template, &all).is_some()
        };
        if !spans(&board::points(&self.scene.superstructure.marker)) {
            return Err(SimError::Markers {
                body: RIG_SUBJECT.to_owned(),
            });
        }
        match self
            .scene
            .board
            .iter()
            .find(|b| !spans(&board::points(&board::board_markers(b))))
        {
            Some(board) => Err(SimError::Markers {
                body: board.name.clone(),
            }),
            None => Ok(()),
        }
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Number of stretches.
    pub fn stretches(&self) -> usize {
        self.planned.len()
    }

    /// Number of stretches with a board.
    pub fn board_poses(&self) -> usize {
        self.boards.iter().flatten().count()
    }

    /// Number of scans of all stretches together.
    pub fn scans(&self) -> usize {
        self.planned.iter().map(|p| p.scans).sum()
    }

    /// The scanner.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Number of scans of one stretch.
    pub fn scans_of(&self, number: usize) -> usize {
        self.planned[number].scans
    }

    /// Number of sub-rays of a beam.
    pub fn sub_rays(&self) -> usize {
        self.sensor.sub_rays()
    }

    pub(super) fn room_from_sensor(&self) -> Pose {
        room_from_rig(&self.scene.room) * self.structure.rig_from_sensor
    }

    /// Drift of a stretch, in meters.
    pub(super) fn drift(&self, number: usize) -> f64 {
        if self.scene.errors.model == ErrorModel::None {
            return 0.0;
        }
        let mut draws = Draws::new(self.seed, Purpose::Drift, number as u64);
        draws.normal() * self.scene.errors.drift_sd_mm * 1e-3
    }

    /// Number of a stretch's first scan within the whole recording.
    pub(super) fn first_scan(&self, number: usize) -> usize {
        self.planned[..number].iter().map(|p| p.scans).sum()
    }

    /// Start of a stretch, in seconds since the recording began.
    pub(super) fn start_s(&self, number: usize) -> f64 {
        let scan_period_s = self.sensor.scan().scan_period_s();
        self.first_scan(number) as f64 * scan_period_s + number as f64 * self.scene.experiment.pause_s
    }
}

/// True pose of a board that a person tries to place at a given pose.
fn misplaced(scene: &Scene, seed: u64, number: usize, meant: &Pose) -> Pose {
    let mut draws = Draws::new(seed, Purpose::Placement, number as u64);
    let shift = draws.normal3() * (scene.experiment.placement_sd_mm * 1e-3);
    let turn = draws.normal3() * scene.experiment.placement_sd_deg.to_radians();
    meant * Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}
