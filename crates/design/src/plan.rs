//! Connects scenes with the planning of board poses: from a scene to what its experimenter knows, and from planned
//! poses to a scene that records them.
//!
//! How poses are planned is documented in [`calib::plan`](catoptric_calib::plan); only here do scene and estimator
//! meet.
//!
//! ```
//! use catoptric_calib::plan::{self, Request};
//! use catoptric_design::plan as scenes;
//! use catoptric_sim as sim;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene: sim::Scene = toml::from_str(include_str!("../../../scenes/prototype.toml"))?;
//! let request = Request { poses: 4, tries: 1000, ..Request::default() };
//! let plan = plan::plan(&scenes::situation(&scene)?, &["left-1".to_owned()], &request)?;
//! assert_eq!(plan.facets[0].after.open, 0);
//! let planned = scenes::with_poses(&scene, &plan)?;
//! assert!(planned.experiment.pose.len() > 4);
//! # Ok(())
//! # }
//! ```

use catoptric_calib::CalibError;
use catoptric_calib::plan::{Placed, Plan, PlannedPose, Situation, facing};
use catoptric_model::{Dataset, Pose, PoseKind};
use catoptric_sim::build::room_from_rig;
use catoptric_sim::laboratory::placement::{self, Planned};
use catoptric_sim::receive::Sensor;
use catoptric_sim::scene::BoardPose;
use catoptric_sim::{Laboratory, Scene, SimError};

/// Why nothing can be planned for a scene.
#[derive(Debug, thiserror::Error)]
pub enum PlanError {
    /// The scene cannot be set up.
    #[error(transparent)]
    Scene(#[from] SimError),
    /// No pose is possible.
    #[error(transparent)]
    Plan(#[from] CalibError),
}

/// Returns what the experimenter of a scene knows before anything is recorded.
///
/// Boards that the scene lists individually count as recorded. Boards that its rules would place do not, except those
/// in front of undeflected beams, which determine the pose of the sensor.
///
/// # Errors
/// [`PlanError`] if the scene cannot be set up, or a facet has no plane.
pub fn situation(scene: &Scene) -> Result<Situation, PlanError> {
    let scene = without_rules_for_facets(scene);
    let session = Laboratory::new(&scene, scene.seed)?.session()?;
    let placed: Vec<Placed> = procedure(&scene)?
        .iter()
        .filter_map(|planned| {
            let (board, room_from_board) = planned.board?;
            Some(Placed {
                board: scene.board[board].name.clone(),
                facet: planned.facet.map(|f| scene.superstructure.facet[f].name.clone()),
                room_from_board,
                beams: planned.beams,
                readings: planned.scans,
            })
        })
        .collect();
    let room_from_rig = room_from_rig(&scene.room);
    Ok(Situation::drawn(&session, &room_from_rig, &placed)?)
}

/// Returns the scene with its poses listed individually, followed by the planned ones.
///
/// In front of facets that are not in the plan, and of undeflected beams, boards are placed by the scene's rules.
///
/// # Errors
/// [`SimError`] if those rules find no pose.
pub fn with_poses(scene: &Scene, plan: &Plan) -> Result<Scene, SimError> {
    let mut poses = scene.experiment.pose.clone();
    if poses.is_empty() {
        let is_planned = |facet: usize| {
            let name = &scene.superstructure.facet[facet].name;
            plan.facets.iter().any(|f| f.facet == *name)
        };
        // If every facet is planned, the rules need not find poses for any.
        let all = (0..scene.superstructure.facet.len()).all(is_planned);
        let rules = if all {
            without_rules_for_facets(scene)
        } else {
            scene.clone()
        };
        let kept = procedure(&rules)?.into_iter();
        let kept = kept.filter(|p| p.test.is_none() && !p.facet.is_some_and(is_planned));
        poses.extend(kept.filter_map(|planned| {
            let (board, pose) = planned.board?;
            let facet = planned.facet.map(|f| scene.superstructure.facet[f].name.clone());
            Some(given(&scene.board[board].name, facet, &pose))
        }));
    }
    Ok(appended(scene, poses, plan))
}

/// Returns the scene of a dataset with the dataset's poses as tracked, followed by the planned ones.
pub fn completed(scene: &Scene, dataset: &Dataset, plan: &Plan) -> Scene {
    let boards = dataset.poses.iter().filter(|pose| {
        let kind = pose.label.kind;
        matches!(kind, PoseKind::Direct | PoseKind::Facet) && pose.label.test.is_none()
    });
    let poses = boards.filter_map(|pose| {
        let board = pose.label.board.as_ref()?;
        Some(given(board, pose.label.facet.clone(), &pose.room_from_board?))
    });
    appended(scene, poses.collect(), plan)
}

fn appended(scene: &Scene, mut poses: Vec<BoardPose>, plan: &Plan) -> Scene {
    for facet in &plan.facets {
        poses.extend(facet.poses.iter().map(|pose| stated(pose, &facet.facet)));
    }
    let mut scene = scene.clone();
    scene.experiment.pose = poses;
    scene
}

fn stated(pose: &PlannedPose, facet: &str) -> BoardPose {
    BoardPose {
        board: pose.board.clone(),
        facet: Some(facet.to_owned()),
        center_m: pose.center_m,
        normal: pose.normal,
        turn_deg: pose.turn_deg,
    }
}

fn given(board: &str, facet: Option<String>, room_from_board: &Pose) -> BoardPose {
    let (normal, turn_deg) = facing(room_from_board);
    BoardPose {
        board: board.to_owned(),
        facet,
        center_m: room_from_board.translation.vector.into(),
        normal,
        turn_deg,
    }
}

fn procedure(scene: &Scene) -> Result<Vec<Planned>, SimError> {
    placement::plan(scene, &Sensor::new(scene)?, scene.seed)
}

fn without_rules_for_facets(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.experiment.poses_per_group = 0;
    scene
}
