//! The result of planning: poses for each facet, and the improvement by each of them.

use super::request::Criterion;
use serde::Serialize;

/// Version of the format of a plan.
pub const SCHEMA_VERSION: u32 = 1;

/// The poses to record next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Version of this format.
    pub schema_version: u32,
    /// The criterion that was minimized.
    pub criterion: Criterion,
    /// One plan per facet.
    pub facets: Vec<FacetPlan>,
}

/// The poses to record next in front of one facet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetPlan {
    /// The facet.
    pub facet: String,
    /// Number of poses of the sequence that were possible.
    pub candidates: usize,
    /// Before any of the poses.
    pub before: Standing,
    /// Before any of the poses.
    pub after: Standing,
    /// After all of them.
    pub poses: Vec<PlannedPose>,
    /// Elements that are open before the first pose, and why.
    pub lacking: Vec<Open>,
    /// Elements that are open after the last pose, and why.
    pub open: Vec<Open>,
}

/// How well the elements of a facet are determined.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Number of elements whose boards determine both angles.
    pub determined: usize,
    /// Number of elements whose boards do not.
    pub open: usize,
    /// Root mean square of the bound over the determined elements, in degrees per axis, with the mounting taken as
    /// known; `None` if no element is determined.
    pub bound_deg: Option<f64>,
    /// The same with the actual uncertainty of the mounting.
    pub bound_with_mounting_deg: Option<f64>,
}

/// One board pose to record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedPose {
    /// The board.
    pub board: String,
    /// Center of its face in the room, in meters.
    pub center_m: [f64; 3],
    /// Normal of its face in the room.
    pub normal: [f64; 3],
    /// Turn about the normal, in degrees; at 0 the board's x axis is horizontal.
    pub turn_deg: f64,
    /// The board's attitude in the room as yaw, pitch and roll, in degrees.
    pub yaw_pitch_roll_deg: [f64; 3],
    /// Beam at which the center is aimed.
    pub beam: usize,
    /// Distance from the mirror to the center, in meters.
    pub range_m: f64,
    /// Tilt against that beam, in degrees.
    pub tilt_deg: f64,
    /// Direction to which the normal leans, seen along that beam, in degrees: 0 to growing azimuth, 90 up.
    pub direction_deg: f64,
    /// The same in plain language.
    pub words: String,
    /// First and last of each run of beams that the board serves.
    pub beams: Vec<[usize; 2]>,
    /// Before this pose, with the poses listed above it.
    pub before: Standing,
    /// With this pose.
    pub after: Standing,
}

/// Neighboring elements that are open for the same reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Open {
    /// First and last beam.
    pub beams: [usize; 2],
    /// Why.
    pub reason: String,
}
