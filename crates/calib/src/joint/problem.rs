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

use super::linear::{Boards, Paint, Placed};
use crate::common::CommonErrors;
use crate::covariance::PlaneFit;
use crate::least_squares::{Block, GroupJacobian, GroupRows, GroupedProblem, Point};
use crate::pose;
use catoptric_model::{BoardPlane, Pose, RangeBias, frame, mirror};
use nalgebra::{
    DMatrix, DVector, Dyn, Matrix3, Matrix6, OMatrix, Point3, RowDVector, U6, Unit, Vector3, Vector6,
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

    fn placed(&self, board: &Board, rig_from_sensor: &Pose, b: &[f64]) -> Option<Placed<'_>> {
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

/// Residuals of a group at a point.
struct At {
    residuals: DVector<f64>,
    /// If it is wanted.
    jacobian: Option<GroupJacobian>,
    /// Σ ln det(I + τ²HᵀH) over its elements.
    log_departures: f64,
}

impl Joint<'_> {
    /// The rows of a group at a point: of its elements, then of its facets' distances.
    fn at(&self, group: usize, shared: &Point, own: &Point, derivatives: bool) -> Option<At> {
        let group = &self.groups[group];
        let boards = self.boards(group, shared, own)?;
        let bare = || {
            let facets = group.facets.iter().enumerate();
            facets.filter(|(_, f)| !f.bare.distances.is_empty())
        };
        let count = group.elements.iter().map(|e| e.sights.len()).sum::<usize>() + bare().count();
        let mut residuals = DVector::zeros(count);
        let mut jacobian = derivatives.then(|| GroupJacobian {
            shared: DMatrix::zeros(count, self.shared_dimension()),
            own: DMatrix::zeros(count, group.own_dimension()),
        });
        let (mut row, mut log_departures) = (0, 0.0);
        for element in &group.elements {
            let linear = self.element(element, shared, own, &boards)?;
            let rows = row..row + element.sights.len();
            let weight = linear.weight(self.departure(element));
            residuals.as_mut_slice()[rows.clone()].copy_from_slice((-&linear.y).as_slice());
            if let Some(weight) = &weight {
                weight.apply(&mut residuals.as_mut_slice()[rows.clone()]);
                log_departures += weight.log_determinant;
            }
            if let Some(jacobian) = &mut jacobian {
                self.differentiate(group, element, &boards, &linear, jacobian, row);
                if let Some(weight) = &weight {
                    let matrices = [&mut jacobian.shared, &mut jacobian.own];
                    for column in matrices
                        .into_iter()
                        .flat_map(|m| m.as_mut_slice().chunks_exact_mut(count))
                    {
                        weight.apply(&mut column[rows.clone()]);
                    }
                }
            }
            row = rows.end;
        }
        for (i, facet) in bare() {
            let (residual, derivative) = self.bare(&facet.bare, &Self::shape(own, i)?, shared.numbers(0)?)?;
            residuals[row] = residual;
            if let Some(jacobian) = &mut jacobian {
                let by_common = &facet.bare.common / facet.bare.sd;
                jacobian
                    .shared
                    .view_mut((row, self.first_common), (1, by_common.len()))
                    .copy_from(&by_common);
                for (column, value) in derivative.iter().enumerate() {
                    jacobian.own[(row, i * FACET_PARAMETERS + column)] = *value;
                }
            }
            row += 1;
        }
        Some(At {
            residuals,
            jacobian,
            log_departures,
        })
    }
}

impl GroupedProblem for Joint<'_> {
    fn groups(&self) -> usize {
        self.groups.len()
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        Some(self.at(group, shared, own, false)?.residuals)
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        self.at(group, shared, own, true)?.jacobian
    }

    fn linearized(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupRows> {
        let at = self.at(group, shared, own, true)?;
        Some(GroupRows {
            residuals: at.residuals,
            jacobian: at.jacobian?,
            log_covariance: at.log_departures,
        })
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
