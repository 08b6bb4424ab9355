//! Estimates the deflection of every element, a beam with its mirror: alternately selects the boards that it hits and solves for
//! its two angles, until the selection no longer changes.

use crate::element::attempt::{Attempt, ElementFit, Failure, MIN_BOARDS, Workspace, lost};
use crate::element::choose::choose;
use crate::element::facet_plane::plane_at;
use crate::element::initial::{self, FARTHEST_START};
use crate::element::single::blocks;
use crate::element::solve::{self, SoleElement, Solution};
use crate::element::solver::{Solver, Task};
use crate::element::verdict::{judge, residuals_agree};
use crate::error::CalibError;
use crate::readings::columns::{Columns, MOST_BYTES};
use crate::readings::observations::azimuth;
use crate::screen::ScreenClass;
use catoptric_model::session::NominalFacet;
use catoptric_model::{BeamEstimate, Deflection, MirrorPlane, Status, beam};
use rayon::prelude::*;

/// Direction errors allowed while the boards of an element are chosen, in radians, decreasing from that of the drawing
/// to zero.
///
/// A mirror doubles its tilt: 1° (1σ) of the facet and up to 1° of the scanner in its housing turn a beam by 8°
/// occasionally.
const STAGES: [f64; 8] = [0.15, 0.05, 0.02, 0.007, 0.0, 0.0, 0.0, 0.0];

/// Largest distance of a solution from the estimate that its boards were chosen with, in radians.
const FARTHEST_END: f64 = 0.007;

/// Largest ||v| − 1| at which a start in closed form is believed.
const LARGEST_EXCESS: f64 = 0.2;

/// The estimate of every element, with facets at the given planes.
///
/// # Errors
/// [`CalibError::Unreadable`].
pub(crate) fn estimates(
    work: &Workspace,
    solver: &Solver,
    candidates: &[ScreenClass],
    mirrors: &[MirrorPlane],
) -> Result<Vec<BeamEstimate>, CalibError> {
    let mut found = Vec::with_capacity(candidates.len());
    for block in blocks(work, solver, candidates, MOST_BYTES) {
        let columns = Columns::read(work.dataset, &block.wanted)?;
        let work = Workspace {
            columns: Some(&columns),
            ..*work
        };
        let of_beam = |beam: usize| {
            work.stop.check()?;
            Ok(of_candidate(&work, solver, beam, &candidates[beam], mirrors))
        };
        let estimates: Result<Vec<_>, CalibError> = block.beams.into_par_iter().map(of_beam).collect();
        found.extend(estimates?);
    }
    Ok(found)
}

/// The estimate of one element with all facets that it may belong to.
fn of_candidate(
    work: &Workspace,
    solver: &Solver,
    beam: usize,
    candidate: &ScreenClass,
    mirrors: &[MirrorPlane],
) -> BeamEstimate {
    let facets = &work.dataset.session.facets;
    match candidate {
        ScreenClass::Direct(reason) => {
            BeamEstimate::without_angles(beam, Status::Direct, Some(reason.clone()))
        }
        ScreenClass::Rejected(reason) => {
            BeamEstimate::without_angles(beam, Status::Rejected, Some(reason.clone()))
        }
        ScreenClass::Deflected(near) => {
            let mut tried = near
                .iter()
                .map(|f| estimate(work, solver, beam, &facets[*f], &mirrors[*f]));
            let nearest = tried.next();
            match nearest {
                Some(solved) if solved.status == Status::Solved => solved,
                // At the seam of two facets the beam may have hit the neighboring one.
                other => tried
                    .find(|e| e.status == Status::Solved)
                    .or(other)
                    .unwrap_or_else(|| {
                        let reason = "no facet is near it".to_owned();
                        BeamEstimate::without_angles(beam, Status::Rejected, Some(reason))
                    }),
            }
        }
    }
}

/// The estimate of one element on a facet whose plane is believed to be `mirror`.
fn estimate(
    work: &Workspace,
    solver: &Solver,
    beam: usize,
    facet: &NominalFacet,
    mirror: &MirrorPlane,
) -> BeamEstimate {
    let session = &work.dataset.session;
    let azimuth = azimuth(session, beam);
    let without = |status, reason| BeamEstimate {
        facet: Some(facet.name.clone()),
        ..BeamEstimate::without_angles(beam, status, Some(reason))
    };
    let u = beam::direction(azimuth);
    let Some(nominal) = plane_at(facet, mirror, &u).deflect(u) else {
        let reason = format!("the plane of facet {:?} does not face it", facet.name);
        return without(Status::Rejected, reason);
    };
    let attempt = Attempt::new(work, session, beam, facet, &nominal);
    let mut estimate = match fit(solver, &attempt, &nominal) {
        Ok(fit) => judge(solver, &attempt, &fit).unwrap_or_else(|f| without(f.status, f.reason)),
        Err(failure) => without(failure.status, failure.reason),
    };
    if matches!(estimate.status, Status::TooFewPoses | Status::NotConverged) {
        // The solver may have diverged only because the boards leave a direction open.
        let chosen = choose(&attempt, &nominal, STAGES[0]);
        if chosen.len() >= MIN_BOARDS
            && let Some(weakness) = attempt.weakness(&nominal, &chosen)
        {
            estimate = without(Status::Unobservable, weakness.reason.clone());
            estimate.null_direction = Some(weakness.null_direction);
            estimate.poses = Some(chosen.len());
        }
    }
    estimate
}

/// Chooses boards and solves, with a decreasing allowance, until the choice no longer changes.
fn fit(solver: &Solver, attempt: &Attempt, nominal: &Deflection) -> Result<ElementFit, Failure> {
    let mut at = SoleElement::place(&attempt.element(&[]), nominal.azimuth, nominal.elevation);
    let mut poses = Vec::new();
    let mut start = at;
    for (round, stage) in STAGES.iter().enumerate() {
        let chosen = choose(attempt, &at, *stage);
        if chosen.len() < MIN_BOARDS {
            return Err(too_few(attempt, chosen.len()));
        }
        if *stage == 0.0 && chosen == poses {
            break;
        }
        poses = chosen;
        let observations = attempt.observations(&poses);
        let element = attempt.element(&observations);
        if round == 0 {
            start = first_guess(attempt, &element, nominal);
            at = start;
        }
        at = solve::batch(&element, &at, attempt.work.options)
            .ok_or_else(lost)?
            .deflection;
    }
    let fit = solved_by(solver, attempt, poses, &start, &at)?;
    if fit.poses.len() > MIN_BOARDS && !residuals_agree(solver, attempt, &fit) {
        // One wrong surface among the boards biases the residuals of the others; without it, it is an obvious outlier.
        if let Some(better) = without_one(solver, attempt, &fit) {
            return Ok(better);
        }
    }
    Ok(fit)
}

/// The solution by the given solver, from the start, or from the present estimate if that does not converge.
fn solved_by(
    solver: &Solver,
    attempt: &Attempt,
    poses: Vec<usize>,
    start: &Deflection,
    at: &Deflection,
) -> Result<ElementFit, Failure> {
    let observations = attempt.observations(&poses);
    let element = attempt.element(&observations);
    let run = |from: &Deflection| {
        (solver.solve)(&Task {
            attempt,
            element: &element,
            poses: &poses,
            from,
            at,
        })
    };
    let near = |s: &Solution| {
        let (a, b) = (
            s.deflection.exit_direction(attempt.azimuth),
            at.exit_direction(attempt.azimuth),
        );
        s.converged && beam::angle_between(&a, &b) < FARTHEST_END
    };
    let solution = run(start).filter(near).or_else(|| run(at)).ok_or_else(lost)?;
    Ok(ElementFit {
        poses,
        solution,
        start: *start,
    })
}

/// The start in closed form if it is credible, else the drawing.
fn first_guess(attempt: &Attempt, element: &SoleElement, nominal: &Deflection) -> Deflection {
    let found = initial::closed_form(nominal, attempt.azimuth, element.observations, element.bias);
    let v = nominal.exit_direction(attempt.azimuth);
    found
        .filter(|f| f.excess.abs() < LARGEST_EXCESS && beam::angle_between(&f.direction, &v) < FARTHEST_START)
        .map_or(*nominal, |f| {
            Deflection::from_exit(attempt.azimuth, &f.direction, nominal.distance)
        })
}

/// A consistent solution without one of the boards, if that board is then clearly not what the element read.
fn without_one(solver: &Solver, attempt: &Attempt, fit: &ElementFit) -> Option<ElementFit> {
    let fits = fit.poses.iter().filter_map(|omitted| {
        let rest: Vec<usize> = fit.poses.iter().copied().filter(|p| p != omitted).collect();
        let observations = attempt.observations(&rest);
        let at = solve::batch(&attempt.element(&observations), &fit.start, attempt.work.options)?.deflection;
        if choose(attempt, &at, 0.0) != rest {
            return None;
        }
        let fit = solved_by(solver, attempt, rest, &fit.start, &at).ok()?;
        residuals_agree(solver, attempt, &fit).then_some(fit)
    });
    fits.min_by(|a, b| a.rms().total_cmp(&b.rms()))
}

fn too_few(attempt: &Attempt, chosen: usize) -> Failure {
    Failure {
        status: Status::TooFewPoses,
        reason: format!(
            "{MIN_BOARDS} boards are needed; of {} set up for facet {:?} it read {} in order and hit {chosen}",
            attempt.recorded,
            attempt.facet.name,
            attempt.usable.len()
        ),
    }
}
