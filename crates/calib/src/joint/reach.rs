//! Does the linear covariance hold over the region that it describes?
//!
//! Boards that are face-on to a beam determine its direction only by the curvature of the range, ½·s·δ². Noise moves
//! the estimate to some δ̂, where they appear to have a lever, s·δ̂, and so to determine something; yet −δ̂ fits
//! equally well. The profile of ‖f‖² along a direction, with all other parameters at their optimum, shows this (Bates
//! and Watts, "Nonlinear Regression Analysis and Its Applications", 1988, section 6.1): over k standard deviations it
//! rises by k² if the problem is linear, and by k²(1 ± 1/q)² if it is curved, with q = δ̂ over the standard deviation.

use super::group::JointElement;
use super::linear::Linear;
use super::problem::Joint;
use crate::lsq::{self, GroupJacobian, GroupedResiduals, Point, Solution};
use catoptric_model::frame;
use nalgebra::{DVector, Matrix2, Vector2, Vector3};
use std::collections::{BTreeMap, BTreeSet};

/// Number of standard deviations by which a direction is moved: the extent of a 95 % region.
const REACH: f64 = 2.0;

/// Rise of the profile, relative to that of a linear problem, that counts as linear: q ≥ 7.5.
const LINEAR_RISE: std::ops::Range<f64> = 0.75..1.33;

/// Standard deviation below which curvature is negligible, in radians (0.1°): over twice that, a range at 5 m bends by
/// 0.03 mm.
pub(super) const STRAIGHT_SD: f64 = 0.1 * std::f64::consts::PI / 180.0;

/// Tolerance to which a moved direction is held, as a fraction of its standard deviation.
const HELD: f64 = 1e-2;

/// Accuracy of a profile: its rise is compared with a quarter.
const SEARCH: lsq::SolverOptions = lsq::SolverOptions {
    reduction_tolerance: 1e-6,
    step_tolerance: 1e-9,
    gradient_tolerance: 1e-9,
    max_evaluations: 60,
    first_radius: 1.0,
    rank_threshold: 1e-11,
};

/// One element's direction, moved from the solution.
struct Moved<'a> {
    joint: &'a Joint<'a>,
    group: usize,
    element: &'a JointElement,
    /// Unit vector across the direction found, along which it is moved.
    axis: Vector3<f64>,
    /// Angle to which it is moved, and how closely it is held there, in radians.
    to: f64,
    held: f64,
}

/// The least certain direction of a facet.
struct Weakest<'a> {
    element: &'a JointElement,
    sd: f64,
    axis: Vector3<f64>,
    /// The direction as a combination of parameters.
    combination: DVector<f64>,
}

impl Joint<'_> {
    /// Facets, by index in the session, whose linear covariance does not hold over its extent.
    pub(super) fn bent(&self, solution: &Solution) -> BTreeSet<usize> {
        let bends = |group: usize, weakest: &Weakest| {
            [REACH, -REACH].iter().any(|k| {
                let rise = self.rise(solution, group, weakest, *k);
                !rise.is_some_and(|r| LINEAR_RISE.contains(&r))
            })
        };
        let weakest = self.weakest(solution);
        let bent = weakest.iter().filter(|((group, _), w)| bends(*group, w));
        bent.map(|((group, facet), _)| self.groups[*group].facets[*facet].facet)
            .collect()
    }

    /// The least certain direction of each facet, by group and facet, if it is uncertain enough for curvature to
    /// matter.
    fn weakest<'a>(&'a self, solution: &'a Solution) -> BTreeMap<(usize, usize), Weakest<'a>> {
        let information = &solution.information;
        let mut weakest: BTreeMap<(usize, usize), Weakest> = BTreeMap::new();
        for at in self.linearized(&solution.state) {
            let (group, facet, linear) = (at.group, at.facet, &at.linear);
            let Some(by) = self.dependence(facet, linear, &at.by) else {
                continue;
            };
            let (by_shared, by_own) = (by.shared.rows(0, 2).into_owned(), by.own.rows(0, 2).into_owned());
            let Some(c) = information.covariance_within(group, &by_shared, &by_own) else {
                continue;
            };
            let eigen = Matrix2::new(c[(0, 0)], c[(0, 1)], c[(1, 0)], c[(1, 1)]).symmetric_eigen();
            let largest = eigen.eigenvalues.imax();
            let sd = eigen.eigenvalues[largest].max(0.0).sqrt();
            let place = (group, facet);
            if sd > STRAIGHT_SD && weakest.get(&place).is_none_or(|w| w.sd < sd) {
                let along = eigen.eigenvectors.column(largest);
                let (across, up) = frame::tangent_basis(&linear.v);
                weakest.insert(
                    place,
                    Weakest {
                        element: at.element,
                        sd,
                        axis: across.into_inner() * along[0] + up.into_inner() * along[1],
                        combination: self.among_all(
                            information.dimension(),
                            group,
                            &by_shared.tr_mul(&along),
                            &by_own.tr_mul(&along),
                        ),
                    },
                );
            }
        }
        weakest
    }

    /// Rise of ‖f‖² over k standard deviations, divided by k². `None` if the problem is undefined that far away.
    fn rise(&self, solution: &Solution, group: usize, weakest: &Weakest, k: f64) -> Option<f64> {
        let step = solution.information.step_along(&weakest.combination)?;
        let moved = Moved {
            joint: self,
            group,
            element: weakest.element,
            axis: weakest.axis,
            to: k * weakest.sd,
            held: HELD * weakest.sd,
        };
        let problem = self.with_priors(&moved);
        let profile = lsq::minimize(&problem, solution.state.retract(&(step * k)), &SEARCH).ok()?;
        Some((profile.sum_of_squares - solution.sum_of_squares) / (k * k))
    }
}

impl Moved<'_> {
    /// The element linearized, the derivatives of its rows, and its distance from the prescribed angle in units of the
    /// tolerance.
    fn row(&self, shared: &Point, own: &Point) -> Option<(Linear, GroupJacobian, f64)> {
        let group = &self.joint.groups[self.group];
        let boards = self.joint.boards(group, shared, own)?;
        let linear = self.joint.element(self.element, shared, own, &boards)?;
        let by = self.joint.derivatives(group, self.element, &boards, &linear);
        let angle = libm::asin(linear.v.dot(&self.axis).clamp(-1.0, 1.0));
        let off = (angle - self.to) / self.held;
        Some((linear, by, off))
    }
}

impl GroupedResiduals for Moved<'_> {
    fn is_stopped(&self) -> bool {
        self.joint.is_stopped()
    }

    fn groups(&self) -> usize {
        self.joint.groups()
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        let residuals = self.joint.residuals(group, shared, own)?;
        if group != self.group {
            return Some(residuals);
        }
        let (.., off) = self.row(shared, own)?;
        Some(residuals.push(off))
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        let mut jacobian = self.joint.jacobian(group, shared, own)?;
        if group != self.group {
            return Some(jacobian);
        }
        let (linear, by, _) = self.row(shared, own)?;
        let by = self.joint.dependence(self.element.facet?, &linear, &by)?;
        let (across, up) = frame::tangent_basis(&linear.v);
        let cos = (1.0 - linear.v.dot(&self.axis).powi(2)).sqrt();
        let along = Vector2::new(across.dot(&self.axis), up.dot(&self.axis)) / (cos * self.held);
        let row = jacobian.shared.nrows();
        jacobian.shared = jacobian.shared.insert_row(row, 0.0);
        jacobian.own = jacobian.own.insert_row(row, 0.0);
        jacobian
            .shared
            .set_row(row, &(along.transpose() * by.shared.rows(0, 2)));
        jacobian
            .own
            .set_row(row, &(along.transpose() * by.own.rows(0, 2)));
        Some(jacobian)
    }
}
