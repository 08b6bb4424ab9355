//! Results of the joint solution for each element, each facet, the mounting and the biases, with covariances.
//!
//! Given the other parameters x, an element's deviation is normal about L(y − A·x) with L = τ²(I + τ²HᵀH)⁻¹Hᵀ. With C
//! the covariance of x, that of the direction is (G − LA)·C·(G − LA)ᵀ + τ²(I + τ²HᵀH)⁻¹.

use super::group::{FACET_PARAMETERS, Group, JointElement};
use super::linear::Linear;
use super::placed::Boards;
use super::problem::Joint;
use crate::lsq::{GroupJacobian, Information, Solution, State};
use crate::mount::pose;
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use catoptric_model::{Deflection, PoseData, RangeBias, frame};
use nalgebra::{DMatrix, DVector, Matrix2, Vector6};
use std::collections::BTreeSet;

/// Fraction of a residual's variance that the estimate must leave for the residual to count as evidence.
const MIN_LEFT: f64 = 1e-6;

/// One element in the joint solution.
pub(super) struct Answer {
    pub(super) beam: usize,
    pub(super) facet: usize,
    pub(super) deflection: Deflection,
    /// Covariance along (azimuth, elevation) of the tangent plane (cos φ·δθ, δφ), in rad²; `None` if the direction is
    /// open.
    pub(super) covariance: Option<Matrix2<f64>>,
    pub(super) readings: usize,
    /// Root-mean-square residual, in meters.
    pub(super) rms: f64,
    /// Its readings of each board.
    pub(super) seen: Vec<Seen>,
}

/// An element's reading of one board.
pub(super) struct Seen {
    /// Index of the board's group, index of the board in the group, and number of its pose.
    pub(super) group: usize,
    pub(super) board: usize,
    pub(super) number: usize,
    /// Standard deviation of the error that no other reading shares, in meters.
    pub(super) sd: f64,
    /// Residual in units of `sd`, after the deviation is subtracted.
    pub(super) residual: f64,
    /// Variance of the fitted value in units of `sd`²: the fraction of the reading that the estimate has absorbed.
    /// `None` if the direction is open.
    pub(super) fitted: Option<f64>,
}

impl Seen {
    /// Residual over its own standard deviation, which is below 1 because the estimate has absorbed part of the error.
    pub(super) fn studentized(&self) -> f64 {
        let left = 1.0 - self.fitted.unwrap_or(1.0);
        if left > MIN_LEFT {
            self.residual / left.sqrt()
        } else {
            0.0
        }
    }
}

/// Covariances of one element: of its direction along the tangent basis, and of the values fitted to its sights.
struct Spread {
    direction: Matrix2<f64>,
    fitted: Vec<f64>,
}

/// A deflected element with the indices of its group and of its facet there, and the derivatives of its predicted
/// ranges.
pub(super) struct Linearized<'g> {
    pub(super) group: usize,
    pub(super) facet: usize,
    pub(super) element: &'g JointElement,
    pub(super) linear: Linear,
    pub(super) by: GroupJacobian,
}

/// Dependence of an element's direction (along its tangent basis) and of its fitted sights on the parameters.
pub(super) struct Dependence {
    /// Covariance of the deviation when everything else is known.
    inner: Matrix2<f64>,
    /// Rotation from the two axes of the deviation to the tangent basis.
    turn: Matrix2<f64>,
    /// Derivatives with respect to w and to the group's own parameters: two rows for the direction, one per sight.
    pub(super) shared: DMatrix<f64>,
    pub(super) own: DMatrix<f64>,
}

impl Joint<'_> {
    /// Index of a group's first own parameter among all parameters.
    pub(super) fn offset(&self, group: usize) -> usize {
        self.shared_dimension()
            + self.groups[..group]
                .iter()
                .map(Group::own_dimension)
                .sum::<usize>()
    }

    /// Every deflected element, linearized at a state.
    pub(super) fn linearized<'g>(&'g self, state: &'g State) -> impl Iterator<Item = Linearized<'g>> + 'g {
        self.groups.iter().enumerate().flat_map(move |(number, group)| {
            let own = state.own(number);
            let boards = self.boards(group, &state.shared, own);
            group.elements.iter().filter_map(move |element| {
                let facet = element.facet?;
                let boards = boards.as_ref()?;
                let linear = self.element(element, &state.shared, own, boards)?;
                Some(Linearized {
                    group: number,
                    facet,
                    element,
                    by: self.derivatives(group, element, boards, &linear),
                    linear,
                })
            })
        })
    }

    /// Derivatives of one element's predicted ranges, divided by their standard deviations.
    pub(super) fn derivatives(
        &self,
        group: &Group,
        element: &JointElement,
        boards: &Boards,
        linear: &Linear,
    ) -> GroupJacobian {
        let rows = element.sights.len();
        let mut by = GroupJacobian {
            shared: DMatrix::zeros(rows, self.shared_dimension()),
            own: DMatrix::zeros(rows, group.own_dimension()),
        };
        self.differentiate(group, element, boards, linear, &mut by, 0);
        by
    }

    /// Every deflected element of the solution.
    pub(super) fn answers(&self, solution: &Solution) -> Vec<Answer> {
        self.linearized(&solution.state)
            .map(|at| {
                let (element, linear) = (at.element, &at.linear);
                let group = &self.groups[at.group];
                let rest = linear.rest();
                let in_meters = rest.iter().zip(&element.sights).map(|(r, s)| (r * s.sd).powi(2));
                let count = element.sights.len().max(1) as f64;
                let spread = self.spread(&solution.information, &at);
                let seen = element.sights.iter().enumerate().map(|(i, sight)| Seen {
                    group: at.group,
                    board: sight.board,
                    number: group.boards[sight.board].number,
                    sd: sight.sd,
                    residual: rest[i],
                    fitted: spread.as_ref().map(|s| s.fitted[i]),
                });
                Answer {
                    beam: element.beam,
                    facet: group.facets[at.facet].facet,
                    deflection: Deflection::from_exit(element.azimuth, &linear.v, linear.fan.distance),
                    rms: (in_meters.sum::<f64>() / count).sqrt(),
                    seen: seen.collect(),
                    readings: element.sights.iter().map(|s| s.count).sum(),
                    covariance: spread.map(|s| s.direction),
                }
            })
            .collect()
    }

    /// Beam, elevation and covariance along the tangent basis of every deflected element at a state.
    pub(super) fn covariances(
        &self,
        state: &State,
        information: &Information,
    ) -> Vec<(usize, f64, Option<Matrix2<f64>>)> {
        self.linearized(state)
            .map(|at| {
                let (element, linear) = (at.element, &at.linear);
                let exit = Deflection::from_exit(element.azimuth, &linear.v, linear.fan.distance);
                let spread = self.spread(information, &at);
                (element.beam, exit.elevation, spread.map(|s| s.direction))
            })
            .collect()
    }

    /// `None` if the direction is open.
    fn spread(&self, information: &Information, at: &Linearized) -> Option<Spread> {
        let linear = &at.linear;
        let by = self.dependence(at.facet, linear, &at.by)?;
        let rows = linear.y.len();
        let c = information.covariance_within(at.group, &by.shared, &by.own)?;
        let direction = c.fixed_view::<2, 2>(0, 0) + by.turn * by.inner * by.turn.transpose();
        let deviating = &linear.h * by.inner * linear.h.transpose();
        Some(Spread {
            direction: (direction + direction.transpose()) * 0.5,
            fitted: (0..rows).map(|i| c[(2 + i, 2 + i)] + deviating[(i, i)]).collect(),
        })
    }

    /// Dependence of an element's direction and fitted sights on the parameters.
    pub(super) fn dependence(&self, facet: usize, linear: &Linear, by: &GroupJacobian) -> Option<Dependence> {
        let (across, up) = frame::tangent_basis(&linear.v);
        let tangent = [across, up];
        let tau2 = self.flatness.tau.powi(2);
        let inner = (Matrix2::identity() + linear.h.transpose() * &linear.h * tau2).try_inverse()? * tau2;
        let gain = inner * linear.h.transpose();
        let turn = Matrix2::from_fn(|i, j| tangent[i].dot(&linear.axes[j]));
        let rows = linear.y.len();
        let taken_up = |part: &DMatrix<f64>| {
            let taken = &gain * part;
            let mut all = DMatrix::zeros(2 + rows, part.ncols());
            all.rows_mut(0, 2).copy_from(&-(turn * &taken));
            all.rows_mut(2, rows).copy_from(&(part - &linear.h * taken));
            all
        };
        let (shared, mut own) = (taken_up(&by.shared), taken_up(&by.own));
        for (row, axis) in tangent.iter().enumerate() {
            for (column, turned) in linear.fan.directions() {
                own[(row, facet * FACET_PARAMETERS + column)] += axis.dot(&turned);
            }
        }
        Some(Dependence {
            inner,
            turn,
            shared,
            own,
        })
    }

    /// Embeds a combination of the shared parameters and of one group's own in the vector of all parameters.
    pub(super) fn among_all(
        &self,
        dimension: usize,
        group: usize,
        shared: &DVector<f64>,
        own: &DVector<f64>,
    ) -> DVector<f64> {
        let mut all = DVector::zeros(dimension);
        all.rows_mut(0, shared.len()).copy_from(shared);
        all.rows_mut(self.offset(group), own.len()).copy_from(own);
        all
    }

    /// Planes of the facets, without those in `bent` and those that the boards leave open, which have no covariance.
    pub(super) fn facets(
        &self,
        solution: &Solution,
        names: &dyn Fn(usize) -> String,
        bent: &BTreeSet<usize>,
    ) -> Vec<FacetEstimate> {
        let mut all = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            let straight = group
                .facets
                .iter()
                .enumerate()
                .filter(|(_, f)| !bent.contains(&f.facet));
            for (i, facet) in straight {
                let first = self.offset(number) + i * FACET_PARAMETERS;
                let among = [first, first + 1, first + 2];
                let shape = Self::shape(solution.state.own(number), i);
                let covariance = solution.information.covariance_among(&among);
                if let (Some(shape), Some(c)) = (shape, covariance) {
                    all.push((
                        facet.facet,
                        FacetEstimate {
                            facet: names(facet.facet),
                            normal: shape.normal.into_inner().into(),
                            offset_m: shape.offset,
                            covariance: std::array::from_fn(|r| {
                                std::array::from_fn(|k| 0.5 * (c[(r, k)] + c[(k, r)]))
                            }),
                        },
                    ));
                }
            }
        }
        all.sort_by_key(|(index, _)| *index);
        all.into_iter().map(|(_, estimate)| estimate).collect()
    }

    /// The mounting with its covariance.
    pub(super) fn mount(&self, solution: &Solution) -> Option<MountEstimate> {
        let w = solution.state.shared.numbers(0)?;
        let motion: Vector6<f64> = &self.mounting.motion * w;
        let data = PoseData::from(&pose::moved(&self.mounting.rig_from_sensor, &motion));
        let mut combination = DMatrix::zeros(6, solution.information.dimension());
        combination
            .columns_mut(0, w.len())
            .copy_from(&self.mounting.motion);
        let c = solution.information.covariance_of(&combination)?;
        Some(MountEstimate {
            translation_m: data.translation_m,
            rotation_xyzw: data.rotation_xyzw,
            covariance: Some(std::array::from_fn(|r| {
                std::array::from_fn(|k| 0.5 * (c[(r, k)] + c[(k, r)]))
            })),
        })
    }

    /// The biases as corrected by the boards.
    pub(super) fn corrected_bias(&self, solution: &Solution) -> Option<RangeBias> {
        let w = solution.state.shared.numbers(0)?;
        Some(self.common.applied(&w.as_slice()[self.first_common..]))
    }
}
