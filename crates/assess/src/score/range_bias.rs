//! Errors of the range biases that a calibration states, at stated references.
//!
//! A reference is a target of a board's color, face-on and at 45°, at each distance of the calibration's table of E_r; of the
//! session's table if it has none of its own, and at 1 m if neither has one. The error there is that of E_r + E_a + E_c,
//! Eq. (3). Its standard deviation follows from those that the calibration states for the numbers of the biases, which may
//! depend on each other in any way; else from the session's beliefs, which any calibration can keep and which are independent.

use super::residual::ROUNDING_MM;
use catoptric_calib::CommonErrors;
use catoptric_model::{Calibration, RangeBias, Session};
use catoptric_sim::Truth;
use std::f64::consts::FRAC_1_SQRT_2;

/// Distance of the references if there is no table of E_r, in meters.
const ALONE_M: f64 = 1.0;

/// cos θ_N of the references.
const COS_INCIDENCE: [f64; 2] = [1.0, FRAC_1_SQRT_2];

/// Largest standard deviation of a bias that is taken for a claim, in beliefs and in millimeters: what is known worse than
/// that corrects nothing.
const MOST_BELIEFS: f64 = 3.0;
const MOST_MM: f64 = 5.0;

/// The error of the biases at the reference where it is largest in units of its standard deviation.
pub(super) struct WorstBias {
    /// Distance of the target, in meters.
    pub(super) range_m: f64,
    /// Its color.
    pub(super) color: String,
    /// Angle of incidence, in degrees.
    pub(super) incidence_deg: f64,
    /// Error, in millimeters.
    pub(super) error_mm: f64,
    /// Its standard deviation, in millimeters.
    pub(super) sd_mm: f64,
    /// Number of references.
    pub(super) references: usize,
}

impl WorstBias {
    /// Squared error in units of its variance.
    pub(super) fn square(&self) -> f64 {
        (self.error_mm / self.sd_mm).powi(2)
    }
}

/// Why the biases of a calibration cannot be compared with a truth; `None` if they can.
pub(super) fn incomparable(calibration: &Calibration, truth: Option<&Truth>) -> Option<&'static str> {
    match (truth, &calibration.bias) {
        (None, _) => Some("there is no truth"),
        (_, None) => Some("the calibration states no range biases"),
        (Some(truth), _) if truth.detector_errors => {
            Some("the detector has errors of its own, which the truth does not state as biases")
        }
        (Some(_), Some(_)) => None,
    }
}

/// The largest error of the biases that a calibration states; `None` if they cannot be compared.
pub(super) fn worst(
    session: &Session,
    calibration: &Calibration,
    truth: Option<&Truth>,
) -> Option<WorstBias> {
    let truth = truth.filter(|truth| incomparable(calibration, Some(truth)).is_none())?;
    let stated = calibration.bias.as_ref()?;
    let errors = CommonErrors::of(session);
    let stated_sds = stated_sds(&errors, calibration);
    let ranges = ranges(session, stated);
    let references = || {
        ranges.iter().flat_map(|range| {
            let of_color = move |color| COS_INCIDENCE.into_iter().map(move |cos| (*range, color, cos));
            errors.colors().iter().flat_map(of_color)
        })
    };
    let at = |(range, color, cos): (f64, &&str, f64)| {
        let error = stated.terms(range, cos, color).total() - truth.bias.terms(range, cos, color).total();
        let row: Vec<f64> = errors.row(range, cos, color).iter().map(|m| 1e3 * m).collect();
        let sd_mm = match &stated_sds {
            Some(sds) => row.iter().zip(sds).map(|(mm, sd)| mm.abs() * sd).sum(),
            None => row.iter().map(|mm| mm * mm).sum::<f64>().sqrt(),
        };
        WorstBias {
            range_m: range,
            color: (*color).to_owned(),
            incidence_deg: libm::acos(cos).to_degrees(),
            error_mm: 1e3 * error,
            sd_mm: libm::hypot(sd_mm, ROUNDING_MM),
            references: references().count(),
        }
    };
    references()
        .map(at)
        .max_by(|a, b| a.square().total_cmp(&b.square()))
}

/// The distances of the references, in meters.
fn ranges(session: &Session, stated: &RangeBias) -> Vec<f64> {
    let tables = [&stated.distance.range_m, &session.believed.bias.distance.range_m];
    let own = tables.into_iter().find(|table| !table.is_empty());
    own.map_or_else(|| vec![ALONE_M], Clone::clone)
}

/// The standard deviation of each number of the biases as the calibration states it, over the session's belief; `None` if it
/// states none of them.
fn stated_sds(errors: &CommonErrors<'_>, calibration: &Calibration) -> Option<Vec<f64>> {
    let parameters = &calibration.assessment.as_ref()?.parameters;
    let stated = |name: &str| parameters.iter().find(|p| p.name == name).map(|p| p.sd);
    let named = errors.named();
    let any = named.iter().any(|(name, _)| stated(name).is_some());
    let over = |(name, believed): (String, f64)| match stated(&name) {
        Some(sd) if believed > 0.0 => sd.min(MOST_MM.max(MOST_BELIEFS * believed)) / believed,
        Some(_) | None => 1.0,
    };
    any.then(|| named.into_iter().map(over).collect())
}
