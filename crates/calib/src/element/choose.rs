//! Chooses the boards that an element hits: those that hold its spot at the current estimate and whose range agrees.

use crate::element::attempt::{Attempt, MIN_BOARDS, Workspace};
use crate::element::facet_plane::plane_at;
use crate::readings::observations::{azimuth, cone_half_angle};
use catoptric_model::session::NominalFacet;
use catoptric_model::{BeamEstimate, Deflection, MirrorPlane, beam};

/// Residual that always counts as the board's own, in meters; a wall behind it differs by decimeters.
pub(crate) const GATE_FLOOR: f64 = 0.03;

/// Gate on residuals that count as the board's own, in standard deviations.
pub(crate) const GATE_SIGMAS: f64 = 6.0;

/// Margin of board required around a spot once the direction is known, in meters.
const EDGE_MARGIN: f64 = 5e-3;

/// The poses whose board holds the beam and whose range agrees, for a direction known to `stage` radians.
pub(crate) fn choose(attempt: &Attempt, at: &Deflection, stage: f64) -> Vec<usize> {
    let strict = choose_within(attempt, at, stage, 0.0);
    if strict.len() < MIN_BOARDS && stage > 0.0 {
        choose_within(attempt, at, stage, stage)
    } else {
        strict
    }
}

/// `overhang` allows the predicted hit to be outside the board by that much, in radians of direction.
fn choose_within(attempt: &Attempt, at: &Deflection, stage: f64, overhang: f64) -> Vec<usize> {
    let (origin, v) = (
        at.deflection_point(attempt.azimuth),
        at.exit_direction(attempt.azimuth),
    );
    let cone = cone_half_angle(attempt.session);
    let agrees = |pose: &usize| {
        let board = attempt.work.boards[*pose].as_ref()?;
        let hit = board.hit(&origin, &v)?;
        let cos_incidence = board.plane.cos_incidence(&v);
        let tan = (1.0 / (cos_incidence * cos_incidence) - 1.0).max(0.0).sqrt();
        // While the direction is a guess, the chief ray has to hit the board; later the whole spot has to.
        let (radius, margin) = if stage > 0.0 {
            (0.0, -overhang * hit.distance / cos_incidence)
        } else {
            (cone * (at.distance + hit.distance), EDGE_MARGIN)
        };
        if !board.holds(&hit, radius, margin) {
            return None;
        }
        let observation = attempt.observations(&[*pose]);
        let residual = attempt.element(&observation).residuals(at)?.first()?.abs();
        let gate = GATE_FLOOR + stage * hit.distance * tan;
        let inside = residual <= gate
            || residual
                <= stage * hit.distance * tan
                    + GATE_SIGMAS * attempt.budget(at, &observation)?.covariance[(0, 0)].sqrt();
        inside.then_some(())
    };
    attempt
        .usable
        .iter()
        .copied()
        .filter(|p| agrees(p).is_some())
        .collect()
}

/// The stretches whose boards an element hits, by its estimate or, without one, by its facet's plane.
pub(crate) fn boards_hit(
    work: &Workspace,
    estimate: &BeamEstimate,
    facet: &NominalFacet,
    mirror: &MirrorPlane,
) -> Option<Vec<usize>> {
    let session = &work.dataset.session;
    let u = beam::direction(azimuth(session, estimate.beam));
    let by_plane = plane_at(facet, mirror, &u).deflect(u)?;
    boards_at(
        work,
        estimate.beam,
        facet,
        mirror,
        &estimate.deflection().unwrap_or(by_plane),
    )
}

/// The stretches whose boards an element of a facet hits with a known deflection.
pub(crate) fn boards_at(
    work: &Workspace,
    beam: usize,
    facet: &NominalFacet,
    mirror: &MirrorPlane,
    at: &Deflection,
) -> Option<Vec<usize>> {
    let session = &work.dataset.session;
    let u = beam::direction(azimuth(session, beam));
    let by_plane = plane_at(facet, mirror, &u).deflect(u)?;
    Some(choose(
        &Attempt::new(work, session, beam, facet, &by_plane),
        at,
        0.0,
    ))
}
