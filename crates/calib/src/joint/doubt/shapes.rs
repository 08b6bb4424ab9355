//! Shapes of the errors that the model may omit, and their scores at a solution.
//!
//! A shape is the change of each predicted reading per millimeter of the error. Parameters with a prior are tested by the
//! prior's own row.

use super::super::group::{BOARD_ERRORS, FACET_PARAMETERS, FIGURE_ORDERS};
use super::super::linear::Linear;
use super::super::placed::Boards;
use super::super::problem::Joint;
use super::evidence::{Evidence, LEFT, LEFT_OF_PRIOR};
use crate::lsq::Solution;
use catoptric_model::{Dataset, PoseKind};
use nalgebra::{DMatrix, DVector};

/// One millimeter.
const UNIT: f64 = 1e-3;

/// Distance between the nodes at which an error over distance is tested, in meters, and over incidence, in radians.
const RANGE_STEP: f64 = 0.15;
const INCIDENCE_STEP: f64 = 0.06;

/// Maximum number of nodes.
const MOST_NODES: usize = 12;

/// Time constants of a warm-up that are tested, as shares of the recording.
const WARMING: [f64; 3] = [0.06, 0.2, 0.6];

/// Orders of the figure of a mirror that the model lacks, which are taken out of every test.
const FINER: std::ops::Range<usize> = FIGURE_ORDERS + 1..FIGURE_ORDERS + 6;

/// Where each shape is among the columns.
pub(super) struct Shapes {
    pub(super) distance: Nodes,
    pub(super) incidence: Nodes,
    pub(super) warming: usize,
    pub(super) thickness: usize,
    pub(super) glass: usize,
    pub(super) bare: usize,
    /// First of the facets' own bare distances, and their number.
    pub(super) bare_of_facets: usize,
    pub(super) facets: usize,
    /// First of the finer orders of the facets' figures: all orders about one axis, then about the other.
    pub(super) finer: usize,
    /// First of the parameters with priors: the shared ones, then each board's drift and three errors of its plane.
    pub(super) shared: usize,
    pub(super) boards: usize,
    /// Number of the pose of each board.
    pub(super) poses: Vec<usize>,
    pub(super) count: usize,
    /// First and last stretch with a board.
    from: usize,
    to: usize,
}

/// A function of one variable, linear between nodes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nodes {
    pub(super) first: usize,
    pub(super) count: usize,
    low: f64,
    step: f64,
}

impl Nodes {
    fn new(first: usize, [low, high]: [f64; 2], step: f64) -> Self {
        let span = (high - low).max(0.0);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few steps"
        )]
        let steps = (span / step).round().clamp(1.0, (MOST_NODES - 1) as f64) as usize;
        Self {
            first,
            count: steps + 1,
            low,
            step: span / steps as f64,
        }
    }

    /// The columns of the two nodes beside a value, with their weights.
    fn weights(&self, value: f64) -> [(usize, f64); 2] {
        let place = if self.step > 0.0 {
            (value - self.low) / self.step
        } else {
            0.0
        };
        let place = place.clamp(0.0, (self.count - 1) as f64);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between the nodes"
        )]
        let below = (place as usize).min(self.count - 2);
        let above = place - below as f64;
        [(self.first + below, 1.0 - above), (self.first + below + 1, above)]
    }

    pub(super) fn columns(&self) -> Vec<usize> {
        (self.first..self.first + self.count).collect()
    }
}

impl Shapes {
    /// The shapes that the readings of a solution can show.
    fn of(joint: &Joint, solution: &Solution) -> Self {
        let (mut ranges, mut angles) = ([f64::INFINITY, 0.0], [f64::INFINITY, 0.0]);
        let widen =
            |[low, high]: &mut [f64; 2], value: f64| (*low, *high) = (low.min(value), high.max(value));
        joint.each(solution, |_, _, _, linear, _| {
            for (range, closing) in linear.met() {
                widen(&mut ranges, range);
                widen(&mut angles, libm::acos(closing.abs().min(1.0)));
            }
        });
        let distance = Nodes::new(0, ranges, RANGE_STEP);
        let incidence = Nodes::new(distance.count, angles, INCIDENCE_STEP);
        let warming = incidence.first + incidence.count;
        let thickness = warming + WARMING.len();
        let (glass, bare) = (thickness + 1, thickness + 2);
        let facets = joint.groups.iter().map(|g| g.facets.len()).sum::<usize>();
        let finer = bare + 1 + facets;
        let shared = finer + 2 * FINER.len() * facets;
        let boards = shared + joint.shared_dimension();
        let of_boards = || joint.groups.iter().flat_map(|g| &g.boards);
        let poses: Vec<usize> = of_boards().map(|b| b.number).collect();
        Self {
            distance,
            incidence,
            warming,
            thickness,
            glass,
            bare,
            bare_of_facets: bare + 1,
            facets,
            finer,
            shared,
            boards,
            count: boards + BOARD_ERRORS * poses.len(),
            poses,
            from: of_boards().map(|b| b.pose).min().unwrap_or(0),
            to: of_boards().map(|b| b.pose).max().unwrap_or(0),
        }
    }

    /// Columns of one kind of a board's errors, of all boards: 0 the drift, 1 to 3 the plane.
    pub(super) fn of_boards(&self, kinds: std::ops::Range<usize>) -> Vec<usize> {
        let all = 0..BOARD_ERRORS * self.poses.len();
        let of_kind = all.filter(|i| kinds.contains(&(i % BOARD_ERRORS)));
        of_kind.map(|i| self.boards + i).collect()
    }

    /// Columns of the finer figures, which are taken out of every test.
    pub(super) fn of_figures(&self) -> Vec<usize> {
        (self.finer..self.shared).collect()
    }

    /// Columns of one board's errors.
    pub(super) fn of_board(&self, board: usize) -> Vec<usize> {
        let first = self.boards + BOARD_ERRORS * board;
        (first..first + BOARD_ERRORS).collect()
    }

    /// The changes of a range by each warm-up, in meters.
    fn warmed(&self, pose: usize) -> [f64; WARMING.len()] {
        let elapsed = (pose as f64 - self.from as f64) / self.to.saturating_sub(self.from).max(1) as f64;
        WARMING.map(|constant| libm::exp(-elapsed / constant) * UNIT)
    }

    /// The changes of one reading, in meters.
    fn of_reading(&self, range: f64, closing: f64, pose: usize, glass: f64, into: &mut DVector<f64>) {
        for (column, weight) in self.distance.weights(range) {
            into[column] += weight * UNIT;
        }
        let incidence = libm::acos(closing.abs().min(1.0));
        for (column, weight) in self.incidence.weights(incidence) {
            into[column] += weight * UNIT;
        }
        for (i, change) in self.warmed(pose).into_iter().enumerate() {
            into[self.warming + i] = change;
        }
        into[self.thickness] = -UNIT / closing.abs();
        into[self.glass] = glass * UNIT;
    }
}

/// Legendre polynomials of the finer orders.
fn finer(t: f64) -> [f64; FINER.end - FINER.start] {
    let mut values = [0.0; FINER.end];
    (values[0], values[1]) = (1.0, t);
    for k in 2..FINER.end {
        let n = k as f64;
        values[k] = ((2.0 * n - 1.0) * t * values[k - 1] - (n - 1.0) * values[k - 2]) / n;
    }
    std::array::from_fn(|i| values[FINER.start + i])
}

impl Joint<'_> {
    /// Every element of a solution: its group's number, its group, the boards, itself linearized.
    fn each(
        &self,
        solution: &Solution,
        mut see: impl FnMut(usize, usize, &Boards, &Linear, &super::super::group::JointElement),
    ) {
        let state = &solution.state;
        for (number, group) in self.groups.iter().enumerate() {
            let own = state.own(number);
            let Some(boards) = self.boards(group, &state.shared, own) else {
                continue;
            };
            for (place, element) in group.elements.iter().enumerate() {
                if let Some(linear) = self.element(element, &state.shared, own, &boards) {
                    see(number, place, &boards, &linear, element);
                }
            }
        }
    }

    /// The shapes, and the evidence for each.
    pub(super) fn evidence(&self, dataset: &Dataset, solution: &Solution) -> Option<(Shapes, Evidence)> {
        let glass = dataset.session.glass.unwrap_or_default();
        let firsts: Vec<usize> = self
            .groups
            .iter()
            .scan(0, |next, g| Some(std::mem::replace(next, *next + g.facets.len())))
            .collect();
        let shapes = Shapes::of(self, solution);
        let width = self.shared_dimension();
        let count = shapes.shared;
        let mut scores = DVector::zeros(shapes.count);
        let mut products = DMatrix::zeros(shapes.count, shapes.count);
        let mut by = DMatrix::zeros(shapes.count, solution.information.dimension());
        let mut add =
            |z: &DMatrix<f64>, f: &DVector<f64>, shared: &DMatrix<f64>, own: &DMatrix<f64>, at: usize| {
                let z_t = z.transpose();
                let mut part = scores.rows_mut(0, count);
                part += &z_t * f;
                let mut part = products.view_mut((0, 0), (count, count));
                part += &z_t * z;
                let mut part = by.view_mut((0, 0), (count, width));
                part += &z_t * shared;
                let mut part = by.view_mut((0, at), (count, own.ncols()));
                part += &z_t * own;
            };
        self.each(solution, |number, _, boards, linear, element| {
            let group = &self.groups[number];
            let rows = element.sights.len();
            let mut z = DMatrix::zeros(rows, count);
            let mut one = DVector::zeros(count);
            for (row, ((range, closing), sight)) in linear.met().zip(&element.sights).enumerate() {
                one.fill(0.0);
                let plane = &boards.placed[sight.board].plane;
                let path = element
                    .facet
                    .map_or(0.0, |_| linear.through_glass(&element.u, plane, &glass));
                shapes.of_reading(range, closing, group.boards[sight.board].pose, path, &mut one);
                z.row_mut(row).tr_copy_from(&(&one / sight.sd));
            }
            if let Some(facet) = element.facet {
                let first = shapes.finer + 2 * FINER.len() * (firsts[number] + facet);
                let planes: Vec<_> = element
                    .sights
                    .iter()
                    .map(|s| boards.placed[s.board].plane)
                    .collect();
                let orders = finer(element.along);
                for axis in 0..2 {
                    for (row, by) in linear.by_tilt(axis, &planes).enumerate() {
                        for (k, order) in orders.iter().enumerate() {
                            // A milliradian.
                            z[(row, first + axis * FINER.len() + k)] =
                                by * order * UNIT / element.sights[row].sd;
                        }
                    }
                }
            }
            let mut jacobian = self.derivatives(group, element, boards, linear);
            let mut f = -&linear.y;
            if let Some(weight) = linear.weight(self.deviation(element)) {
                weight.apply(f.as_mut_slice());
                for matrix in [&mut z, &mut jacobian.shared, &mut jacobian.own] {
                    for column in matrix.as_mut_slice().chunks_exact_mut(rows.max(1)) {
                        weight.apply(column);
                    }
                }
            }
            add(&z, &f, &jacobian.shared, &jacobian.own, self.offset(number));
        });
        self.add_bare(dataset, solution, &shapes, &mut add)?;
        self.add_priors(solution, &shapes, &mut scores, &mut products, &mut by)?;
        let share = |column, _| {
            if column < shapes.shared {
                LEFT
            } else {
                LEFT_OF_PRIOR
            }
        };
        let shares = DVector::from_fn(shapes.count, share);
        Some((
            Evidence::new(scores, &products, &shares, &by, &solution.information)?,
            shapes,
        ))
        .map(|(evidence, shapes)| (shapes, evidence))
    }

    /// The rows of the bare distances.
    fn add_bare(
        &self,
        dataset: &Dataset,
        solution: &Solution,
        shapes: &Shapes,
        add: &mut impl FnMut(&DMatrix<f64>, &DVector<f64>, &DMatrix<f64>, &DMatrix<f64>, usize),
    ) -> Option<()> {
        let w = solution.state.shared.numbers(0)?;
        let bare = &dataset.session.bare_structure;
        let ranged = dataset.poses.iter().position(|p| p.label.kind == PoseKind::Bare);
        let ranged = ranged.filter(|_| bare.scanned);
        let mut place = 0;
        for (number, group) in self.groups.iter().enumerate() {
            for (i, facet) in group.facets.iter().enumerate() {
                let column = shapes.bare_of_facets + place;
                place += 1;
                if facet.bare.distances.is_empty() {
                    continue;
                }
                let shape = Self::shape(solution.state.own(number), i)?;
                let (residual, derivative) = self.bare(&facet.bare, &shape, w)?;
                let mut z = DMatrix::zeros(1, shapes.shared);
                z[(0, shapes.bare)] = UNIT / facet.bare.sd;
                z[(0, column)] = UNIT / facet.bare.sd;
                if let Some(pose) = ranged {
                    for (k, change) in shapes.warmed(pose).into_iter().enumerate() {
                        z[(0, shapes.warming + k)] = change / facet.bare.sd;
                    }
                }
                let mut shared = DMatrix::zeros(1, self.shared_dimension());
                shared
                    .view_mut((0, self.first_common), (1, self.common.len()))
                    .copy_from(&(&facet.bare.common / facet.bare.sd));
                let mut own = DMatrix::zeros(1, group.own_dimension());
                for (k, value) in derivative.iter().enumerate() {
                    own[(0, i * FACET_PARAMETERS + k)] = *value;
                }
                add(
                    &z,
                    &DVector::from_element(1, residual),
                    &shared,
                    &own,
                    self.offset(number),
                );
            }
        }
        Some(())
    }

    /// The rows of the priors.
    fn add_priors(
        &self,
        solution: &Solution,
        shapes: &Shapes,
        scores: &mut DVector<f64>,
        products: &mut DMatrix<f64>,
        by: &mut DMatrix<f64>,
    ) -> Option<()> {
        let mut add = |column: usize, parameter: usize, value: f64| {
            scores[column] = value;
            products[(column, column)] = 1.0;
            by[(column, parameter)] = 1.0;
        };
        let w = solution.state.shared.numbers(0)?;
        for i in 0..w.len() {
            add(shapes.shared + i, i, w[i] - self.prior_mean[i]);
        }
        let mut column = shapes.boards;
        for (number, group) in self.groups.iter().enumerate() {
            let errors = self.board_errors(group, solution.state.own(number))?;
            let first = self.offset(number) + group.board_column(0);
            for (i, value) in errors.iter().enumerate() {
                add(column, first + i, *value);
                column += 1;
            }
        }
        Some(())
    }
}
