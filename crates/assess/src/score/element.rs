//! The errors of each solved element, with its stated covariance and its bounds.

use super::bound::{Knowable, largest_sd};
use super::distance;
use super::statistics::mahalanobis_squared;
use catoptric_calib::observability::WEAKEST_SD;
use catoptric_model::{BeamEstimate, Calibration, Deflection, Session};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use nalgebra::{Matrix2, Vector2};

/// Errors of one solved element, in radians, for plots.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementError {
    /// Beam.
    pub beam: usize,
    /// Facet that deflects it in truth.
    pub facet: String,
    /// Its class in truth.
    pub class: BeamClass,
    /// Truth.
    pub truth: Deflection,
    /// Estimate; d is 0 if the calibration has none.
    pub estimate: Deflection,
    /// Whether the calibration has d.
    pub has_distance: bool,
    /// Standard deviation of d, in meters: as stated, or as its facet's plane or the session has it.
    pub distance_sd: f64,
    /// cos φ·δθ.
    pub across: f64,
    /// δφ.
    pub up: f64,
    /// Stated standard deviations of `across` and `up`.
    pub sigma: Option<[f64; 2]>,
    /// Stated standard deviation along the axis where it is largest.
    pub stated_sd: Option<f64>,
    /// eᵀP⁻¹e; `None` without a covariance.
    pub mahalanobis_squared: Option<f64>,
    /// Bound on the covariance of (`across`, `up`) for any estimate from the dataset.
    pub bound: Option<Matrix2<f64>>,
    /// The same for an estimate of this element from its own boards alone.
    pub alone_bound: Option<Matrix2<f64>>,
}

/// Standard deviation up to which a direction counts as solved, in radians: beyond it a linearized covariance has no meaning,
/// and boards count as leaving the direction open.
pub const USEFUL_SD: f64 = WEAKEST_SD;

/// Largest standard deviation of (cos φ·δθ, δφ) that an element states; `None` without a covariance.
pub(super) fn stated_sd(estimate: &BeamEstimate) -> Option<f64> {
    let cos = estimate.elevation_rad?.cos();
    let c = estimate.covariance_rad2?;
    let to_tangent = Matrix2::new(cos, 0.0, 0.0, 1.0);
    Some(largest_sd(
        &(to_tangent * Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]) * to_tangent),
    ))
}

/// Whether an element is solved and does not state that it is hardly known.
pub(super) fn usefully_solved(estimate: &BeamEstimate) -> bool {
    solved(estimate).is_some() && stated_sd(estimate).is_none_or(|sd| sd <= USEFUL_SD)
}

/// Computes the errors of every solved element that is deflected once in truth.
pub(super) fn compare(
    session: &Session,
    calibration: &Calibration,
    truth: &Truth,
    knowable: &Knowable,
) -> Vec<ElementError> {
    let mut elements = Vec::new();
    let beams = session.scanner.scan.beams();
    for true_beam in truth.beams.iter().filter(|b| b.beam < beams) {
        let (Some(actual), Some(estimate)) = (true_beam.deflection(), calibration.beam(true_beam.beam))
        else {
            continue;
        };
        let Some(found) = solved(estimate) else {
            continue;
        };
        if !matches!(true_beam.status, BeamClass::Deflected | BeamClass::Split) {
            continue;
        }
        let error = Vector2::new(
            wrap(found.azimuth - actual.azimuth),
            found.elevation - actual.elevation,
        );
        let cos = actual.elevation.cos();
        let covariance = estimate
            .covariance_rad2
            .map(|c| Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]));
        let to_tangent = Matrix2::new(cos, 0.0, 0.0, 1.0);
        elements.push(ElementError {
            beam: true_beam.beam,
            facet: true_beam.facets.first().cloned().unwrap_or_default(),
            class: true_beam.status,
            truth: actual,
            estimate: found,
            has_distance: estimate.distance_m.is_some(),
            distance_sd: distance::sd(session, calibration, estimate),
            across: cos * error.x,
            up: error.y,
            stated_sd: stated_sd(estimate),
            sigma: covariance.map(|c| [cos * c[(0, 0)].sqrt(), c[(1, 1)].sqrt()]),
            mahalanobis_squared: covariance.map(|c| mahalanobis_squared(&error, &c)),
            bound: knowable
                .limits
                .get(&true_beam.beam)
                .map(|b| to_tangent * b * to_tangent),
            alone_bound: knowable
                .bounds
                .get(&true_beam.beam)
                .map(|b| to_tangent * b * to_tangent),
        });
    }
    elements
}

/// Returns the deflection of an element if it is solved and its angles are finite.
pub(super) fn solved(estimate: &BeamEstimate) -> Option<Deflection> {
    estimate
        .deflection()
        .filter(|d| d.azimuth.is_finite() && d.elevation.is_finite() && d.distance.is_finite())
}

/// Wraps a difference of azimuths to (−π, π]; one in this interval is returned bit for bit.
pub(crate) fn wrap(difference: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if -PI < difference && difference <= PI {
        return difference;
    }
    let turned = difference.rem_euclid(TAU);
    if turned > PI { turned - TAU } else { turned }
}
