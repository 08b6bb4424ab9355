//! The angles of one element by recursive least squares: reading by reading, in gain form.
//!
//! With P the covariance over σ² and h the row of a reading, K = P·h/(1 + hᵀP·h), x ← x + K·(y − hᵀx), P ← P − K·hᵀP. A
//! sweep over all readings solves the problem linearized at its start; sweeps repeat at the new estimate.
//!
//! Unlike the paper, whose "RLS" is the batch form of Eq. (8), this is the recursion; both reach the same estimate.

use crate::element::solve::{SoleElement, Solution};
use crate::judge::levers::{levers, libm_cos};
use crate::options::Options;
use catoptric_model::Deflection;
use nalgebra::{Matrix2, Vector2};

/// Smallest ratio of lever arms at which the first readings may start the recursion.
///
/// A diffuse prior P = ∞ would bias the estimate or cost digits. Until the boards read so far span both angles, the
/// sums of Eq. (8) are accumulated instead (the information form), and P starts as their exact inverse.
const STARTING_RATIO: f64 = 1e-2;

/// Limit of a sweep over thousands of readings by rounding, in radians.
const SWEEP_TOLERANCE: f64 = 1e-12;

/// State of the recursion within a sweep.
enum State {
    /// Both angles not yet determined: Σ h hᵀ and Σ h y.
    Gathering(Matrix2<f64>, Vector2<f64>),
    /// Estimate and P.
    Tracking(Vector2<f64>, Matrix2<f64>),
}

/// Recursive least squares over the readings of each observation, in order, from a start.
///
/// `readings` holds the raw ranges, in meters, of each observation. `None` if the ray misses a board or the readings do
/// not determine both angles.
///
/// ```
/// use catoptric_calib::{Options, observations::{BoardView, Observation}, recursive, solve};
/// use catoptric_model::{BoardPlane, Deflection, RangeBias, RawRange, range};
/// use nalgebra::{Point3, Unit, Vector3};
///
/// let truth = Deflection { azimuth: 0.2, elevation: 0.9, distance: 0.07 };
/// let planes = [[-0.9, 0.0, -0.4], [-0.5, 0.6, -0.6], [-0.5, -0.6, -0.6]]
///     .map(|n| BoardPlane::new(Point3::new(1.0, 0.4, 1.4), Unit::new_normalize(Vector3::from(n))));
/// let readings = planes.map(|p| vec![range::predict(&truth, 0.3, &p).expect("the beam hits the board"); 4]);
/// let observations: Vec<_> = planes.iter().zip(&readings).map(|(plane, z)| Observation {
///     board: BoardView { plane: *plane, markers: &[], color: "white", noise_sd: 0.004, count: 4 },
///     mean: RawRange(z[0]),
/// }).collect();
/// let distance = solve::BareDistance { distance: 0.07, thickness: 0.0 };
/// let bias = RangeBias::default();
/// let element = solve::SoleElement { azimuth: 0.3, observations: &observations, distance, bias: &bias };
/// let start = Deflection { azimuth: 0.25, elevation: 0.85, distance: 0.07 };
/// let found = recursive::recursive(&element, &readings, &start, &Options::default()).expect("three boards suffice");
/// assert!((found.deflection.azimuth - 0.2).abs() < 1e-12 && (found.deflection.elevation - 0.9).abs() < 1e-12);
/// ```
pub fn recursive(
    element: &SoleElement,
    readings: &[Vec<f64>],
    start: &Deflection,
    options: &Options,
) -> Option<Solution> {
    let mut at = element.place(start.azimuth, start.elevation);
    for iteration in 1..=options.max_iterations {
        let step = sweep(element, readings, &at, options)?;
        at = element.place(at.azimuth + step.x, at.elevation + step.y);
        if step.norm() < options.step_tolerance_rad.max(SWEEP_TOLERANCE) {
            return element.finish(&at, iteration, true);
        }
    }
    element.finish(&at, options.max_iterations, false)
}

/// One sweep: the change of (θ_a, φ) after the last reading.
fn sweep(
    element: &SoleElement,
    readings: &[Vec<f64>],
    at: &Deflection,
    options: &Options,
) -> Option<Vector2<f64>> {
    let mut state = State::Gathering(Matrix2::zeros(), Vector2::zeros());
    for (row, series) in element.linearize(at, options)?.iter().zip(readings) {
        for raw in series {
            let y = raw - row.bias - row.predicted;
            state = state.update(&row.gradient, y, libm_cos(at.elevation));
        }
    }
    match state {
        State::Tracking(x, _) => Some(x),
        State::Gathering(information, sum) => Some(information.try_inverse()? * sum),
    }
}

impl State {
    /// Processes one reading: y = hᵀx + noise.
    fn update(self, h: &Vector2<f64>, y: f64, cos_elevation: f64) -> Self {
        match self {
            Self::Gathering(mut information, mut sum) => {
                information += h * h.transpose();
                sum += h * y;
                let squared = levers(&information, cos_elevation).0;
                let spans = squared.min() > STARTING_RATIO * STARTING_RATIO * squared.max();
                match information.try_inverse() {
                    Some(p) if spans => Self::Tracking(p * sum, p),
                    _ => Self::Gathering(information, sum),
                }
            }
            Self::Tracking(mut x, mut p) => {
                let ph = p * h;
                let gain = ph / (1.0 + h.dot(&ph));
                x += gain * (y - h.dot(&x));
                p -= gain * ph.transpose();
                Self::Tracking(x, p)
            }
        }
    }
}
