//! A covariance read in another way: another order, unit, or standard deviations in its place.

use crate::score::mistake::Mistake;
use crate::score::statistics::{mahalanobis_squared, mean};
use crate::score::{ElementError, Honesty, Score, wrap};
use catoptric_model::Calibration;
use nalgebra::{Matrix2, Vector2};
use std::f64::consts::PI;

/// Mean normalized squared errors that an honest covariance usually has.
const USUAL: [f64; 2] = [0.3, 1.8];

/// Largest error of a usual calibration over the limit of the experiment.
const USUAL_ERROR: f64 = 10.0;

pub(super) fn recognize(
    score: &Score,
    scored: &[&ElementError],
    calibration: &Calibration,
) -> Option<Mistake> {
    match score.honesty {
        Some(Honesty::OverConfident | Honesty::UnderConfident) => {}
        Some(Honesty::Honest | Honesty::Doubtful) | None => return None,
    }
    // Errors far above what boards allow are themselves what is wrong.
    if score.per_axis_rms_deg > USUAL_ERROR * score.crlb_per_axis_deg {
        return None;
    }
    let degrees = (180.0 / PI).powi(2);
    type Correction = (&'static str, fn(&Matrix2<f64>, f64) -> Matrix2<f64>);
    let corrections: [Correction; 5] = [
        ("the covariance in the order (φ, θ_a)", |c, _| {
            Matrix2::new(c[(1, 1)], c[(0, 1)], c[(1, 0)], c[(0, 0)])
        }),
        ("standard deviations instead of variances", |c, _| {
            c.component_mul(c)
        }),
        ("the covariance in square degrees", |c, degrees| c / degrees),
        (
            "the covariance converted to square radians twice",
            |c, degrees| c * degrees,
        ),
        ("the inverse of the covariance", |c, _| {
            c.try_inverse().unwrap_or_else(Matrix2::zeros)
        }),
    ];
    let nees = |of: &dyn Fn(&Matrix2<f64>) -> Matrix2<f64>| {
        mean(scored.iter().filter_map(|e| {
            let c = calibration.beam(e.beam)?.covariance_rad2?;
            let error = Vector2::new(
                wrap(e.estimate.azimuth - e.truth.azimuth),
                e.estimate.elevation - e.truth.elevation,
            );
            let c = of(&Matrix2::new(c[0][0], c[0][1], c[1][0], c[1][1]));
            Some(0.5 * mahalanobis_squared(&error, &c))
        }))
    };
    corrections.into_iter().find_map(|(words, of)| {
        let would_be = nees(&|c| of(c, degrees));
        (USUAL[0]..=USUAL[1]).contains(&would_be).then(|| Mistake {
            correction: words.to_owned(),
            figure: "nees_mean",
            found: score.nees_mean,
            would_be,
        })
    })
}
