//! Do the boards determine both angles? A direction that they leave open is named, never given a number.
//!
//! Each board contributes p = s·tan α along the direction of its tilt, seen along the beam; if all p are collinear with
//! the origin (one tilt axis, one orientation, boards face-on) one direction of (θ_a, φ) changes no range.

use crate::judge::covariance::Budget;
use crate::judge::levers::{levers, libm_cos};
use nalgebra::{Matrix2, Vector2};

/// Standard deviation beyond which a direction counts as unobservable, in radians (3°): more than the drawing's error.
pub const WEAKEST_SD: f64 = 3.0 * std::f64::consts::PI / 180.0;

/// Smallest range error assumed here, in meters: no belief makes a scanner better than a millimeter.
const MIN_RANGE_ERROR: f64 = 1e-3;

/// Ratio of levers below which the boards share a tilt; above it, all of them are face-on.
const ONE_SIDED: f64 = 0.3;

/// A direction that the boards leave open.
#[derive(Debug, Clone, PartialEq)]
pub struct Weakness {
    /// Unit vector in (θ_a, φ), its larger component positive.
    pub null_direction: [f64; 2],
    /// What is wrong with the boards.
    pub reason: String,
}

/// The open direction of an element's boards, if any.
///
/// The budget should leave the mounting out: its uncertainty turns all beams identically, whatever the boards.
pub fn weakness(budget: &Budget, elevation: f64) -> Option<Weakness> {
    let cos_elevation = libm_cos(elevation);
    let by_board = budget.jacobian.transpose() * &budget.jacobian;
    let by_board = Matrix2::new(
        by_board[(0, 0)],
        by_board[(0, 1)],
        by_board[(1, 0)],
        by_board[(1, 1)],
    );
    let (squared, directions) = levers(&by_board, cos_elevation);
    let weakest = squared.imin();
    let (short, long) = (squared.min().max(0.0).sqrt(), squared.max().max(0.0).sqrt());
    let to_tangent = Matrix2::from_diagonal(&Vector2::new(cos_elevation, 1.0));
    let believed = budget.sandwich().map_or(f64::INFINITY, |c| {
        (to_tangent * c * to_tangent)
            .symmetric_eigenvalues()
            .max()
            .max(0.0)
            .sqrt()
    });
    let sd = believed.max(MIN_RANGE_ERROR / short);
    if sd <= WEAKEST_SD {
        return None;
    }
    let tangent = directions.column(weakest);
    let open = Vector2::new(tangent.x / cos_elevation, tangent.y).normalize();
    let open = if open[open.iamax()] < 0.0 { -open } else { open };
    let boards = budget.jacobian.nrows();
    let reason = if short < ONE_SIDED * long {
        format!("the {boards} boards are tilted along one direction only, seen along the beam")
    } else {
        format!("the {boards} boards are nearly face-on to the beam")
    };
    let sd = if sd.is_finite() && sd < std::f64::consts::PI {
        format!(
            "; the direction across is known to {:.1}° at best",
            sd.to_degrees()
        )
    } else {
        "; the direction across changes no range".to_owned()
    };
    Some(Weakness {
        null_direction: [open.x, open.y],
        reason: reason + &sd,
    })
}
