//! What the residuals say about errors that the model omits.
//!
//! At the solution f ~ N(0, I − H) with H = J(JᵀJ)⁻¹Jᵀ, if all beliefs hold. An omitted error of known shape z, in the
//! units of f, has the score zᵀf; scores of several are normal with covariance Zᵀ(I − H)Z, which counts what the
//! estimated parameters have absorbed of them. A parameter's own prior is a row of f too.

use crate::lsq::Information;
use nalgebra::{DMatrix, DVector};

/// Part of a shape, as a share of its square, that the model must leave for it to be tested.
pub(super) const LEFT: f64 = 1e-7;

/// The same of a parameter's prior. Less means that the readings hardly determine it: what the linearization neglects,
/// some thousandths of its standard deviation, would be taken for evidence.
pub(super) const LEFT_OF_PRIOR: f64 = 1e-3;

/// Scores of some omitted errors, with mean 0 and a known covariance if there are none.
#[derive(Debug, Clone)]
pub(super) struct Evidence {
    scores: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Variance of each below which it is not tested: a share of zᵀz.
    least: DVector<f64>,
}

/// A test statistic and its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Statistic {
    pub(super) chi_squared: f64,
    pub(super) freedom: f64,
}

impl Evidence {
    /// From the scores zᵀf, the products ZᵀZ, the share of each square that has to be left, and the rows zᵀJ; `None` if
    /// the solution leaves one of them open.
    pub(super) fn new(
        scores: DVector<f64>,
        products: &DMatrix<f64>,
        shares: &DVector<f64>,
        by_parameters: &DMatrix<f64>,
        information: &Information,
    ) -> Option<Self> {
        let absorbed = information.covariance_of(by_parameters)?;
        Some(Self {
            scores,
            least: products.diagonal().component_mul(shares),
            covariance: products - absorbed,
        })
    }

    fn part(&self, of: &[usize]) -> (DVector<f64>, DMatrix<f64>) {
        let scores = DVector::from_iterator(of.len(), of.iter().map(|i| self.scores[*i]));
        let covariance = DMatrix::from_fn(of.len(), of.len(), |i, j| self.covariance[(of[i], of[j])]);
        (scores, covariance)
    }

    /// Generalized inverse of the covariance of some scores, without directions of which next to nothing is left, and
    /// its rank.
    fn inverse(&self, of: &[usize]) -> (DMatrix<f64>, usize) {
        if of.is_empty() {
            return (DMatrix::zeros(0, 0), 0);
        }
        let (_, covariance) = self.part(of);
        let scale = DVector::from_iterator(
            of.len(),
            of.iter().map(|i| {
                let least = self.least[*i];
                if least > 0.0 { 1.0 / least.sqrt() } else { 0.0 }
            }),
        );
        let scaled = DMatrix::from_fn(of.len(), of.len(), |i, j| {
            covariance[(i, j)] * scale[i] * scale[j]
        });
        let eigen = ((&scaled + scaled.transpose()) * 0.5).symmetric_eigen();
        let mut rank = 0;
        let inverted = eigen.eigenvalues.map(|value| {
            if value > 1.0 {
                rank += 1;
                1.0 / value
            } else {
                0.0
            }
        });
        let middle = &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
        (
            DMatrix::from_fn(of.len(), of.len(), |i, j| middle[(i, j)] * scale[i] * scale[j]),
            rank,
        )
    }

    /// χ² of the hypothesis that none of these errors is there.
    pub(super) fn shift(&self, of: &[usize]) -> Statistic {
        let (scores, _) = self.part(of);
        let (inverse, rank) = self.inverse(of);
        Statistic {
            chi_squared: scores.dot(&(inverse * &scores)).max(0.0),
            freedom: rank as f64,
        }
    }

    /// The errors that fit best, in units of their shapes.
    pub(super) fn sizes(&self, of: &[usize]) -> DVector<f64> {
        let (scores, _) = self.part(of);
        -(self.inverse(of).0 * scores)
    }

    /// Σ score² of errors that have as many sizes: larger than expected if their spread is.
    ///
    /// Its distribution, a sum of χ² of one degree of freedom each times the eigenvalues of the covariance, is that of a
    /// χ² scaled and shifted to the same three moments (Pearson 1959). Also returns the mean ratio of the squares to
    /// what is expected of them.
    pub(super) fn spread(&self, of: &[usize]) -> (Statistic, f64) {
        let (scores, covariance) = self.part(of);
        let square = &covariance * &covariance;
        let [first, second, third] = [covariance.trace(), square.trace(), square.dot(&covariance)];
        if !(first > 0.0 && second > 0.0 && third > 0.0) {
            return Default::default();
        }
        let sum = scores.norm_squared();
        let freedom = second.powi(3) / (third * third);
        let normal = (sum - first) / (2.0 * second).sqrt();
        let statistic = Statistic {
            chi_squared: (freedom + (2.0 * freedom).sqrt() * normal).max(0.0),
            freedom,
        };
        (statistic, sum / first)
    }

    /// The same with some of the errors estimated.
    pub(super) fn given(&self, estimated: &[usize]) -> Self {
        let (scores, _) = self.part(estimated);
        let (inverse, _) = self.inverse(estimated);
        let across = DMatrix::from_fn(self.scores.len(), estimated.len(), |i, j| {
            self.covariance[(i, estimated[j])]
        });
        let gain = &across * inverse;
        Self {
            scores: &self.scores - &gain * scores,
            covariance: &self.covariance - gain * across.transpose(),
            least: self.least.clone(),
        }
    }
}
