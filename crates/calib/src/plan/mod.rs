//! Which board poses to record next: optimal experiment design on what the experimenter knows.
//!
//! Seen along an element's beam a board contributes p = s·tan α·(cos ψ, sin ψ), s being the way from the mirror, α the
//! tilt and ψ its direction. Errors that boards share (biases, d) are nuisances q with unit variance, so that the
//! information about (cos φ·θ_a, φ, q) is a sum over boards and the angles' covariance C its inverse's corner:
//!
//! ```text
//! Λ = diag(0, I) + Σ_k g_k g_kᵀ/σ_k²        A: mean of tr C / 2        D: mean of log det C
//! ```
//!
//! σ_k² holds a board's own errors: noise of the mean, drift, markers. The mounting turns all beams alike, whatever the
//! boards, so it is left out of the choice and stated beside. Poses are chosen from candidates ([`candidates`]) one by
//! one, then exchanged until no exchange is better.

pub mod candidates;
mod design;
mod situation;
#[cfg(test)]
mod tests;
mod words;

pub use candidates::Candidate;
pub use design::Designer;
pub use situation::{Placed, Situation};
pub use words::facing;

use crate::error::CalibError;
use serde::Serialize;

/// Version of what a plan is written as.
pub const SCHEMA_VERSION: u32 = 1;

/// What is to be small over the elements of a facet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Mean log det of the angles' covariance: the area of the error ellipse.
    #[default]
    D,
    /// Mean trace of the angles' covariance: the mean square error.
    A,
}

/// What is asked for, and the limits of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Poses for each facet.
    pub poses: usize,
    /// What is to be small.
    pub criterion: Criterion,
    /// Where the sequence of candidates begins.
    pub seed: u64,
    /// Least and greatest way from the mirror to the board along the beam it is aimed at, in metres; the room and the
    /// divergence of the beam set limits of their own.
    pub range_m: [f64; 2],
    /// Largest incidence of any beam that the board serves, in degrees.
    pub max_incidence_deg: f64,
    /// Readings of each element at each pose.
    pub readings: usize,
    /// Poses that are tried for each facet; those that are possible are its candidates.
    pub tries: usize,
}

impl Default for Request {
    fn default() -> Self {
        Self {
            poses: 5,
            criterion: Criterion::default(),
            seed: 1,
            range_m: [0.5, 4.0],
            max_incidence_deg: 60.0,
            readings: 100,
            tries: 5000,
        }
    }
}

/// The poses to record next.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Version of this format.
    pub schema_version: u32,
    /// What was to be small.
    pub criterion: Criterion,
    /// Facet by facet.
    pub facets: Vec<FacetPlan>,
}

/// The poses to record next before one facet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetPlan {
    /// The facet.
    pub facet: String,
    /// Poses of the sequence that were possible.
    pub candidates: usize,
    /// Before any of the poses.
    pub before: Standing,
    /// After all of them.
    pub after: Standing,
    /// The poses, the most informative first.
    pub poses: Vec<PlannedPose>,
    /// Elements that are open before the first pose, and why.
    pub lacking: Vec<Open>,
    /// Elements that are open after the last pose, and why.
    pub open: Vec<Open>,
}

/// How well the elements of a facet are determined.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Standing {
    /// Elements whose boards determine both angles.
    pub determined: usize,
    /// Elements whose boards do not.
    pub open: usize,
    /// Root mean square of the bound over the determined elements, in degrees per axis, the mounting taken as known;
    /// `None` if there is none.
    pub bound_deg: Option<f64>,
    /// The same with the mounting as well known as it is.
    pub bound_with_mounting_deg: Option<f64>,
}

/// One board pose to record.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PlannedPose {
    /// The board.
    pub board: String,
    /// Center of its face in the room, in metres.
    pub center_m: [f64; 3],
    /// Normal of its face in the room.
    pub normal: [f64; 3],
    /// Turn about the normal, in degrees; at 0 the board's x axis is horizontal.
    pub turn_deg: f64,
    /// The board's attitude in the room as yaw, pitch and roll, in degrees.
    pub yaw_pitch_roll_deg: [f64; 3],
    /// Beam that the center is on.
    pub beam: usize,
    /// Way from the mirror to the center, in metres.
    pub range_m: f64,
    /// Tilt against that beam, in degrees.
    pub tilt_deg: f64,
    /// Direction to which the normal leans, seen along that beam, in degrees: 0 to growing azimuth, 90 up.
    pub direction_deg: f64,
    /// The same in words.
    pub words: String,
    /// First and last of each run of beams that the board serves.
    pub beams: Vec<[usize; 2]>,
    /// Before this pose, with the poses above.
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

/// Plans the next poses before each of the facets named, or before all.
///
/// # Errors
/// [`CalibError::UnknownFacet`] for a name that is no facet's, [`CalibError::NoPlace`] where no board can stand,
/// [`CalibError::Session`] for limits that leave nothing.
///
/// ```
/// use catoptric_calib::plan::{Plan, Request, Situation, plan};
/// use catoptric_calib::CalibError;
/// use catoptric_model::Dataset;
///
/// fn next_poses(dataset: &Dataset) -> Result<Plan, CalibError> {
///     plan(&Situation::recorded(dataset)?, &[], &Request::default())
/// }
/// ```
pub fn plan(situation: &Situation, facets: &[String], request: &Request) -> Result<Plan, CalibError> {
    let all = &situation.session().facets;
    let chosen: Vec<&str> = if facets.is_empty() {
        all.iter().map(|f| f.name.as_str()).collect()
    } else {
        facets.iter().map(String::as_str).collect()
    };
    let facets = chosen
        .into_iter()
        .map(|facet| plan_facet(situation, facet, request))
        .collect::<Result<_, _>>()?;
    Ok(Plan {
        schema_version: SCHEMA_VERSION,
        criterion: request.criterion,
        facets,
    })
}

/// Plans the next poses before one facet; facets do not depend on each other.
///
/// # Errors
/// As [`plan`].
pub fn plan_facet(situation: &Situation, facet: &str, request: &Request) -> Result<FacetPlan, CalibError> {
    let mut designer = Designer::new(situation, facet, request)?;
    let candidates = designer.len();
    let chosen = designer.best(request.poses);
    let mut before = designer.standing(&[]);
    let mut poses = Vec::with_capacity(chosen.len());
    for (number, candidate) in chosen.iter().enumerate() {
        let after = designer.standing(&chosen[..=number]);
        poses.push(words::planned(
            designer.candidate(*candidate),
            before,
            after.clone(),
        ));
        before = after;
    }
    Ok(FacetPlan {
        facet: facet.to_owned(),
        candidates,
        before: designer.standing(&[]),
        after: before,
        poses,
        lacking: designer.open(&[]),
        open: designer.open(&chosen),
    })
}
