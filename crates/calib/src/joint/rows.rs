//! The rows of a group: those of its elements, each weighted for its deviation, then those of its facets' distances.

use super::fan::Shape;
use super::group::{BareFacet, FACET_PARAMETERS};
use super::problem::Joint;
use crate::lsq::{GroupJacobian, GroupRows, GroupedResiduals, Point};
use catoptric_model::frame;
use nalgebra::{DMatrix, DVector};

/// Residuals of a group at a point.
struct At {
    residuals: DVector<f64>,
    /// If requested.
    jacobian: Option<GroupJacobian>,
    /// Σ ln det(I + τ²HᵀH) over its elements.
    log_deviations: f64,
}

impl Joint<'_> {
    /// The rows of a group at a point: those of its elements, then those of its facets' distances.
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
        let (mut row, mut log_deviations) = (0, 0.0);
        for element in &group.elements {
            let linear = self.element(element, shared, own, &boards)?;
            let rows = row..row + element.sights.len();
            let weight = linear.weight(self.deviation(element));
            residuals.as_mut_slice()[rows.clone()].copy_from_slice((-&linear.y).as_slice());
            if let Some(weight) = &weight {
                weight.apply(&mut residuals.as_mut_slice()[rows.clone()]);
                log_deviations += weight.log_determinant;
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
            log_deviations,
        })
    }

    /// Predicted minus measured distance of a facet, in standard deviations, and its derivatives with respect to the
    /// plane.
    pub(super) fn bare(&self, facet: &BareFacet, shape: &Shape, w: &DVector<f64>) -> Option<(f64, [f64; 3])> {
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

impl GroupedResiduals for Joint<'_> {
    fn is_stopped(&self) -> bool {
        self.stop.is_requested()
    }

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
            log_covariance: at.log_deviations,
        })
    }
}
