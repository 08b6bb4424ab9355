//! What the solution says of each element, each facet, the mounting and the biases, with covariances.
//!
//! Given the other parameters x, an element's departure is normal about L(y − A·x) with L = τ²(I + τ²HᵀH)⁻¹Hᵀ. With C the
//! covariance of x, that of the direction is (G − LA)·C·(G − LA)ᵀ + τ²(I + τ²HᵀH)⁻¹.

use super::problem::{FACET_PARAMETERS, Fan, Joint, Linear};
use crate::least_squares::{Information, Solution};
use crate::pose;
use catoptric_model::calibration::{FacetEstimate, MountEstimate};
use catoptric_model::{Deflection, PoseData, RangeBias, frame};
use nalgebra::{DMatrix, DVector, Dyn, Matrix2, Matrix6, OMatrix, U6, Vector6};

/// An element's direction as the joint solution has it.
pub(super) struct Answer {
    pub(super) beam: usize,
    pub(super) facet: usize,
    pub(super) deflection: Deflection,
    /// Covariance along (azimuth, elevation) of the tangent plane (cos φ·δθ, δφ), in rad²; `None` where it is open.
    pub(super) covariance: Option<Matrix2<f64>>,
    /// Standardized residuals after the departure, their number of readings and their rms in metres.
    pub(super) residuals: Vec<f64>,
    pub(super) readings: usize,
    pub(super) rms: f64,
    /// χ² of the element's rows, its departure included.
    pub(super) chi_squared: f64,
    /// Boards, by their stretch.
    pub(super) poses: Vec<usize>,
}

impl Joint<'_> {
    /// Where the own parameters of a group begin among all.
    fn offset(&self, group: usize) -> usize {
        self.shared_dimension()
            + self.groups[..group]
                .iter()
                .map(super::problem::Group::own_dimension)
                .sum::<usize>()
    }

    /// Every deflected element of the solution.
    pub(super) fn answers(&self, solution: &Solution) -> Vec<Answer> {
        let mut all = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            let own = solution.state.own(number);
            let shared = &solution.state.shared;
            let Some(boards) = self.boards(group, shared, own) else {
                continue;
            };
            for element in &group.elements {
                let Some(facet) = element.facet else { continue };
                let linear = self.element(group, element, shared, own, &boards, true);
                let fan = Self::shape(own, facet).and_then(|s| Fan::of(element, &s, &self.flatness));
                let (Some(linear), Some(fan)) = (linear, fan) else {
                    continue;
                };
                let tau = self.flatness.tau;
                let rest = &linear.y - &linear.h * linear.delta;
                let in_metres = rest.iter().zip(&element.sights).map(|(r, s)| (r * s.sd).powi(2));
                let count = element.sights.len().max(1) as f64;
                all.push(Answer {
                    beam: element.beam,
                    facet: group.facets[facet].facet,
                    deflection: Deflection::from_exit(element.azimuth, &linear.v, linear.distance),
                    covariance: self.covariance(&solution.information, number, facet, &fan, &linear),
                    rms: (in_metres.sum::<f64>() / count).sqrt(),
                    chi_squared: rest.norm_squared()
                        + if tau > 0.0 {
                            linear.delta.norm_squared() / (tau * tau)
                        } else {
                            0.0
                        },
                    residuals: rest.iter().copied().collect(),
                    readings: element.sights.iter().map(|s| s.count).sum(),
                    poses: element.sights.iter().map(|s| group.boards[s.board].pose).collect(),
                });
            }
        }
        all
    }

    fn covariance(
        &self,
        information: &Information,
        group: usize,
        facet: usize,
        fan: &Fan,
        linear: &Linear,
    ) -> Option<Matrix2<f64>> {
        let (across, up) = frame::tangent_basis(&linear.v);
        let tangent = [across, up];
        let tau2 = self.flatness.tau.powi(2);
        let inner = (Matrix2::identity() + linear.h.transpose() * &linear.h * tau2).try_inverse()? * tau2;
        // From the departure's two axes to the tangent basis.
        let turn = Matrix2::from_fn(|i, j| tangent[i].dot(&linear.axes[j]));
        let gain = turn * inner * linear.h.transpose();
        let mut combination = DMatrix::zeros(2, information.dimension());
        let width = self.shared_dimension();
        combination.columns_mut(0, width).copy_from(&-(&gain * &linear.shared));
        let first = self.offset(group);
        let own = linear.own.ncols();
        combination.columns_mut(first, own).copy_from(&-(&gain * &linear.own));
        for (row, axis) in tangent.iter().enumerate() {
            for (column, turned) in fan.directions() {
                combination[(row, first + facet * FACET_PARAMETERS + column)] += axis.dot(&turned);
            }
        }
        let of_plane = information.covariance_of(&combination)?;
        let total = of_plane.fixed_view::<2, 2>(0, 0) + turn * inner * turn.transpose();
        Some((total + total.transpose()) * 0.5)
    }

    /// The facets' planes; one that the boards leave open has no covariance and is left out.
    pub(super) fn facets(&self, solution: &Solution, names: &dyn Fn(usize) -> String) -> Vec<FacetEstimate> {
        let mut all = Vec::new();
        for (number, group) in self.groups.iter().enumerate() {
            for (i, facet) in group.facets.iter().enumerate() {
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

    /// The biases as the boards have corrected them.
    pub(super) fn corrected_bias(&self, solution: &Solution) -> Option<RangeBias> {
        let w = solution.state.shared.numbers(0)?;
        Some(self.common.applied(&w.as_slice()[self.first_common..]))
    }
}

/// Motion matrix of a mounting that is known as its uncertainty says: independent errors first, then the common ones.
pub(super) fn motion_of(independent: &Matrix6<f64>, common: &OMatrix<f64, U6, Dyn>, count: usize) -> OMatrix<f64, U6, Dyn> {
    let eigen = independent.symmetric_eigen();
    let root = eigen.eigenvectors * Matrix6::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0).sqrt()));
    let mut motion = OMatrix::<f64, U6, Dyn>::zeros(6 + count);
    motion.columns_mut(0, 6).copy_from(&root);
    if common.ncols() == count {
        motion.columns_mut(6, count).copy_from(common);
    }
    motion
}

/// Mean of w for a prior at another mounting: what of it is a motion over its standard deviation.
pub(super) fn prior_mean(motion: &Vector6<f64>, sd: &Vector6<f64>, count: usize) -> DVector<f64> {
    let mut mean = DVector::zeros(6 + count);
    for i in 0..6 {
        mean[i] = motion[i] / sd[i];
    }
    mean
}
