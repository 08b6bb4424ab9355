//! Which board poses to record next: optimal experiment design from what the experimenter knows.
//!
//! Seen along an element's beam a board contributes p = s·tan α·(cos ψ, sin ψ), with s the distance from the mirror, α
//! the tilt and ψ its direction. Errors that boards share (biases, d) are nuisances q with unit variance, so that the
//! information about (cos φ·θ_a, φ, q) is a sum over boards and the angles' covariance C a corner of its inverse:
//!
//! ```text
//! Λ = diag(0, I) + Σ_k g_k g_kᵀ/σ_k²        A: mean of tr C / 2        D: mean of log det C
//! ```
//!
//! σ_k² contains a board's own errors: noise of the mean, drift, markers. The mounting turns all beams identically,
//! whatever the boards, so it does not enter the choice and is reported separately. Poses are chosen from candidates
//! ([`candidates`]) one at a time, then exchanged until no exchange improves the set.

mod answer;
pub mod candidates;
mod design;
mod request;
mod situation;
#[cfg(test)]
mod tests;
mod words;

pub use answer::{FacetPlan, Open, Plan, PlannedPose, SCHEMA_VERSION, Standing};
pub use candidates::PoseCandidate;
pub use design::Designer;
pub use request::{Criterion, Request};
pub use situation::{Placed, Situation};
pub use words::facing;

use crate::error::CalibError;
use catoptric_model::Stop;

/// Plans the next poses in front of each of the named facets, or of all facets.
///
/// # Errors
/// [`CalibError::UnknownFacet`] for an unknown name, [`CalibError::NoPlace`] if no board can be placed,
/// [`CalibError::Session`] for limits that exclude everything.
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

/// Plans the next poses in front of one facet; facets do not depend on each other.
///
/// # Errors
/// As [`plan`].
pub fn plan_facet(situation: &Situation, facet: &str, request: &Request) -> Result<FacetPlan, CalibError> {
    plan_facet_until(situation, facet, request, &Stop::default())
}

/// As [`plan_facet`], but can be stopped before it ends.
///
/// # Errors
/// As [`plan_facet`], and [`CalibError::Stopped`].
pub fn plan_facet_until(
    situation: &Situation,
    facet: &str,
    request: &Request,
    stop: &Stop,
) -> Result<FacetPlan, CalibError> {
    let mut designer = Designer::until(situation, facet, request, stop)?;
    let candidates = designer.len();
    let chosen = designer.best_until(request.poses, stop)?;
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
