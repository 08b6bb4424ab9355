//! Gaussian priors as rows: L·(x ⊟ x̄), LᵀL the inverse covariance of a block about its mean.

use super::manifold::{ParameterBlock, Point};
use super::problem::{GroupJacobian, GroupRows, GroupedResiduals};
use nalgebra::{DMatrix, DVector};

/// Gaussian prior of one block.
#[derive(Debug, Clone, PartialEq)]
pub struct Prior {
    block: usize,
    mean: ParameterBlock,
    root: DMatrix<f64>,
}

impl Prior {
    /// A prior with independent errors: one standard deviation for each tangent coordinate of the block.
    ///
    /// An infinite standard deviation does not constrain its coordinate.
    ///
    /// # Panics
    ///
    /// If the numbers do not fit the block or are not positive.
    pub fn independent(block: usize, mean: ParameterBlock, standard_deviations: &[f64]) -> Self {
        assert_eq!(
            standard_deviations.len(),
            mean.dimension(),
            "one standard deviation each"
        );
        assert!(
            standard_deviations.iter().all(|sd| *sd > 0.0),
            "positive standard deviations"
        );
        let weights = standard_deviations.iter().map(|sd| 1.0 / sd).collect();
        Self {
            block,
            mean,
            root: DMatrix::from_diagonal(&DVector::from_vec(weights)),
        }
    }

    /// L·(x ⊟ x̄).
    ///
    /// # Panics
    ///
    /// If the point has no such block, or one of another kind.
    pub fn residuals(&self, at: &Point) -> DVector<f64> {
        &self.root * self.mean.difference(&at.blocks[self.block])
    }

    /// Derivatives of the rows with respect to all tangent coordinates of the point.
    ///
    /// # Panics
    ///
    /// As [`residuals`](Self::residuals).
    pub fn jacobian(&self, at: &Point) -> DMatrix<f64> {
        let block = &at.blocks[self.block];
        let mut all = DMatrix::zeros(self.root.nrows(), at.dimension());
        let part = &self.root * self.mean.difference_jacobian(block);
        all.columns_mut(at.offset(self.block), block.dimension())
            .copy_from(&part);
        all
    }
}

/// A problem with priors: those on shared parameters form one more group, those on a group's own are its last rows.
#[derive(Debug, Clone, PartialEq)]
pub struct WithPriors<'a, P> {
    /// The problem without priors.
    pub problem: &'a P,
    /// Priors on the blocks of the shared point.
    pub shared: Vec<Prior>,
    /// Priors on the blocks of each group's own point; groups beyond the last one have none.
    pub own: Vec<Vec<Prior>>,
}

impl<P> WithPriors<'_, P> {
    fn own(&self, group: usize) -> &[Prior] {
        self.own.get(group).map_or(&[], Vec::as_slice)
    }

    /// The measured residuals of a group, with its priors as the last rows.
    fn residuals_below(&self, group: usize, own: &Point, measured: DVector<f64>) -> DVector<f64> {
        let priors = self.own(group).iter().map(|p| p.residuals(own));
        stacked(std::iter::once(measured).chain(priors))
    }

    fn jacobian_below(&self, group: usize, own: &Point, measured: GroupJacobian) -> GroupJacobian {
        let priors = self.own(group).iter().map(|p| p.jacobian(own));
        let own = below(own.dimension(), std::iter::once(measured.own).chain(priors));
        let shared = measured.shared.resize_vertically(own.nrows(), 0.0);
        GroupJacobian { shared, own }
    }
}

impl<P: GroupedResiduals> GroupedResiduals for WithPriors<'_, P> {
    fn is_stopped(&self) -> bool {
        self.problem.is_stopped()
    }

    fn groups(&self) -> usize {
        self.problem.groups() + 1
    }

    fn residuals(&self, group: usize, shared: &Point, own: &Point) -> Option<DVector<f64>> {
        if group == self.problem.groups() {
            return Some(stacked(self.shared.iter().map(|p| p.residuals(shared))));
        }
        Some(self.residuals_below(group, own, self.problem.residuals(group, shared, own)?))
    }

    fn jacobian(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupJacobian> {
        if group == self.problem.groups() {
            let all = below(shared.dimension(), self.shared.iter().map(|p| p.jacobian(shared)));
            let own = DMatrix::zeros(all.nrows(), own.dimension());
            return Some(GroupJacobian { shared: all, own });
        }
        Some(self.jacobian_below(group, own, self.problem.jacobian(group, shared, own)?))
    }

    fn linearized(&self, group: usize, shared: &Point, own: &Point) -> Option<GroupRows> {
        if group == self.problem.groups() {
            return Some(GroupRows {
                residuals: self.residuals(group, shared, own)?,
                jacobian: self.jacobian(group, shared, own)?,
                log_covariance: 0.0,
            });
        }
        let measured = self.problem.linearized(group, shared, own)?;
        Some(GroupRows {
            residuals: self.residuals_below(group, own, measured.residuals),
            jacobian: self.jacobian_below(group, own, measured.jacobian),
            log_covariance: measured.log_covariance,
        })
    }
}

fn stacked(parts: impl Iterator<Item = DVector<f64>>) -> DVector<f64> {
    DVector::from_vec(parts.flat_map(|p| p.as_slice().to_vec()).collect())
}

fn below(columns: usize, parts: impl Iterator<Item = DMatrix<f64>>) -> DMatrix<f64> {
    let parts: Vec<_> = parts.collect();
    let mut all = DMatrix::zeros(parts.iter().map(DMatrix::nrows).sum(), columns);
    let mut row = 0;
    for part in &parts {
        all.rows_mut(row, part.nrows()).copy_from(part);
        row += part.nrows();
    }
    all
}
