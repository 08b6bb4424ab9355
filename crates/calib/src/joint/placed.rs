//! The boards of a group in the sensor frame, with their errors and the biases of their colors.

use super::group::{BOARD_ERRORS, Board, Group};
use super::problem::Joint;
use crate::judge::covariance::PlaneFit;
use crate::lsq::Point;
use crate::mount::pose;
use catoptric_model::bias::ColoredBias;
use catoptric_model::{BoardPlane, Pose};
use nalgebra::{DVector, Dyn, Matrix3, Matrix6, OMatrix, Point3, U6, Unit, UnitQuaternion, Vector3, Vector6};

/// Step of (range, cosine) over which a bias is differentiated: tables are linear over centimeters and degrees.
const BIAS_STEP: f64 = 1e-4;

/// Boards of a group in the sensor frame, and the motion of the sensor with w.
pub(super) struct Boards<'j> {
    pub(super) placed: Vec<Placed<'j>>,
    pub(super) motion: OMatrix<f64, U6, Dyn>,
}

/// A board in the sensor frame with its errors.
pub(super) struct Placed<'j> {
    pub(super) plane: BoardPlane,
    pub(super) fit: PlaneFit,
    /// Height error of each of three unit errors, as coefficients of (1, x, y).
    pub(super) errors: Matrix3<f64>,
    /// Drift, in meters.
    pub(super) drift: f64,
    pub(super) paint: Paint<'j>,
}

/// The believed biases of one color.
pub(super) struct Paint<'j> {
    pub(super) bias: ColoredBias<'j>,
    /// Index of the color among the common errors.
    pub(super) place: Option<usize>,
}

impl<'j> Paint<'j> {
    pub(super) fn of(joint: &'j Joint, color: &str) -> Self {
        Self {
            bias: joint.bias.on(color),
            place: joint.common.place(color),
        }
    }

    /// Derivatives of the biased range with respect to the range and to the cosine of the incidence.
    pub(super) fn slopes(&self, range: f64, cos: f64) -> (f64, f64) {
        let at = |range: f64, cos: f64| self.bias.terms(range, cos).total();
        let slope = (at(range + BIAS_STEP, cos) - at(range - BIAS_STEP, cos)) / (2.0 * BIAS_STEP);
        let (low, high) = ((cos - BIAS_STEP).max(0.0), (cos + BIAS_STEP).min(1.0));
        (1.0 + slope, (at(range, high) - at(range, low)) / (high - low))
    }
}

impl Joint<'_> {
    /// The mounting moved by w, and the derivative of the motion, about the moved axes, with respect to w.
    fn mounted(&self, w: &DVector<f64>) -> (Pose, OMatrix<f64, U6, Dyn>) {
        let motion: Vector6<f64> = &self.mounting.motion * w;
        let pose = pose::moved(&self.mounting.rig_from_sensor, &motion);
        let turn = Vector3::new(motion[3], motion[4], motion[5]);
        let rotation = UnitQuaternion::from_scaled_axis(turn);
        let mut to_moved = Matrix6::zeros();
        to_moved
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(rotation.inverse().to_rotation_matrix().matrix());
        // Jᵣ = I − [ω]/2 + [ω]²/6: the next term is 10⁻⁷ for a rotation of one degree.
        let cross = turn.cross_matrix();
        let right = Matrix3::identity() - cross * 0.5 + cross * cross / 6.0;
        to_moved.fixed_view_mut::<3, 3>(3, 3).copy_from(&right);
        (pose, to_moved * &self.mounting.motion)
    }

    fn placed(&self, board: &Board, rig_from_sensor: &Pose, b: &[f64]) -> Option<Placed<'_>> {
        let sensor_from_board = rig_from_sensor.inverse() * board.rig_from_board;
        let tracked = BoardPlane::of_pose(&(rig_from_sensor.inverse() * board.rig_from_face));
        let markers: Vec<Point3<f64>> = board.markers.iter().map(|m| sensor_from_board * m).collect();
        let fit = PlaneFit::new(&markers, &tracked.normal);
        let errors = fit.errors() * self.marker_sd;
        let height: Vector3<f64> = errors * Vector3::new(b[1], b[2], b[3]);
        let [x, y] = fit.axes();
        let normal = tracked.normal.into_inner() - x * height[1] - y * height[2];
        // The fit's origin is on the plane up to the markers' own heights, which the tracked pose has averaged.
        let origin = Point3::from(fit.centroid());
        let onto = origin - tracked.normal.into_inner() * tracked.normal.dot(&(origin - tracked.point));
        let point = onto + tracked.normal.into_inner() * height[0];
        Some(Placed {
            plane: BoardPlane::new(point, Unit::try_new(normal, f64::MIN_POSITIVE)?),
            fit,
            errors,
            drift: self.drift_sd * b[0],
            paint: Paint::of(self, &board.color),
        })
    }

    /// The boards of a group in the sensor frame.
    pub(super) fn boards(&self, group: &Group, shared: &Point, own: &Point) -> Option<Boards<'_>> {
        let (rig_from_sensor, motion) = self.mounted(shared.numbers(0)?);
        let b = self.board_errors(group, own)?;
        let placed = group
            .boards
            .iter()
            .enumerate()
            .map(|(i, board)| {
                self.placed(
                    board,
                    &rig_from_sensor,
                    &b.as_slice()[i * BOARD_ERRORS..(i + 1) * BOARD_ERRORS],
                )
            })
            .collect::<Option<_>>()?;
        Some(Boards { placed, motion })
    }
}
