//! What the residuals determine about the parameters: rank, open directions, covariance and correlations, from one
//! factorization.
//!
//! With residuals in units of their standard deviations the covariance is (JᵀJ)⁻¹. If J has a null space N, no single
//! covariance matrix exists: a combination g·x of parameters has a variance gᵀ(JᵀJ)⁻g only if g is perpendicular to N,
//! and then any generalized inverse gives the same one. Everything else is `None`, never 0.

use super::elimination::Elimination;
use nalgebra::{DMatrix, DVector};

/// Cosine between a combination of parameters and the null space above which the combination is open.
const OPEN_COSINE: f64 = 1e-7;

/// Component of a null vector, relative to the largest, below which it is rounding.
const NAMED_PART: f64 = 1e-6;

/// JᵀJ at a point, factored.
#[derive(Debug, Clone, PartialEq)]
pub struct Information {
    linear: Elimination,
    /// Orthonormal null basis with the columns of J at length 1.
    scaled_null: DMatrix<f64>,
    null: DMatrix<f64>,
}

impl Information {
    pub(super) fn new(linear: Elimination) -> Self {
        let vectors = linear.null_vectors();
        let scale = linear.scale();
        let unscaled: Vec<_> = vectors.iter().map(|v| v.component_div(scale)).collect();
        Self {
            scaled_null: orthonormal(&vectors, linear.dimension()),
            null: orthonormal(&unscaled, linear.dimension()),
            linear,
        }
    }

    /// Number of parameters n: shared, then each group's own.
    pub fn dimension(&self) -> usize {
        self.linear.dimension()
    }

    /// Rank of J.
    pub fn rank(&self) -> usize {
        self.linear.rank()
    }

    /// ln det(JᵀJ) over the independent columns, as needed for a likelihood of variances.
    pub fn log_determinant(&self) -> f64 {
        self.linear.log_determinant()
    }

    /// Orthonormal basis of the directions in which no residual changes, n × (n − rank).
    ///
    /// Each vector's largest component is positive.
    pub fn null_space(&self) -> &DMatrix<f64> {
        &self.null
    }

    /// The open directions in the caller's names: the components of each null vector, the largest first.
    ///
    /// # Panics
    ///
    /// If the numbers of names and parameters differ.
    pub fn open_directions<'n>(&self, names: &[&'n str]) -> Vec<Vec<(&'n str, f64)>> {
        assert_eq!(names.len(), self.dimension(), "one name for each parameter");
        self.null
            .column_iter()
            .map(|vector| {
                let least = NAMED_PART * vector.amax();
                let mut terms: Vec<_> = names
                    .iter()
                    .copied()
                    .zip(vector.iter().copied())
                    .filter(|(_, v)| v.abs() > least)
                    .collect();
                terms.sort_by(|a, b| b.1.abs().total_cmp(&a.1.abs()));
                terms
            })
            .collect()
    }

    /// Whether the residuals leave the combination g·x open.
    ///
    /// # Panics
    ///
    /// If g has another dimension.
    pub fn is_open(&self, g: &DVector<f64>) -> bool {
        let scaled = g.component_div(self.linear.scale());
        (self.scaled_null.transpose() * &scaled).norm() > OPEN_COSINE * scaled.norm()
    }

    /// Covariance G(JᵀJ)⁻¹Gᵀ of combinations G·x, one per row; `None` if one of them is open.
    ///
    /// # Panics
    ///
    /// If G does not have n columns.
    pub fn covariance_of(&self, combinations: &DMatrix<f64>) -> Option<DMatrix<f64>> {
        let mut halves = Vec::with_capacity(combinations.nrows());
        for row in combinations.row_iter() {
            let g = row.transpose();
            if self.is_open(&g) {
                return None;
            }
            halves.push(self.linear.half_solve(&g));
        }
        let count = halves.len();
        Some(DMatrix::from_fn(count, count, |i, j| halves[i].dot(&halves[j])))
    }

    /// [`covariance_of`](Self::covariance_of) for combinations of the shared parameters and of one group's own, without
    /// the zeros of all other groups.
    ///
    /// # Panics
    ///
    /// If there is no such group, or the numbers of columns differ from its parameters.
    pub fn covariance_within(
        &self,
        group: usize,
        shared: &DMatrix<f64>,
        own: &DMatrix<f64>,
    ) -> Option<DMatrix<f64>> {
        assert_eq!(
            shared.ncols(),
            self.linear.shared_width(),
            "one column for each shared parameter"
        );
        assert_eq!(
            Some(own.ncols()),
            self.linear.own_widths().nth(group),
            "one column for each own parameter"
        );
        if self.rank() < self.dimension() && self.opens(group, shared, own) {
            return None;
        }
        let (shared, own) = (shared.transpose(), own.transpose());
        let halves: Vec<_> = shared
            .column_iter()
            .zip(own.column_iter())
            .map(|(s, o)| self.linear.half_solve_within(group, s.as_slice(), o.as_slice()))
            .collect();
        let count = halves.len();
        Some(DMatrix::from_fn(count, count, |i, j| halves[i].dot(&halves[j])))
    }

    /// Whether one of the combinations is open.
    fn opens(&self, group: usize, shared: &DMatrix<f64>, own: &DMatrix<f64>) -> bool {
        let from = shared.ncols() + self.linear.own_widths().take(group).sum::<usize>();
        let mut all = DVector::zeros(self.dimension());
        (0..own.nrows()).any(|row| {
            all.rows_mut(0, shared.ncols()).tr_copy_from(&shared.row(row));
            all.rows_mut(from, own.ncols()).tr_copy_from(&own.row(row));
            self.is_open(&all)
        })
    }

    /// The most probable change of all parameters that changes g·x by one standard deviation: (JᵀJ)⁻¹g/√(gᵀ(JᵀJ)⁻¹g).
    ///
    /// ‖J·step‖ = 1. `None` if g·x is open, or g is zero.
    ///
    /// # Panics
    ///
    /// If g has another dimension.
    pub fn step_along(&self, g: &DVector<f64>) -> Option<DVector<f64>> {
        let half = self.linear.half_solve(g);
        let sd = half.norm();
        (sd > 0.0 && !self.is_open(g)).then(|| self.linear.other_half(&half) / sd)
    }

    /// Covariance of some parameters; `None` if one of them is open.
    ///
    /// # Panics
    ///
    /// If there is no such parameter.
    pub fn covariance_among(&self, parameters: &[usize]) -> Option<DMatrix<f64>> {
        let mut combinations = DMatrix::zeros(parameters.len(), self.dimension());
        for (row, parameter) in parameters.iter().enumerate() {
            combinations[(row, *parameter)] = 1.0;
        }
        self.covariance_of(&combinations)
    }

    /// Covariance (JᵀJ)⁻¹ of all parameters; `None` if one of them is open.
    pub fn covariance(&self) -> Option<DMatrix<f64>> {
        self.covariance_among(&(0..self.dimension()).collect::<Vec<_>>())
    }

    /// Standard deviation of each parameter; `None` for the open ones.
    pub fn standard_deviations(&self) -> Vec<Option<f64>> {
        (0..self.dimension())
            .map(|i| Some(self.covariance_among(&[i])?[(0, 0)].sqrt()))
            .collect()
    }
}

/// An orthonormal basis of independent vectors (Gram–Schmidt, twice), the largest component of each positive.
fn orthonormal(vectors: &[DVector<f64>], dimension: usize) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::with_capacity(vectors.len());
    for vector in vectors {
        let mut v = vector.normalize();
        for _ in 0..2 {
            for earlier in &basis {
                let along = earlier.dot(&v);
                v.axpy(-along, earlier, 1.0);
            }
            v.normalize_mut();
        }
        if v[v.iamax()] < 0.0 {
            v.neg_mut();
        }
        basis.push(v);
    }
    let mut matrix = DMatrix::zeros(dimension, basis.len());
    for (column, vector) in basis.iter().enumerate() {
        matrix.set_column(column, vector);
    }
    matrix
}
