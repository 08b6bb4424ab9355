//! Is there a second direction that explains the ranges equally well?
//!
//! With q_k = n_k/(n_k·v) a range error of board k is proportional to q_k·v − 1: a quadratic form on the sphere of
//! directions, with two minima at most. If all q_k are in one plane, of normal e, the ranges do not change when v is
//! mirrored at that plane: this happens for boards whose tilts, as vectors tan α across the beam, are on one line.
//! Vertical boards are the well-known case, e = z: φ and −φ cannot be distinguished.

use crate::element::attempt::{Attempt, ElementFit};
use crate::element::initial::FARTHEST_START;
use crate::element::solve;
use catoptric_model::{Deflection, beam};
use nalgebra::{DVector, Matrix3, SymmetricEigen};

/// Difference of χ² up to which two directions count as equally good: odds of a thousand to one (2 ln 1000).
const INDIFFERENT: f64 = 13.8;

/// Directions closer than this count as one, in radians.
const ONE_DIRECTION: f64 = 1e-6;

/// Smallest range error assumed, in meters.
const MIN_SD: f64 = 1e-6;

/// Another direction that agrees with both the readings and the drawing.
pub(crate) fn second_direction(attempt: &Attempt, fit: &ElementFit) -> Option<Deflection> {
    let observations = attempt.observations(&fit.poses);
    let at = &fit.solution.deflection;
    let v = at.exit_direction(attempt.azimuth);
    let mut normal = Matrix3::zeros();
    for o in &observations {
        let n = o.board.plane.normal.into_inner();
        let q = n / n.dot(&v);
        normal += q * q.transpose();
    }
    let eigen = SymmetricEigen::new(normal);
    let e = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let mirrored = v.into_inner() - e * (2.0 * v.dot(&e));
    let near_drawing = |d: &Deflection| {
        let drawn = attempt.nominal.exit_direction(attempt.azimuth);
        beam::angle_between(&d.exit_direction(attempt.azimuth), &drawn) < FARTHEST_START
    };
    let start = Deflection::from_exit(
        attempt.azimuth,
        &nalgebra::Unit::try_new(mirrored, f64::MIN_POSITIVE)?,
        at.distance,
    );
    if !near_drawing(&start) {
        return None;
    }
    let element = attempt.element(&observations);
    let settled =
        |from: &Deflection| solve::batch(&element, from, attempt.work.options).filter(|s| s.converged);
    let (first, other) = (settled(at)?, settled(&start)?);
    let apart = beam::angle_between(
        &other.deflection.exit_direction(attempt.azimuth),
        &first.deflection.exit_direction(attempt.azimuth),
    );
    if !near_drawing(&other.deflection) || apart < ONE_DIRECTION {
        return None;
    }
    let budget = attempt.budget(at, &observations)?;
    let mut covariance = budget.covariance;
    for i in 0..covariance.nrows() {
        covariance[(i, i)] += MIN_SD * MIN_SD;
    }
    let factor = covariance.cholesky()?;
    let statistic = |residuals: &[f64]| {
        let r = DVector::from_column_slice(residuals);
        r.dot(&factor.solve(&r))
    };
    let excess = statistic(&other.residuals) - statistic(&first.residuals);
    (excess < INDIFFERENT).then_some(other.deflection)
}
