//! The joint problem as least squares: what every reading of every board should be, and how it changes.
//!
//! ```text
//! z = d + s + E(r, θ_N, color) + c·w + σ_d·b₀ + noise            u → v₀ = u − 2(m·u)m,  d = h/(m·u),  v = v₀ ⊞ δ
//! ```
//!
//! Shared by all groups: `w`, standard normal by its prior, which moves the mounting and the biases. A group's own: the
//! planes (m, h) of its facets, and of each of its boards b: drift and the plane's offset and two tilts. Each beam departs
//! by δ ~ N(0, τ²) from its facet's plane; δ is eliminated beam by beam, which leaves (I + τ²HHᵀ)^(−½) as the weight of
//! its rows.

use crate::common::CommonErrors;
use crate::covariance::PlaneFit;
use crate::jacobian;
use crate::least_squares::{Block, GroupJacobian, GroupedProblem, Point};
use crate::pose;
use catoptric_model::{BoardPlane, Pose, RangeBias, frame, mirror};
use nalgebra::{
    DMatrix, DVector, Dyn, Matrix2, Matrix3, Matrix6, OMatrix, Point3, RowDVector, RowVector3, U2, U6, Unit,
    Vector2, Vector3, Vector6,
};

/// Own parameters of a board: drift, offset and two tilts of its plane.
pub(super) const BOARD_ERRORS: usize = 4;

/// Orders of the polynomial along the fan by which a facet's normal departs from its mean.
pub(super) const FIGURE_ORDERS: usize = 3;

/// Root mean square of a figure over a fan, in its 1σ: √(1 + 1/4 + 1/9).
pub(super) const FIGURE_RMS: f64 = 1.166_666_666_666_666_7;

/// Own parameters of a facet's figure: every order about two axes.
pub(super) const FIGURE: usize = 2 * FIGURE_ORDERS;

/// Own parameters of a facet: two tilts and the offset of its plane, then its figure.
pub(super) const FACET_PARAMETERS: usize = 3 + FIGURE;

/// Blocks of a facet's parameters: normal, offset, figure.
pub(super) const FACET_BLOCKS: usize = 3;

/// Step of (range, cosine) over which a bias is differentiated: tables are linear over centimeters and degrees.
const BIAS_STEP: f64 = 1e-4;

/// Rounds in which a beam's own departure settles, and the change that ends them, in radians.
const DEPARTURE_ROUNDS: usize = 8;
const SETTLED: f64 = 1e-14;

/// A board as tracked, once for each pose.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Board {
    /// Index of the stretch in the dataset, and its number.
    pub(super) pose: usize,
    pub(super) number: usize,
    /// The board's place in the rig, as tracked.
    pub(super) rig_from_board: Pose,
    pub(super) color: String,
    /// Markers in the board frame.
    pub(super) markers: Vec<Point3<f64>>,
}

/// Mean of an element's readings of one board.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sight {
    /// Index of the board in its group.
    pub(super) board: usize,
    pub(super) mean: f64,
    /// Standard deviation by what no other reading shares, in metres.
    pub(super) sd: f64,
    pub(super) count: usize,
}

/// An element and what it read; without a facet it is an undeflected beam.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Element {
    pub(super) beam: usize,
    pub(super) azimuth: f64,
    pub(super) u: Unit<Vector3<f64>>,
    /// Index of the facet in its group.
    pub(super) facet: Option<usize>,
    /// Place along the facet's fan, −1 at its first beam and 1 at its last.
    pub(super) along: f64,
    pub(super) sights: Vec<Sight>,
}

/// What step 3 says of a facet: distances of some of its beams, all off by one error.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct BareFacet {
    /// Direction and measured distance to the bare structure.
    pub(super) distances: Vec<(Unit<Vector3<f64>>, f64)>,
    pub(super) thickness: f64,
    /// Mean error by one standard deviation of each of the common errors, and 1σ of what the facet shares with no other.
    pub(super) common: RowDVector<f64>,
    pub(super) sd: f64,
}

/// A facet by its index in the session.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Facet {
    pub(super) facet: usize,
    pub(super) bare: BareFacet,
}

/// Facets, and all boards that any of them sees; or one board before undeflected beams.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Group {
    pub(super) facets: Vec<Facet>,
    pub(super) boards: Vec<Board>,
    pub(super) elements: Vec<Element>,
}

/// How the shared numbers w move the sensor: motion = M·w about a mounting.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Mounting {
    pub(super) rig_from_sensor: Pose,
    pub(super) motion: OMatrix<f64, U6, Dyn>,
}

/// All of it.
#[derive(Clone)]
pub(super) struct Joint<'a> {
    pub(super) groups: Vec<Group>,
    pub(super) mounting: Mounting,
    pub(super) bias: &'a RangeBias,
    pub(super) common: CommonErrors<'a>,
    /// Where in w the common errors begin.
    pub(super) first_common: usize,
    pub(super) drift_sd: f64,
    pub(super) marker_sd: f64,
    /// How far facets are from plane.
    pub(super) flatness: Flatness,
    /// What w is believed to be.
    pub(super) prior_mean: DVector<f64>,
}

/// How far facets are from plane, 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Flatness {
    /// Of a facet's normal from its mean along the fan, about each axis, in radians.
    pub(super) figure: f64,
    /// Of a beam's direction from what its facet gives it, along each axis, in radians.
    pub(super) tau: f64,
}

/// A board in the sensor frame with its errors.
struct Placed {
    plane: BoardPlane,
    fit: PlaneFit,
    /// Height error of each of three unit errors, by (1, x, y).
    errors: Matrix3<f64>,
}

/// An element linearized: prediction errors, and derivatives of the predicted range.
pub(super) struct Linear {
    /// z − r̂ + Hδ, over the sights, each over its standard deviation.
    pub(super) y: DVector<f64>,
    /// Derivatives along the two axes of the departure, over the standard deviations.
    pub(super) h: OMatrix<f64, Dyn, U2>,
    /// The departure that fits best.
    pub(super) delta: Vector2<f64>,
    /// The two axes.
    pub(super) axes: [Vector3<f64>; 2],
    /// Exit direction and distance.
    pub(super) v: Unit<Vector3<f64>>,
    pub(super) distance: f64,
    /// Derivatives of each biased range with respect to the range and to the cosine of the incidence.
    slopes: Vec<(f64, f64)>,
    /// Derivatives over the standard deviations: of w, and of the group's own parameters.
    pub(super) shared: DMatrix<f64>,
    pub(super) own: DMatrix<f64>,
}

/// What an element's direction depends on: derivatives of v and d with respect to its facet's plane.
pub(super) struct Fan {
    pub(super) v: Unit<Vector3<f64>>,
    pub(super) distance: f64,
    /// ∂v/∂(two tilts), columns.
    pub(super) turned: [Vector3<f64>; 2],
    /// ∂d/∂(two tilts, offset).
    pub(super) moved: [f64; 3],
    /// Weight of each order of the figure in the tilts.
    pub(super) orders: [f64; FIGURE_ORDERS],
}

/// A facet as its parameters have it.
pub(super) struct Shape<'p> {
    pub(super) normal: Unit<Vector3<f64>>,
    pub(super) offset: f64,
    /// In standard deviations: the orders about one axis, then about the other.
    figure: &'p DVector<f64>,
}

/// Legendre polynomials P₁, P₂, P₃ of unit mean square over the fan, falling off with the order as 1/k.
pub(super) fn orders(t: f64) -> [f64; FIGURE_ORDERS] {
    [
        3.0_f64.sqrt() * t,
        5.0_f64.sqrt() * (1.5 * t * t - 0.5) / 2.0,
        7.0_f64.sqrt() * (2.5 * t * t - 1.5) * t / 3.0,
    ]
}

impl Fan {
    /// A facet's deflection of a beam; `None` where it does not face it.
    ///
    /// The plane gives the distance, its normal as it is at the beam the direction.
    pub(super) fn of(element: &Element, shape: &Shape, flatness: &Flatness) -> Option<Self> {
        let u = &element.u;
        let (a, b) = frame::tangent_basis(&shape.normal);
        let orders = orders(element.along).map(|p| p * flatness.figure);
        let tilt = |axis: usize| -> f64 {
            let of_axis = shape.figure.rows(axis * FIGURE_ORDERS, FIGURE_ORDERS);
            orders.iter().zip(of_axis.iter()).map(|(p, c)| p * c).sum()
        };
        let tilted = shape.normal.into_inner() + a.into_inner() * tilt(0) + b.into_inner() * tilt(1);
        let normal = Unit::new_normalize(tilted);
        let facing = shape.normal.dot(u);
        let distance = shape.offset / facing;
        let local = normal.dot(u);
        if !(facing < 0.0 && local < 0.0 && distance > 0.0) {
            return None;
        }
        let turned =
            |e: &Unit<Vector3<f64>>| -2.0 * (e.dot(u) * normal.into_inner() + local * e.into_inner());
        let moved = |e: &Unit<Vector3<f64>>| -distance * e.dot(u) / facing;
        Some(Self {
            v: mirror::reflect(u, &normal),
            distance,
            turned: [turned(&a), turned(&b)],
            moved: [moved(&a), moved(&b), 1.0 / facing],
            orders,
        })
    }

    /// ∂v/∂(tilts and figure), with the column of each among its facet's parameters.
    pub(super) fn directions(&self) -> impl Iterator<Item = (usize, Vector3<f64>)> + '_ {
        let tilts = self.turned.iter().copied().enumerate();
        let figure = (0..FIGURE).map(|i| {
            let (axis, order) = (i / FIGURE_ORDERS, i % FIGURE_ORDERS);
            (3 + i, self.turned[axis] * self.orders[order])
        });
        tilts.chain(figure)
    }
}

impl Group {
    /// Where the parameters of a board begin among the group's own.
    pub(super) fn board_column(&self, board: usize) -> usize {
        self.facets.len() * FACET_PARAMETERS + board * BOARD_ERRORS
    }

    /// Number of own parameters.
    pub(super) fn own_dimension(&self) -> usize {
        self.board_column(self.boards.len())
    }
}

impl Joint<'_> {
    /// Number of shared parameters.
    pub(super) fn shared_dimension(&self) -> usize {
        self.first_common + self.common.len()
    }

    /// A facet of a group.
    pub(super) fn shape(own: &Point, facet: usize) -> Option<Shape<'_>> {
        let first = FACET_BLOCKS * facet;
        Some(Shape {
            normal: *own.direction(first)?,
            offset: own.numbers(first + 1)?[0],
            figure: own.numbers(first + 2)?,
        })
    }

    /// Errors of the boards of a group.
    pub(super) fn board_errors<'p>(&self, group: &Group, own: &'p Point) -> Option<&'p DVector<f64>> {
        own.numbers(FACET_BLOCKS * group.facets.len())
    }

    /// The mounting moved by w, and the derivative of the motion about the moved axes with respect to w.
    fn mounted(&self, w: &DVector<f64>) -> (Pose, OMatrix<f64, U6, Dyn>) {
        let motion: Vector6<f64> = &self.mounting.motion * w;
        let pose = pose::moved(&self.mounting.rig_from_sensor, &motion);
        let turn = Vector3::new(motion[3], motion[4], motion[5]);
        let rotation = nalgebra::UnitQuaternion::from_scaled_axis(turn);
        let mut to_moved = Matrix6::zeros();
        to_moved
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(rotation.inverse().to_rotation_matrix().matrix());
        // Jᵣ = I − [ω]/2 + [ω]²/6: the next term is 10⁻⁷ for a turn of a degree.
        let cross = turn.cross_matrix();
        let right = Matrix3::identity() - cross * 0.5 + cross * cross / 6.0;
        to_moved.fixed_view_mut::<3, 3>(3, 3).copy_from(&right);
        (pose, to_moved * &self.mounting.motion)
    }

    fn placed(&self, board: &Board, rig_from_sensor: &Pose, b: &[f64]) -> Option<Placed> {
        let sensor_from_board = rig_from_sensor.inverse() * board.rig_from_board;
        let tracked = BoardPlane::of_pose(&sensor_from_board);
        let markers: Vec<Point3<f64>> = board.markers.iter().map(|m| sensor_from_board * m).collect();
        let fit = PlaneFit::new(&markers, &tracked.normal);
        let errors = fit.errors() * self.marker_sd;
        let height: Vector3<f64> = errors * Vector3::new(b[1], b[2], b[3]);
        let [x, y] = fit.axes();
        let normal = tracked.normal.into_inner() - x * height[1] - y * height[2];
        // The fit's origin is a point of the plane up to the markers' own heights, which the tracked pose has averaged.
        let origin = Point3::from(fit.centroid());
        let onto = origin - tracked.normal.into_inner() * tracked.normal.dot(&(origin - tracked.point));
        let point = onto + tracked.normal.into_inner() * height[0];
        Some(Placed {
            plane: BoardPlane::new(point, Unit::try_new(normal, f64::MIN_POSITIVE)?),
            fit,
            errors,
        })
    }

    /// Derivatives of the biased range with respect to the range and to the cosine of the incidence.
    fn bias_slopes(&self, range: f64, cos: f64, color: &str) -> (f64, f64) {
        let at = |range: f64, cos: f64| self.bias.terms(range, cos, color).total();
        let slope = (at(range + BIAS_STEP, cos) - at(range - BIAS_STEP, cos)) / (2.0 * BIAS_STEP);
        let (low, high) = ((cos - BIAS_STEP).max(0.0), (cos + BIAS_STEP).min(1.0));
        (1.0 + slope, (at(range, high) - at(range, low)) / (high - low))
    }

    /// An element at a point, with the derivatives of the whole if they are wanted.
    pub(super) fn element(
        &self,
        group: &Group,
        element: &Element,
        shared: &Point,
        own: &Point,
        boards: &Boards,
        derivatives: bool,
    ) -> Option<Linear> {
        let w = shared.numbers(0)?;
        let b = self.board_errors(group, own)?;
        let fan = match element.facet {
            Some(facet) => Fan::of(element, &Self::shape(own, facet)?, &self.flatness)?,
            None => Fan {
                v: element.u,
                distance: 0.0,
                turned: [Vector3::zeros(); 2],
                moved: [0.0; 3],
                orders: [0.0; FIGURE_ORDERS],
            },
        };
        let origin = Point3::from(element.u.into_inner() * fan.distance);
        let (across, up) = frame::tangent_basis(&fan.v);
        let base = [across.into_inner(), up.into_inner()];
        let rows = element.sights.len();
        let tau = self.departure(element);
        let mut delta = Vector2::<f64>::zeros();
        let mut y = DVector::zeros(rows);
        let mut h = OMatrix::<f64, Dyn, U2>::zeros(rows);
        let (mut v, mut axes) = (fan.v, base);
        // Slopes of the biases, which a departure does not change.
        let mut slopes = vec![(1.0, 0.0); rows];
        for round in 0..DEPARTURE_ROUNDS {
            let q: Vector3<f64> = fan.v.into_inner() + base[0] * delta.x + base[1] * delta.y;
            let length = q.norm();
            v = Unit::new_unchecked(q / length);
            axes = base.map(|a| (a - v.into_inner() * v.dot(&a)) / length);
            for (row, sight) in element.sights.iter().enumerate() {
                let board = &boards.placed[sight.board];
                let color = &group.boards[sight.board].color;
                let s = board.plane.distance_along(&origin, &v)?;
                let closing = board.plane.normal.dot(&v);
                let range = fan.distance + s;
                let cos = closing.abs().min(1.0);
                if round == 0 {
                    slopes[row] = self.bias_slopes(range, cos, color);
                }
                let (by_range, by_cos) = slopes[row];
                let raw = range + self.bias.terms(range, cos, color).total();
                let common = self.common.row(range, cos, color);
                let predicted = raw
                    + (common * w.rows(self.first_common, self.common.len()))[0]
                    + self.drift_sd * b[sight.board * BOARD_ERRORS];
                for (column, axis) in axes.iter().enumerate() {
                    let along = board.plane.normal.dot(axis);
                    h[(row, column)] =
                        (-by_range * s * along / closing + by_cos * closing.signum() * along) / sight.sd;
                }
                y[row] = (sight.mean - predicted) / sight.sd;
            }
            y += &h * delta;
            if tau == 0.0 {
                break;
            }
            let inner = Matrix2::identity() + h.transpose() * &h * (tau * tau);
            let next = inner.try_inverse()? * (h.transpose() * &y) * (tau * tau);
            let change = (next - delta).norm();
            delta = next;
            if change < SETTLED || round + 1 == DEPARTURE_ROUNDS {
                break;
            }
        }
        let mut linear = Linear {
            y,
            h,
            delta,
            axes,
            v,
            distance: fan.distance,
            slopes,
            shared: DMatrix::zeros(0, 0),
            own: DMatrix::zeros(0, 0),
        };
        if derivatives {
            self.differentiate(group, element, &fan, boards, &mut linear)?;
        }
        Some(linear)
    }

    fn differentiate(
        &self,
        group: &Group,
        element: &Element,
        fan: &Fan,
        boards: &Boards,
        linear: &mut Linear,
    ) -> Option<()> {
        let rows = element.sights.len();
        let width = self.shared_dimension();
        linear.shared = DMatrix::zeros(rows, width);
        linear.own = DMatrix::zeros(rows, group.own_dimension());
        let origin = Point3::from(element.u.into_inner() * fan.distance);
        let v = linear.v;
        for (row, sight) in element.sights.iter().enumerate() {
            let board = &boards.placed[sight.board];
            let color = &group.boards[sight.board].color;
            let n = board.plane.normal;
            let s = board.plane.distance_along(&origin, &v)?;
            let closing = n.dot(&v);
            let range = fan.distance + s;
            let cos = closing.abs().min(1.0);
            let (by_range, by_cos) = linear.slopes[row];
            let by_closing = by_cos * closing.signum();
            let weight = 1.0 / sight.sd;
            let hit = origin + v.into_inner() * s;
            let mut motion = jacobian::of_mount(&hit, &n, &v) * by_range;
            let turn: RowVector3<f64> = -n.cross(&v).transpose() * by_closing;
            for axis in 0..3 {
                motion[3 + axis] += turn[axis];
            }
            let mut by_w = motion * &boards.motion;
            let common = self.common.row(range, cos, color);
            for (column, value) in common.iter().enumerate() {
                by_w[self.first_common + column] += value;
            }
            linear.shared.set_row(row, &(by_w * weight));
            if let Some(facet) = element.facet {
                let first = facet * FACET_PARAMETERS;
                let by_distance = by_range * (1.0 - n.dot(&element.u) / closing);
                for (column, dv) in fan.directions() {
                    let along = n.dot(&dv);
                    linear.own[(row, first + column)] =
                        (-by_range * s * along / closing + by_closing * along) * weight;
                }
                for (column, moved) in fan.moved.iter().enumerate() {
                    linear.own[(row, first + column)] += by_distance * moved * weight;
                }
            }
            let first = group.board_column(sight.board);
            linear.own[(row, first)] = self.drift_sd * weight;
            let a = board.fit.coordinates(&hit);
            for column in 0..3 {
                let height = a.dot(&board.errors.column(column));
                linear.own[(row, first + 1 + column)] = by_range * height / closing * weight;
            }
        }
        Some(())
    }

    /// The boards of a group in the sensor frame.
    pub(super) fn boards(&self, group: &Group, shared: &Point, own: &Point) -> Option<Boards> {
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

    /// Predicted less measured distance of a facet, in standard deviations, and its derivatives by the plane.
    fn bare(&self, facet: &BareFacet, shape: &Shape, w: &DVector<f64>) -> Option<(f64, [f64; 3])> {
        let (mut sum, mut derivative) = (0.0, [0.0; 3]);
        let (a, b) = frame::tangent_basis(&shape.normal);
        for (u, measured) in &facet.distances {
            let facing = shape.normal.dot(u);
            let distance = shape.offset / facing;
            if facing >= 0.0 {
                return None;
            }
            sum += distance - facet.thickness / facing - measured;
            derivative[0] -= distance * a.dot(u) / facing;
            derivative[1] -= distance * b.dot(u) / facing;
            derivative[2] += 1.0 / facing;
        }
        let scale = 1.0 / (facet.distances.len() as f64 * facet.sd);
        let common = (&facet.common * w.rows(self.first_common, self.common.len()))[0] / facet.sd;
        Some((sum * scale + common, derivative.map(|d| d * scale)))
    }
}

/// Boards of a group in the sensor frame, and how w moves the sensor.
pub(super) struct Boards {
    placed: Vec<Placed>,
    motion: OMatrix<f64, U6, Dyn>,
}

/// (I + τ²HHᵀ)^(−½) applied to the columns of m.
pub(super) fn whiten(h: &OMatrix<f64, Dyn, U2>, tau: f64, m: &mut DMatrix<f64>) {
    if tau == 0.0 {
        return;
    }
    let eigen = (h.transpose() * h * (tau * tau)).symmetric_eigen();
    // 1/√(1 + x) − 1 over x, without the difference of two near numbers.
    let gain = eigen.eigenvalues.map(|x| {
        let root = (1.0 + x.max(0.0)).sqrt();
        -1.0 / (root * (1.0 + root))
    });
    let inner =
        eigen.eigenvectors * Matrix2::from_diagonal(&gain) * eigen.eigenvectors.transpose() * (tau * tau);
    let part = h * (inner * (h.transpose() * &*m));
    *m += part;
}

impl GroupedProblem for Joint<'_> {
    fn groups(&self) -> usize {
        self.groups.len()
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        let group = &self.groups[group];
        let boards = self.boards(group, shared, own)?;
        let mut rows = Vec::new();
        for element in &group.elements {
            let linear = self.element(group, element, shared, own, &boards, false)?;
            let mut y = DMatrix::from_column_slice(linear.y.len(), 1, linear.y.as_slice());
            whiten(&linear.h, self.departure(element), &mut y);
            rows.extend(y.iter().map(|v| -v));
        }
        for (i, facet) in group.facets.iter().enumerate() {
            if !facet.bare.distances.is_empty() {
                let shape = Self::shape(own, i)?;
                rows.push(self.bare(&facet.bare, &shape, shared.numbers(0)?)?.0);
            }
        }
        Some(DVector::from_vec(rows))
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        let group = &self.groups[group];
        let boards = self.boards(group, shared, own)?;
        let bare = group
            .facets
            .iter()
            .filter(|f| !f.bare.distances.is_empty())
            .count();
        let rows = group.elements.iter().map(|e| e.sights.len()).sum::<usize>() + bare;
        let mut jacobian = GroupJacobian {
            shared: DMatrix::zeros(rows, self.shared_dimension()),
            own: DMatrix::zeros(rows, group.own_dimension()),
        };
        let mut row = 0;
        for element in &group.elements {
            let mut linear = self.element(group, element, shared, own, &boards, true)?;
            let tau = self.departure(element);
            whiten(&linear.h, tau, &mut linear.shared);
            whiten(&linear.h, tau, &mut linear.own);
            let count = element.sights.len();
            jacobian.shared.rows_mut(row, count).copy_from(&linear.shared);
            jacobian.own.rows_mut(row, count).copy_from(&linear.own);
            row += count;
        }
        for (i, facet) in group.facets.iter().enumerate() {
            if !facet.bare.distances.is_empty() {
                let shape = Self::shape(own, i)?;
                let (_, derivative) = self.bare(&facet.bare, &shape, shared.numbers(0)?)?;
                let by_common = &facet.bare.common / facet.bare.sd;
                jacobian
                    .shared
                    .view_mut((row, self.first_common), (1, by_common.len()))
                    .copy_from(&by_common);
                for (column, value) in derivative.iter().enumerate() {
                    jacobian.own[(row, i * FACET_PARAMETERS + column)] = *value;
                }
                row += 1;
            }
        }
        Some(jacobian)
    }
}

impl Joint<'_> {
    /// 1σ of an element's departure from its facet's plane; an undeflected beam has none.
    pub(super) fn departure(&self, element: &Element) -> f64 {
        if element.facet.is_some() {
            self.flatness.tau
        } else {
            0.0
        }
    }

    /// The own parameters of a group with given planes, and boards as tracked.
    pub(super) fn start(group: &Group, planes: &[catoptric_model::MirrorPlane]) -> Point {
        let mut blocks = Vec::new();
        for facet in &group.facets {
            let plane = &planes[facet.facet];
            blocks.push(Block::Direction(plane.normal));
            blocks.push(Block::Vector(DVector::from_element(1, plane.offset)));
            blocks.push(Block::Vector(DVector::zeros(FIGURE)));
        }
        blocks.push(Block::Vector(DVector::zeros(group.boards.len() * BOARD_ERRORS)));
        Point { blocks }
    }
}
