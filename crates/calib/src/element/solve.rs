//! The angles of one element from its ranges (step 11): batch Gauss–Newton, Eqs. (7)–(8).
//!
//! Every step corrects the readings, Eq. (3), and places the mirror at the current estimate, so that noise-free data
//! return the truth itself and not a point near it.

use crate::judge::levers::{levers, off_zero};
use crate::options::{JacobianForm, Options};
use crate::readings::jacobian;
use crate::readings::jacobian::OutgoingRay;
use crate::readings::observations::Observation;
use catoptric_model::bias::ColoredBias;
use catoptric_model::{BoardPlane, CorrectedRange, Deflection, RangeBias, beam};
use nalgebra::{Matrix2, Unit, Vector2, Vector3};

/// Lever arm, in meters per radian, below which a direction counts as undetermined within the iteration.
///
/// A residual of a millimeter along such a lever would turn the beam by 11°: no step is taken along it. Elements with
/// levers several times longer are already reported as unobservable.
const SHORTEST_LEVER: f64 = 5e-3;

/// Longest step of one iteration, in radians; a longer one would leave the linear neighborhood of the range equation.
const LONGEST_STEP: f64 = 0.5;

/// Smallest |m·u| by which a mirror's thickness is divided; the spot would miss a mirror at a more grazing angle.
const MIN_FACING: f64 = 0.05;

/// Step 3: range to the structure before the mirror was attached, and the mirror's thickness along its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BareDistance {
    /// Distance from the sensor origin to the bare structure, in meters.
    pub distance: f64,
    /// Thickness t of the mirror, in meters.
    pub thickness: f64,
}

impl BareDistance {
    /// Distance d to the mirror's face for a beam that leaves it in direction v: bare − t/|m·u|.
    ///
    /// The normal m is along v − u, so |m·u| = √((1 − u·v)/2), here computed as |v − u|/2, which keeps its digits.
    #[doc(alias = "d")]
    pub fn to_mirror(&self, beam_azimuth: f64, exit: &Unit<Vector3<f64>>) -> f64 {
        self.face_along(&beam::direction(beam_azimuth), exit)
    }

    fn face_along(&self, u: &Unit<Vector3<f64>>, exit: &Unit<Vector3<f64>>) -> f64 {
        if self.thickness == 0.0 {
            return self.distance;
        }
        let facing = 0.5 * (exit.into_inner() - u.into_inner()).norm();
        self.distance - self.thickness / facing.max(MIN_FACING)
    }
}

/// One element to be solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SoleElement<'a> {
    /// Base azimuth θ_b, in radians.
    pub azimuth: f64,
    /// Its readings of the boards it hits.
    pub observations: &'a [Observation<'a>],
    /// Measured distance of its mirror.
    pub distance: BareDistance,
    /// The believed biases.
    pub bias: &'a RangeBias,
}

/// The result of an iteration.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// θ_a, φ and d.
    pub deflection: Deflection,
    /// Steps taken.
    pub iterations: usize,
    /// Whether the last step was below the tolerance.
    pub converged: bool,
    /// z − r̂ of each board, in meters.
    pub residuals: Vec<f64>,
}

/// What does not depend on the estimate: the beam's direction, the biases of each board, and the number of readings.
struct Known<'e> {
    u: Unit<Vector3<f64>>,
    biases: Vec<ColoredBias<'e>>,
    readings: f64,
}

/// One board linearized at an estimate.
pub(crate) struct Row {
    /// (∂r/∂θ_a, ∂r/∂φ).
    pub(crate) gradient: Vector2<f64>,
    /// Predicted range r̂, in meters.
    pub(crate) predicted: f64,
    /// E_a + E_c + E_r at the estimate, in meters.
    pub(crate) bias: f64,
}

impl SoleElement<'_> {
    /// The estimate with its distance d updated.
    pub fn place(&self, azimuth: f64, elevation: f64) -> Deflection {
        let bare = Deflection {
            azimuth,
            elevation,
            distance: self.distance.distance,
        };
        if self.distance.thickness == 0.0 {
            return bare;
        }
        let distance = self
            .distance
            .to_mirror(self.azimuth, &bare.exit_direction(self.azimuth));
        Deflection { distance, ..bare }
    }

    /// What does not depend on the estimate.
    fn known(&self) -> Known<'_> {
        Known {
            u: beam::direction(self.azimuth),
            biases: self
                .observations
                .iter()
                .map(|o| self.bias.on(o.board.color))
                .collect(),
            readings: self.observations.iter().map(|o| o.board.count as f64).sum(),
        }
    }

    /// An estimate with its distance, and its ray.
    fn aim(&self, known: &Known, azimuth: f64, elevation: f64) -> (Deflection, OutgoingRay) {
        let ray = OutgoingRay::aimed(&known.u, self.azimuth + azimuth, elevation);
        let distance = self.distance.face_along(&known.u, &ray.direction);
        let at = Deflection {
            azimuth,
            elevation,
            distance,
        };
        (at, ray.leaving_at(distance))
    }

    /// One board linearized at an estimate; `None` if the ray misses it.
    #[inline(always)]
    fn row(
        &self,
        observed: (&Observation, &ColoredBias),
        at: &Deflection,
        ray: &OutgoingRay,
        form: JacobianForm,
    ) -> Option<Row> {
        let plane = &observed.0.board.plane;
        let (predicted, gradient) = match form {
            JacobianForm::Analytic => ray.range_and_angles(plane)?,
            JacobianForm::CentralDifference => self.by_differences(plane, at, ray)?,
        };
        let terms = observed.1.terms(predicted, plane.cos_incidence(&ray.direction));
        Some(Row {
            gradient,
            predicted,
            bias: terms.total(),
        })
    }

    #[inline(never)]
    fn by_differences(
        &self,
        plane: &BoardPlane,
        at: &Deflection,
        ray: &OutgoingRay,
    ) -> Option<(f64, Vector2<f64>)> {
        let angles = jacobian::central(at, self.azimuth, plane)?.angles();
        Some((ray.range(plane)?, angles))
    }

    /// HᵀH and Hᵀ(z − r̂) at an estimate, each board weighted by its share of all readings.
    fn normal(
        &self,
        known: &Known,
        at: &Deflection,
        ray: &OutgoingRay,
        form: JacobianForm,
    ) -> Option<(Matrix2<f64>, Vector2<f64>)> {
        let ([mut aa, mut ae, mut ee], [mut a, mut e]) = ([0.0; 3], [0.0; 2]);
        for (observed, bias) in self.observations.iter().zip(&known.biases) {
            let row = self.row((observed, bias), at, ray, form)?;
            let weight = observed.board.count as f64 / known.readings;
            let by = row.gradient * weight;
            let residual = observed.mean.0 - row.bias - row.predicted;
            aa += by.x * row.gradient.x;
            ae += by.x * row.gradient.y;
            ee += by.y * row.gradient.y;
            a += by.x * residual;
            e += by.y * residual;
        }
        Some((Matrix2::new(aa, ae, ae, ee), Vector2::new(a, e)))
    }

    /// All boards linearized at an estimate; `None` if the ray misses one.
    pub(crate) fn linearize(&self, at: &Deflection, options: &Options) -> Option<Vec<Row>> {
        let ray = OutgoingRay::of(at, self.azimuth);
        let row = |o: &Observation| self.row((o, &self.bias.on(o.board.color)), at, &ray, options.jacobian);
        self.observations.iter().map(row).collect()
    }

    /// z − r̂ of each board at an estimate, with z corrected by Eq. (3), in meters; `None` if the ray misses one.
    pub fn residuals(&self, at: &Deflection) -> Option<Vec<f64>> {
        let ray = OutgoingRay::of(at, self.azimuth);
        let mut residuals = Vec::with_capacity(self.observations.len());
        for o in self.observations {
            let predicted = ray.range(&o.board.plane)?;
            let cos_incidence = o.board.plane.cos_incidence(&ray.direction);
            let CorrectedRange(z) = self.bias.correct(o.mean, predicted, cos_incidence, o.board.color);
            residuals.push(z - predicted);
        }
        Some(residuals)
    }

    /// A solution at an estimate, with the added azimuth within (−π, π].
    pub(crate) fn finish(&self, at: &Deflection, iterations: usize, converged: bool) -> Option<Solution> {
        let exit = at.exit_direction(self.azimuth);
        let deflection = Deflection::from_exit(self.azimuth, &exit, at.distance);
        Some(Solution {
            residuals: self.residuals(&deflection)?,
            deflection,
            iterations,
            converged,
        })
    }
}

/// Batch Gauss–Newton: Δx = (HᵀH)⁻¹Hᵀ(z − r̂), Eq. (8), over all readings, repeated until the step is short.
///
/// The mean of a board's readings, weighted by their number, gives the same sums as the individual readings. `None` if
/// the ray misses a board during the iteration.
#[doc(alias = "RLS")]
pub fn batch(element: &SoleElement, start: &Deflection, options: &Options) -> Option<Solution> {
    let known = element.known();
    let (mut at, mut ray) = element.aim(&known, start.azimuth, start.elevation);
    for iteration in 1..=options.max_iterations {
        let (normal, right) = element.normal(&known, &at, &ray, options.jacobian)?;
        let step = determined_step(&normal, &right, off_zero(ray.cos_elevation()));
        (at, ray) = element.aim(&known, at.azimuth + step.x, at.elevation + step.y);
        if step.norm() < options.step_tolerance_rad {
            return element.finish(&at, iteration, true);
        }
    }
    element.finish(&at, options.max_iterations, false)
}

/// The step along the directions that the boards determine, in (θ_a, φ).
pub(crate) fn determined_step(
    normal: &Matrix2<f64>,
    right: &Vector2<f64>,
    cos_elevation: f64,
) -> Vector2<f64> {
    // Both levers are long enough if the shorter one squared, which is at least det/trace, is: no decomposition is
    // needed.
    let tangent = Matrix2::new(
        normal[(0, 0)] / (cos_elevation * cos_elevation),
        normal[(0, 1)] / cos_elevation,
        normal[(1, 0)] / cos_elevation,
        normal[(1, 1)],
    );
    let determinant = tangent.determinant();
    if determinant > SHORTEST_LEVER * SHORTEST_LEVER * tangent.trace()
        && let Some(inverse) = normal.try_inverse()
    {
        return (inverse * right).cap_magnitude(LONGEST_STEP);
    }
    let (values, vectors) = levers(normal, cos_elevation);
    // In the tangent plane (cos φ·δθ, δφ) both components are angles on the sphere.
    let scale = Vector2::new(1.0 / cos_elevation, 1.0);
    let right = right.component_mul(&scale);
    let mut step = Vector2::zeros();
    for (value, vector) in values.iter().zip(vectors.column_iter()) {
        if *value > SHORTEST_LEVER * SHORTEST_LEVER {
            step += vector * (vector.dot(&right) / value);
        }
    }
    step.component_mul(&scale).cap_magnitude(LONGEST_STEP)
}
