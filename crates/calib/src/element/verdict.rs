//! Is an estimate credible? Checks its residuals, its weakest direction and the known room (step 13).

use crate::element::ambiguity::second_direction;
use crate::element::attempt::{Attempt, ElementFit, Failure, lost, rejected};
use crate::element::choose::{GATE_FLOOR, GATE_SIGMAS};
use crate::element::solver::Solver;
use crate::judge::levers::libm_cos;
use crate::readings::ahead::{AGREEMENT_FLOOR, ahead};
use crate::readings::observations::{BoardView, Observation};
use catoptric_model::{BeamEstimate, Deflection, PoseKind, RawRange, Status, frame};
use nalgebra::{Matrix2, Vector2};

/// Largest ratio of a good element's residuals to the expected ones. A solution from three boards leaves one Gaussian
/// number: one in a million exceeds five standard deviations.
const RESIDUAL_FACTOR: f64 = 5.0;

/// Residual that no belief covers, in meters: whole millimeters, beam size, laws that deviate from their own tables.
const RESIDUAL_FLOOR: f64 = 4e-3;

/// Largest credible rms residual of a fit, and the expected one, in meters.
fn residual_limit(solver: &Solver, attempt: &Attempt, fit: &ElementFit) -> Option<(f64, f64)> {
    let observations = attempt.observations(&fit.poses);
    let budget = attempt.budget(&fit.solution.deflection, &observations)?;
    let residuals = (solver.residuals)(&budget)?;
    let expected = (residuals.trace().max(0.0) / fit.poses.len() as f64).sqrt();
    Some((RESIDUAL_FACTOR * expected + RESIDUAL_FLOOR, expected))
}

/// Whether a fit's residuals are as small as all believed errors predict.
pub(crate) fn residuals_agree(solver: &Solver, attempt: &Attempt, fit: &ElementFit) -> bool {
    residual_limit(solver, attempt, fit).is_some_and(|(limit, _)| fit.rms() <= limit)
}

/// The estimate, if it passes every check.
pub(crate) fn judge(solver: &Solver, attempt: &Attempt, fit: &ElementFit) -> Result<BeamEstimate, Failure> {
    let solution = &fit.solution;
    let observations = attempt.observations(&fit.poses);
    let readings: usize = observations.iter().map(|o| o.board.count).sum();
    let found = BeamEstimate {
        facet: Some(attempt.facet.name.clone()),
        poses: Some(fit.poses.len()),
        readings: Some(readings),
        iterations: Some(solution.iterations),
        rms_residual_m: Some(fit.rms()),
        ..BeamEstimate::without_angles(attempt.beam, Status::Solved, None)
    };
    let budget = attempt
        .budget(&solution.deflection, &observations)
        .ok_or_else(lost)?;
    if let Some(weakness) = attempt.weakness(&solution.deflection, &fit.poses) {
        return Ok(BeamEstimate {
            status: Status::Unobservable,
            reason: Some(weakness.reason),
            null_direction: Some(weakness.null_direction),
            ..found
        });
    }
    if let Some(other) = second_direction(attempt, fit) {
        let (v, w) = (
            solution.deflection.exit_direction(attempt.azimuth),
            other.exit_direction(attempt.azimuth),
        );
        let (across, up) = frame::tangent_basis(&v);
        let turn = Vector2::new(
            w.dot(&across) / libm_cos(solution.deflection.elevation),
            w.dot(&up),
        )
        .normalize();
        return Ok(BeamEstimate {
            status: Status::Unobservable,
            reason: Some(format!(
                "two directions explain its ranges: azimuth {:.2}°, elevation {:.2}° and azimuth {:.2}°, elevation {:.2}°; \
                 add a board whose tilt is off the line of the others'",
                solution.deflection.azimuth.to_degrees(),
                solution.deflection.elevation.to_degrees(),
                other.azimuth.to_degrees(),
                other.elevation.to_degrees()
            )),
            null_direction: Some(if turn[turn.iamax()] < 0.0 { -turn } else { turn }.into()),
            ..found
        });
    }
    if !solution.converged {
        let reason = format!("no steady estimate after {} steps", solution.iterations);
        return Err(Failure {
            status: Status::NotConverged,
            reason,
        });
    }
    let (limit, expected) = residual_limit(solver, attempt, fit).ok_or_else(lost)?;
    if fit.rms() > limit {
        return Err(rejected(format!(
            "inconsistent ranges: rms residual {:.1} mm over {} boards, {:.1} mm expected",
            1e3 * fit.rms(),
            fit.poses.len(),
            1e3 * expected
        )));
    }
    let element = attempt.element(&observations);
    let covariance = (solver.covariance)(&element, &solution.deflection, &budget).ok_or_else(lost)?;
    check_room(attempt, &solution.deflection, &covariance)?;
    // One number for all readings, as in the paper: their pooled noise.
    let pooled: f64 = observations
        .iter()
        .map(|o| o.board.count as f64 * o.board.noise_sd.powi(2))
        .sum();
    let noise = budget.noise_covariance((pooled / readings as f64).sqrt());
    let symmetric = |m: Matrix2<f64>| {
        let off = 0.5 * (m[(0, 1)] + m[(1, 0)]);
        [[m[(0, 0)], off], [off, m[(1, 1)]]]
    };
    Ok(BeamEstimate {
        azimuth_rad: Some(solution.deflection.azimuth),
        elevation_rad: Some(solution.deflection.elevation),
        distance_m: Some(solution.deflection.distance - attempt.glass.setback),
        covariance_rad2: Some(symmetric(covariance)),
        noise_covariance_rad2: noise.map(symmetric),
        ..found
    })
}

/// Step 13: the known room has to be where the estimate puts it.
fn check_room(attempt: &Attempt, found: &Deflection, covariance: &Matrix2<f64>) -> Result<(), Failure> {
    let (origin, v) = (
        found.deflection_point(attempt.azimuth),
        found.exit_direction(attempt.azimuth),
    );
    for (pose, record) in attempt.work.dataset.poses.iter().enumerate() {
        let summary = attempt.summary(pose);
        if record.label.kind != PoseKind::Room || summary.count <= summary.missing {
            continue;
        }
        let room_from_sensor = record.room_from_rig * attempt.work.rig_from_sensor;
        let Some((wall, color)) = ahead(attempt.session, &room_from_sensor, None, &origin, &v) else {
            continue;
        };
        let observation = [Observation {
            board: BoardView {
                plane: wall.plane,
                markers: &[],
                color,
                noise_sd: attempt.noise_sd(summary, color),
                count: summary.count,
            },
            mean: RawRange(summary.mean - attempt.glass.delay),
        }];
        let budget = attempt.budget(found, &observation).ok_or_else(lost)?;
        let residuals = attempt.element(&observation).residuals(found).unwrap_or_default();
        let variance =
            budget.covariance[(0, 0)] + (&budget.jacobian * covariance * budget.jacobian.transpose())[(0, 0)];
        let limit = AGREEMENT_FLOOR + GATE_FLOOR + wall.spread + GATE_SIGMAS * variance.sqrt();
        if let Some(residual) = residuals.first().filter(|r| r.abs() > limit) {
            return Err(rejected(format!(
                "contradicts the known room: expected {:.3} m, found {:.3} m",
                summary.mean - residual,
                summary.mean
            )));
        }
    }
    Ok(())
}
