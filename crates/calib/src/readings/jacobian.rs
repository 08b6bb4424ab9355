//! Derivatives of the range equation, Cooper Eq. (6): analytic, and by the central differences of Eq. (7).
//!
//! With s = n·(c − P_L1)/(n·v) a change dv of the direction changes s by −s·(n·dv)/(n·v), and a change of d moves P_L1
//! along u: dr/dd = 1 − (n·u)/(n·v).

use catoptric_model::{BoardPlane, Deflection, beam, range};
use nalgebra::{Point3, RowVector6, Unit, Vector2, Vector3};

/// δθ and δφ of Eq. (7), in radians.
pub const DIFFERENCE_STEP: f64 = 1e-3;

/// Derivatives of a range with respect to the three numbers of a deflection.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeGradient {
    /// ∂r/∂θ_a, in meters per radian.
    pub azimuth: f64,
    /// ∂r/∂φ, in meters per radian.
    pub elevation: f64,
    /// ∂r/∂d, in meters per meter.
    pub distance: f64,
}

impl RangeGradient {
    /// The row of H: (∂r/∂θ_a, ∂r/∂φ).
    pub fn angles(&self) -> Vector2<f64> {
        Vector2::new(self.azimuth, self.elevation)
    }
}

/// The analytic derivatives. `None` if the outgoing ray misses the plane.
///
/// ```
/// use catoptric_calib::jacobian;
/// use catoptric_model::{BoardPlane, Deflection};
/// use nalgebra::{Point3, Unit, Vector3};
/// let up = Deflection { azimuth: 0.2, elevation: 0.9, distance: 0.07 };
/// let board = BoardPlane::new(Point3::new(1.0, 0.0, 1.5), Unit::new_normalize(Vector3::new(-1.0, 0.4, -0.8)));
/// let exact = jacobian::analytic(&up, 0.3, &board).expect("the beam meets the board");
/// let difference = jacobian::central(&up, 0.3, &board).expect("the beam meets the board");
/// assert!((exact.azimuth - difference.azimuth).abs() < 1e-5 * exact.azimuth.abs());
/// ```
#[doc(alias = "H")]
pub fn analytic(deflection: &Deflection, beam_azimuth: f64, board: &BoardPlane) -> Option<RangeGradient> {
    OutgoingRay::of(deflection, beam_azimuth).gradient(board)
}

/// A deflected beam with its derivatives, for use with several boards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OutgoingRay {
    /// P_L1, in the sensor frame, in meters.
    pub origin: Point3<f64>,
    /// v.
    pub direction: Unit<Vector3<f64>>,
    /// u, the direction before the mirror, and d, in meters.
    base: Unit<Vector3<f64>>,
    distance: f64,
    /// ∂v/∂θ_a and ∂v/∂φ.
    by_azimuth: Vector3<f64>,
    by_elevation: Vector3<f64>,
}

impl OutgoingRay {
    /// The ray of a deflection.
    pub fn of(deflection: &Deflection, beam_azimuth: f64) -> Self {
        let base = beam::direction(beam_azimuth);
        Self::aimed(&base, beam_azimuth + deflection.azimuth, deflection.elevation)
            .leaving_at(deflection.distance)
    }

    /// The ray of a beam in direction `base` that leaves the sensor's origin with an added azimuth and an elevation.
    pub(crate) fn aimed(base: &Unit<Vector3<f64>>, azimuth: f64, elevation: f64) -> Self {
        let (sin_a, cos_a) = libm_sincos(azimuth);
        let (sin_e, cos_e) = libm_sincos(elevation);
        Self {
            origin: Point3::origin(),
            direction: Unit::new_unchecked(Vector3::new(cos_e * cos_a, cos_e * sin_a, sin_e)),
            base: *base,
            distance: 0.0,
            by_azimuth: Vector3::new(-cos_e * sin_a, cos_e * cos_a, 0.0),
            by_elevation: Vector3::new(-sin_e * cos_a, -sin_e * sin_a, cos_e),
        }
    }

    /// The same, leaving a mirror at a distance d.
    pub(crate) fn leaving_at(self, distance: f64) -> Self {
        Self {
            origin: Point3::from(self.base.into_inner() * distance),
            distance,
            ..self
        }
    }

    /// cos φ.
    pub(crate) fn cos_elevation(&self) -> f64 {
        self.by_elevation.z
    }

    /// The range r to a board, Eq. (6), in meters; `None` if the ray misses its plane.
    pub fn range(&self, board: &BoardPlane) -> Option<f64> {
        Some(self.distance + board.distance_along(&self.origin, &self.direction)?)
    }

    /// That range and its row of H at once.
    #[inline]
    pub(crate) fn range_and_angles(&self, board: &BoardPlane) -> Option<(f64, Vector2<f64>)> {
        let s = board.distance_along(&self.origin, &self.direction)?;
        let by_s = -s / board.normal.dot(&self.direction);
        let angles = Vector2::new(
            by_s * board.normal.dot(&self.by_azimuth),
            by_s * board.normal.dot(&self.by_elevation),
        );
        Some((self.distance + s, angles))
    }

    /// The derivatives of that range; `None` if the ray misses the plane.
    pub fn gradient(&self, board: &BoardPlane) -> Option<RangeGradient> {
        let s = board.distance_along(&self.origin, &self.direction)?;
        let closing = board.normal.dot(&self.direction);
        let turned = |dv: &Vector3<f64>| -s * board.normal.dot(dv) / closing;
        Some(RangeGradient {
            azimuth: turned(&self.by_azimuth),
            elevation: turned(&self.by_elevation),
            distance: 1.0 - board.normal.dot(&self.base) / closing,
        })
    }
}

/// The derivatives by central differences, Eq. (7), with [`DIFFERENCE_STEP`]; ∂r/∂d, which the paper does not need, is
/// the analytic one.
///
/// `None` if the outgoing ray or one of its neighbors misses the plane.
#[doc(alias = "H")]
pub fn central(deflection: &Deflection, beam_azimuth: f64, board: &BoardPlane) -> Option<RangeGradient> {
    let at = |azimuth: f64, elevation: f64| {
        let near = Deflection {
            azimuth: deflection.azimuth + azimuth,
            elevation: deflection.elevation + elevation,
            ..*deflection
        };
        range::predict(&near, beam_azimuth, board)
    };
    let step = DIFFERENCE_STEP;
    Some(RangeGradient {
        azimuth: (at(step, 0.0)? - at(-step, 0.0)?) / (2.0 * step),
        elevation: (at(0.0, step)? - at(0.0, -step)?) / (2.0 * step),
        distance: analytic(deflection, beam_azimuth, board)?.distance,
    })
}

/// Derivative of a range with respect to a small motion of the sensor about its own axes: three shifts, three
/// rotations.
///
/// Such a motion (t, ω) moves the board by −t − ω × q at the point q where it is hit, in the sensor frame, and the
/// range by n·(that)/(n·v): the row is −(nᵀ, (q × n)ᵀ)/(n·v).
pub fn of_mount(
    hit: &Point3<f64>,
    normal: &Unit<Vector3<f64>>,
    direction: &Unit<Vector3<f64>>,
) -> RowVector6<f64> {
    let closing = -normal.dot(direction);
    let shift = normal.into_inner() / closing;
    let turn = hit.coords.cross(normal) / closing;
    RowVector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// Sine and cosine, equal on all machines, from the model's own direction.
fn libm_sincos(angle: f64) -> (f64, f64) {
    let u = beam::direction(angle);
    (u.y, u.x)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::Pose;
    use nalgebra::{Translation3, UnitQuaternion};

    fn board(tilt: f64) -> BoardPlane {
        BoardPlane::new(
            Point3::new(0.9, 0.3, 1.4),
            Unit::new_normalize(Vector3::new(-0.6, tilt, -0.7)),
        )
    }

    #[test]
    fn analytic_is_the_limit_of_the_central_difference() {
        for (azimuth, elevation) in [(0.1, 0.9), (-0.2, 0.6), (0.3, 1.2)] {
            for tilt in [-0.5, 0.0, 0.4] {
                let given = Deflection {
                    azimuth,
                    elevation,
                    distance: 0.07,
                };
                let exact = analytic(&given, 0.25, &board(tilt)).expect("the beam hits the board");
                let near = central(&given, 0.25, &board(tilt)).expect("the beam hits the board");
                let scale = exact.angles().norm();
                assert!((exact.angles() - near.angles()).norm() < 1e-5 * scale);
                // The differences must differ from the derivatives, by an error of the order δ².
                assert!(exact.angles() != near.angles());
                let longer = Deflection {
                    distance: 0.07 + 1e-4,
                    ..given
                };
                let r =
                    |d: &Deflection| range::predict(d, 0.25, &board(tilt)).expect("the beam hits the board");
                assert!(((r(&longer) - r(&given)) / 1e-4 - exact.distance).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn moving_the_sensor_changes_the_range_as_predicted() {
        let given = Deflection {
            azimuth: 0.2,
            elevation: 0.8,
            distance: 0.07,
        };
        let (plane, v) = (board(0.3), given.exit_direction(0.25));
        let r = range::predict(&given, 0.25, &plane).expect("the beam hits the board");
        let hit = given.deflection_point(0.25) + v.into_inner() * (r - given.distance);
        let row = of_mount(&hit, &plane.normal, &v);
        for axis in 0..6 {
            let mut motion = [0.0; 6];
            motion[axis] = 1e-6;
            let old_from_new = Pose::from_parts(
                Translation3::new(motion[0], motion[1], motion[2]),
                UnitQuaternion::from_scaled_axis(Vector3::new(motion[3], motion[4], motion[5])),
            );
            let moved = BoardPlane::new(
                old_from_new.inverse() * plane.point,
                Unit::new_normalize(old_from_new.rotation.inverse() * plane.normal.into_inner()),
            );
            let change = range::predict(&given, 0.25, &moved).expect("the beam hits the board") - r;
            assert!((change / 1e-6 - row[axis]).abs() < 1e-4, "axis {axis}");
        }
    }
}
