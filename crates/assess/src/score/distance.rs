//! Errors of d in units of their standard deviation.
//!
//! The standard deviation is the one that the calibration states for the element (`distance_sd_m`); otherwise the one of
//! its facet's plane, d = h/(m·u); otherwise what the session believes about a bare distance (step 3), which any
//! calibration can reach.

use catoptric_model::calibration::FacetEstimate;
use catoptric_model::{BeamEstimate, Calibration, Session, beam, frame};
use nalgebra::{Matrix3, Unit, Vector3};

/// Rounding of ranges and of files, in meters: no distance is stated better than this.
const ROUNDING_M: f64 = 1e-5;

/// Standard deviation of an element's d, in meters.
pub(super) fn sd(session: &Session, calibration: &Calibration, estimate: &BeamEstimate) -> f64 {
    let of_facet = || {
        let name = estimate.facet.as_ref()?;
        let facet = calibration.facets.iter().find(|f| f.facet == *name)?;
        of_plane(facet, session.scanner.scan.azimuth(estimate.beam))
    };
    let stated = estimate.distance_sd_m.or_else(of_facet);
    libm::hypot(
        stated.unwrap_or(session.bare_structure.distance_sd_mm * 1e-3),
        ROUNDING_M,
    )
}

/// Standard deviation of d = h/(m·u) from the covariance of the plane; `None` if the facet does not face the beam.
fn of_plane(facet: &FacetEstimate, azimuth: f64) -> Option<f64> {
    let normal = Unit::try_new(Vector3::from(facet.normal), f64::EPSILON)?;
    let u = beam::direction(azimuth);
    let facing = normal.dot(&u);
    let distance = facet.offset_m / facing;
    let (a, b) = frame::tangent_basis(&normal);
    let along = Vector3::new(-distance * a.dot(&u), -distance * b.dot(&u), 1.0) / facing;
    let covariance = Matrix3::from_fn(|i, j| facet.covariance[i][j]);
    let variance = along.dot(&(covariance * along));
    (variance.is_finite() && variance >= 0.0).then(|| variance.sqrt())
}
