//! The virtual laboratory: a scene and a seed become stretches of scans, the session, and the truth.
//!
//! Every stretch is a pure function of (scene, seed, number), so that they can be computed in any order.

mod chance;
mod excerpt;
mod knowledge;
mod mishap;
mod recorder;
mod room;
mod sight;
mod truth;

pub use chance::{Chances, Memory};
pub use excerpt::{Drawn, ExcerptRecorder};
pub use recorder::Recorder;
pub use room::board_markers;
pub use sight::Sight;

use crate::cast::{Polygon, Shape};
use crate::color::{self, Paint};
use crate::error::SimError;
use crate::mocap::{self, Body};
use crate::noise::{Draws, Purpose};
use crate::optics::{Rig, Role, Target};
use crate::placement::{self, Planned};
use crate::reading::{Return, Sensor};
use crate::scene::{ErrorModel, Scene};
use crate::stage::Stage;
use crate::structure::Structure;
use crate::trajectory::Trajectory;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::tracking::solve_pose;
use catoptric_model::{
    Dataset, Pose, PoseLabel, PoseRecord, RangeBias, SpotNote, Stretch, TestKind, TestNote,
};
use nalgebra::{Point3, Translation3, UnitQuaternion};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::OnceLock;

/// Neighbouring beams whose spot is measured: the paper's triple beam.
const SPOT_BEAMS: usize = 3;

/// A scene ready to be recorded.
pub struct Laboratory {
    scene: Scene,
    seed: u64,
    sensor: Sensor,
    structure: Structure,
    /// What stands in the room, as the sensor sees it from where the rig stands; nothing if it never does.
    stage: Option<Stage>,
    planned: Vec<Planned>,
    /// Where each planned board really stands, in the room frame.
    boards: Vec<Option<Pose>>,
    /// The ways of the flights.
    trajectories: Vec<Trajectory>,
    /// What step 1 believes the biases to be.
    believed: RangeBias,
    /// The ways of all sub-rays over the structure, with its mirrors and without, once they are known.
    rigs: [OnceLock<Rig>; 2],
}

/// What a beam met during a scan, free of chance; `None` without an echo.
pub type Returns = Vec<Option<Return>>;

impl Laboratory {
    /// Builds the structure, sets up the procedure.
    ///
    /// # Errors
    /// A facet without a shape, an unknown color, a board that fits nowhere, a flight that is none.
    pub fn new(scene: &Scene, seed: u64) -> Result<Self, SimError> {
        // Boards stand in a room; a flight needs none.
        if scene.has_no_laboratory() || !(scene.room.has_walls() || scene.only_flies()) {
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
        let room_from_sensor = placement::room_from_rig(&scene.room) * structure.rig_from_sensor;
        let laboratory = Self {
            seed,
            stage: match planned.iter().all(|p| p.flight.is_some()) {
                true => None,
                false => Some(Stage::new(scene, &room_from_sensor.inverse())?),
            },
            structure,
            believed: knowledge::believed_bias(scene, seed, sensor.bias()),
            scene: scene.clone(),
            sensor,
            planned,
            boards,
            trajectories,
            rigs: [OnceLock::new(), OnceLock::new()],
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
        if !spans(&room::points(&self.scene.superstructure.marker)) {
            return Err(SimError::Markers {
                body: RIG_SUBJECT.to_owned(),
            });
        }
        match self
            .scene
            .board
            .iter()
            .find(|b| !spans(&room::points(&board_markers(b))))
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

    /// Scans of all stretches together.
    pub fn scans(&self) -> usize {
        self.planned.iter().map(|p| p.scans).sum()
    }

    /// The scanner.
    pub fn sensor(&self) -> &Sensor {
        &self.sensor
    }

    /// Scans of one stretch.
    pub fn scans_of(&self, number: usize) -> usize {
        self.planned[number].scans
    }

    /// Sub-rays of a beam.
    pub fn sub_rays(&self) -> usize {
        self.sensor.sub_rays()
    }

    fn room_from_sensor(&self) -> Pose {
        placement::room_from_rig(&self.scene.room) * self.structure.rig_from_sensor
    }

    /// Drift of a stretch, in metres.
    fn drift(&self, number: usize) -> f64 {
        if self.scene.errors.model == ErrorModel::None {
            return 0.0;
        }
        let mut draws = Draws::new(self.seed, Purpose::Drift, number as u64);
        draws.normal() * self.scene.errors.drift_sd_mm * 1e-3
    }

    /// Walls and the stretch's board where it stands, in the sensor frame.
    fn targets(&self, number: usize, room_from_board: Option<&Pose>) -> Result<Vec<Target>, SimError> {
        let sensor_from_room = self.room_from_sensor().inverse();
        let wall_paint = color::paint(&self.scene, &self.scene.room.color)?;
        let mut targets = wall_targets(&self.scene, &sensor_from_room, &wall_paint);
        if let (Some(board), Some(room_from_board)) = (self.board_of(number), room_from_board) {
            let corners = room::outline(board)
                .corners()
                .map(|c| room_from_board * c)
                .to_vec();
            if let Some(polygon) = placed(&sensor_from_room, corners) {
                targets.push(Target {
                    name: board.name.clone(),
                    shape: Shape::Polygon(polygon),
                    role: Role::Board,
                    paint: color::paint(&self.scene, &board.color)?,
                });
            }
        }
        Ok(targets)
    }

    /// What every beam meets during a stretch, traced once since nothing moves; in a flight, during its first scan.
    ///
    /// # Errors
    /// An unknown color.
    pub fn returns(&self, number: usize) -> Result<Returns, SimError> {
        Ok(self.sight(number)?.returns(0))
    }

    /// Records a stretch.
    ///
    /// # Errors
    /// An unknown color.
    pub fn stretch(&self, number: usize) -> Result<Stretch, SimError> {
        let sight = self.sight(number)?;
        let mut returns = sight.returns(0);
        let mut recorder = self.recorder(number);
        for scan in 0..self.scans_of(number) {
            if sight.changes_at(scan) {
                returns = sight.returns(scan);
            }
            recorder.add(&returns);
        }
        Ok(recorder.finish())
    }

    /// Records a stretch in which nothing moves from what [`Laboratory::returns`] found for it.
    pub fn record(&self, number: usize, returns: &Returns) -> Stretch {
        let mut recorder = self.recorder(number);
        for _ in 0..self.scans_of(number) {
            recorder.add(returns);
        }
        recorder.finish()
    }

    /// Number of a stretch's first scan, counted over the whole recording.
    fn first_scan(&self, number: usize) -> usize {
        self.planned[..number].iter().map(|p| p.scans).sum()
    }

    /// When a stretch begins, in seconds since the recording began.
    fn start_s(&self, number: usize) -> f64 {
        let scan_period_s = self.scene.scanner.limits().scan_period_s();
        self.first_scan(number) as f64 * scan_period_s + number as f64 * self.scene.experiment.pause_s
    }

    fn label(&self, number: usize) -> PoseLabel {
        let planned = &self.planned[number];
        let board = planned.board.as_ref().map(|(board, _)| &self.scene.board[*board]);
        PoseLabel {
            pose: number,
            kind: planned.kind,
            scans: planned.scans,
            board: board.map(|b| b.name.clone()),
            color: board.map(|b| b.color.clone()),
            facet: planned
                .facet
                .map(|f| self.scene.superstructure.facet[f].name.clone()),
            beams: planned.beams,
            test: planned.test.map(|test| TestNote {
                spot: (test.kind == TestKind::Spot)
                    .then(|| self.spot_note(number))
                    .flatten(),
                ..test
            }),
            flight: planned.flight.map(|f| self.scene.flight[f].name.clone()),
        }
    }

    /// The spot of three neighbouring beams around a board's center, as a person reads its edges off the board.
    fn spot_note(&self, number: usize) -> Option<SpotNote> {
        let sensor_from_board = self.room_from_sensor().inverse() * self.boards[number]?;
        let spot = self.sensor.spot(&sensor_from_board, SPOT_BEAMS)?;
        let mut draws = Draws::new(self.seed, Purpose::SpotReading, number as u64);
        let sd = self.scene.experiment.spot_sd_mm;
        let mut read = |extent: f64| {
            let misread = sd * (draws.normal() - draws.normal());
            ((extent * 1e3 + misread).max(0.0) * 10.0).round() / 10.0
        };
        Some(SpotNote {
            beams: SPOT_BEAMS,
            width_mm: read(spot[0]),
            height_mm: read(spot[1]),
        })
    }

    /// Frames of motion capture during a stretch.
    fn frames_of(&self, number: usize) -> u64 {
        let duration_s = self.planned[number].scans as f64 * self.scene.scanner.limits().scan_period_s();
        // Frame numbers and counts of a recording of hours stay far below 2³².
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let frames = (duration_s * self.scene.mocap.frame_rate_hz).floor() as u64;
        frames.max(1)
    }

    /// The rig, and the stretch's board, during some of its frames.
    fn tracks(&self, number: usize, frames: Range<u64>) -> Vec<catoptric_model::Track> {
        let mocap = &self.scene.mocap;
        let start_s = self.start_s(number);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let first_frame = (start_s * mocap.frame_rate_hz).round() as u64;
        let track =
            |body: &Body<'_>| mocap::track(mocap, self.seed, body, start_s, first_frame, frames.clone());
        let rig = room::points(&self.scene.superstructure.marker);
        let at_rest = placement::room_from_rig(&self.scene.room);
        let trajectory = self.planned[number].flight.map(|f| &self.trajectories[f]);
        let mut tracks = vec![track(&Body {
            subject: RIG_SUBJECT,
            index: 0,
            template: &rig,
            room_from_body: &|elapsed_s| trajectory.map_or(at_rest, |t| t.room_from_rig(elapsed_s)),
            // The rig stays where it is for the whole experiment, one placement, and is taken up for each flight.
            placement: if trajectory.is_some() { number + 1 } else { 0 },
        })];
        if let (Some((board, _)), Some(room_from_board)) = (&self.planned[number].board, &self.boards[number])
        {
            let template = room::points(&board_markers(&self.scene.board[*board]));
            let movement = self
                .movement(number)
                .map(|m| (self.elapsed_s(m.scan, 0), m.room_from_board));
            let stands = |elapsed_s: f64| match &movement {
                Some((from, there)) if elapsed_s >= *from => *there,
                _ => *room_from_board,
            };
            let mut seen = track(&Body {
                subject: &self.scene.board[*board].name,
                index: board + 1,
                template: &template,
                room_from_body: &stands,
                placement: number + 1,
            });
            self.mislabel(number, &mut seen);
            tracks.push(seen);
        }
        tracks
    }

    /// What a calibration needs of a stretch.
    ///
    /// # Errors
    /// As [`Laboratory::stretch`], and [`SimError::Markers`] if motion capture never saw the rig during it, which only a
    /// dropout of nearly 1 brings about.
    pub fn pose_record(&self, number: usize) -> Result<PoseRecord, SimError> {
        let record = self.stretch(number)?.into_record();
        record.map_err(|_| SimError::Markers {
            body: RIG_SUBJECT.to_owned(),
        })
    }

    /// The whole experiment in memory.
    ///
    /// # Errors
    /// As [`Laboratory::pose_record`].
    pub fn dataset(&self) -> Result<Dataset, SimError> {
        let numbers = (0..self.stretches()).into_par_iter();
        let poses = numbers
            .map(|number| self.pose_record(number))
            .collect::<Result<_, _>>()?;
        Ok(Dataset {
            session: self.session()?,
            poses,
        })
    }
}

/// Walls, floor and ceiling, moved into another frame.
pub(crate) fn wall_targets(scene: &Scene, frame_from_room: &Pose, paint: &Paint) -> Vec<Target> {
    room::walls(scene)
        .into_iter()
        .filter_map(|(name, corners)| {
            Some(Target {
                name: name.to_owned(),
                shape: Shape::Polygon(placed(frame_from_room, corners)?),
                role: Role::Wall,
                paint: paint.clone(),
            })
        })
        .collect()
}

/// The polygon of corners that are moved into another frame.
fn placed(frame_from_room: &Pose, corners: Vec<Point3<f64>>) -> Option<Polygon> {
    Polygon::new(corners.iter().map(|c| frame_from_room * c).collect())
}

/// Where a board really stands when a person means to put it somewhere.
fn misplaced(scene: &Scene, seed: u64, number: usize, meant: &Pose) -> Pose {
    let mut draws = Draws::new(seed, Purpose::Placement, number as u64);
    let shift = draws.normal3() * (scene.experiment.placement_sd_mm * 1e-3);
    let turn = draws.normal3() * scene.experiment.placement_sd_deg.to_radians();
    meant * Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn))
}
