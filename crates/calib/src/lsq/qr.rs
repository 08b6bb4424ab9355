//! QR with column pivoting: A·P = Q·R, the diagonal of R decreasing in size (Businger, Golub 1965).
//!
//! At each step the column with the longest remaining part comes next, so a small diagonal element shows that all later
//! columns depend on the earlier ones. (nalgebra's `ColPivQR` pivots by the largest element instead, which does not
//! reveal the rank.) Lengths are updated, and recomputed where cancellation would spoil them (Drmač, Bujanović 2008).

use fearless_simd::{Level, dispatch};
use nalgebra::DMatrix;

/// Relative loss of a column's length at which the length is recomputed: √ε.
const CANCELLATION: f64 = 1.5e-8;

/// The factors of a matrix, with Q applied to the carried columns.
#[derive(Debug, Clone, PartialEq)]
pub struct PivotedQr {
    /// R, min(m, n) × n, upper triangular; its columns are those of A in `order`.
    pub r: DMatrix<f64>,
    /// Column of A that became each column of R.
    pub order: Vec<usize>,
    /// Qᵀ times the carried columns, m × c.
    pub carried: DMatrix<f64>,
}

impl PivotedQr {
    /// Factors a matrix (m × n) by Householder reflections and applies them to `carried` (m × c) too.
    ///
    /// ```
    /// use catoptric_calib::lsq::PivotedQr;
    /// use nalgebra::DMatrix;
    /// // The third column is the sum of the first two.
    /// let a = DMatrix::from_row_slice(4, 3, &[1.0, 2.0, 3.0, 0.0, 1.0, 1.0, 1.0, 0.0, 1.0, 2.0, 1.0, 3.0]);
    /// let qr = PivotedQr::new(a, DMatrix::zeros(4, 0));
    /// assert_eq!(qr.order[0], 2);
    /// assert_eq!(qr.rank(1e-12), 2);
    /// ```
    ///
    /// # Panics
    ///
    /// If the numbers of rows differ.
    pub fn new(a: DMatrix<f64>, carried: DMatrix<f64>) -> Self {
        assert_eq!(
            a.nrows(),
            carried.nrows(),
            "carried columns need the rows of the matrix"
        );
        // With the widest lanes of the machine, which do not change the result: the order of all sums stays the same.
        dispatch!(Level::new(), _simd => Self::factor(a, carried))
    }

    #[inline(always)]
    fn factor(mut a: DMatrix<f64>, mut carried: DMatrix<f64>) -> Self {
        let (rows, columns) = a.shape();
        let steps = rows.min(columns);
        let mut order: Vec<usize> = (0..columns).collect();
        let mut lengths: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
        let mut measured = lengths.clone();
        for step in 0..steps {
            let pivot = longest(&lengths, step);
            a.swap_columns(step, pivot);
            order.swap(step, pivot);
            lengths.swap(step, pivot);
            measured.swap(step, pivot);
            let (done, later) = a.as_mut_slice().split_at_mut((step + 1) * rows);
            let column = &mut done[step * rows + step..];
            let Some(reflection) = reflect(column) else {
                continue;
            };
            for (j, other) in later.chunks_exact_mut(rows).enumerate() {
                reflection.apply(column, &mut other[step..]);
                let index = step + 1 + j;
                if lengths[index] > 0.0 {
                    let left = (1.0 - (other[step] / lengths[index]).powi(2)).max(0.0);
                    if left * (lengths[index] / measured[index]).powi(2) <= CANCELLATION {
                        lengths[index] = norm(&other[step + 1..]);
                        measured[index] = lengths[index];
                    } else {
                        lengths[index] *= left.sqrt();
                    }
                }
            }
            for other in carried.as_mut_slice().chunks_exact_mut(rows) {
                reflection.apply(column, &mut other[step..]);
            }
            column[0] = reflection.diagonal;
            column[1..].fill(0.0);
        }
        Self {
            r: a.rows(0, steps).upper_triangle(),
            order,
            carried,
        }
    }

    /// Number of leading diagonal elements of R larger than a threshold, in the units of the columns.
    pub fn rank(&self, threshold: f64) -> usize {
        let steps = self.r.nrows();
        (0..steps)
            .find(|&i| self.r[(i, i)].abs() <= threshold)
            .unwrap_or(steps)
    }
}

/// I − v·vᵀ/γ, with v stored in place of the column.
struct Reflection {
    gamma: f64,
    diagonal: f64,
}

/// Turns a column into the vector of the reflection that zeroes it below its first element.
#[inline(always)]
fn reflect(column: &mut [f64]) -> Option<Reflection> {
    let length = norm(column);
    if length == 0.0 {
        return None;
    }
    let diagonal = if column[0] > 0.0 { -length } else { length };
    column[0] -= diagonal;
    Some(Reflection {
        gamma: -column[0] * diagonal,
        diagonal,
    })
}

impl Reflection {
    #[inline(always)]
    fn apply(&self, v: &[f64], other: &mut [f64]) {
        let factor = dot(v, other) / self.gamma;
        for (o, v) in other.iter_mut().zip(v) {
            *o -= factor * v;
        }
    }
}

/// Number of partial sums of a product, accumulated in parallel: a single sum would have to wait for each addition.
const SUMS: usize = 8;

/// a·b.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<SUMS>(), b.as_chunks::<SUMS>());
    let mut sums = [0.0; SUMS];
    for (a, b) in a.iter().zip(b) {
        for (sum, (a, b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    sums.iter().sum::<f64>() + rest
}

#[inline(always)]
fn longest(lengths: &[f64], from: usize) -> usize {
    let mut best = from;
    for (index, length) in lengths.iter().enumerate().skip(from) {
        if *length > lengths[best] {
            best = index;
        }
    }
    best
}

/// Range of the largest element of a vector within which squares neither overflow nor lose significant parts of the
/// sum.
const SQUARED_SAFELY: std::ops::RangeInclusive<f64> = 1e-100..=1e100;

/// Length of a vector, without overflow or loss of small elements.
#[inline(always)]
fn norm(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    if largest == 0.0 || !largest.is_finite() {
        return largest;
    }
    if SQUARED_SAFELY.contains(&largest) {
        return dot(values, values).sqrt();
    }
    largest * values.iter().map(|v| (v / largest).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers without a pattern, the same on every machine.
    fn sample(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            libm::sin(12.9898 * i as f64 + 78.233 * j as f64 + 0.37 * (i * j) as f64)
        })
    }

    #[test]
    fn the_factors_reproduce_the_matrix() {
        for (rows, columns) in [(7, 4), (4, 7), (5, 5), (9, 1)] {
            let a = sample(rows, columns);
            let qr = PivotedQr::new(a.clone(), DMatrix::identity(rows, rows));
            let q = qr.carried.transpose();
            let mut full = DMatrix::zeros(rows, columns);
            full.rows_mut(0, qr.r.nrows()).copy_from(&qr.r);
            let product = &q * full;
            for (place, column) in qr.order.iter().enumerate() {
                assert!((product.column(place) - a.column(*column)).norm() < 1e-14 * a.norm());
            }
            assert!((q.transpose() * &q - DMatrix::identity(rows, rows)).norm() < 1e-14);
            let diagonal: Vec<f64> = (0..qr.r.nrows()).map(|i| qr.r[(i, i)].abs()).collect();
            assert!(diagonal.is_sorted_by(|a, b| a * (1.0 + 1e-12) >= *b));
        }
    }

    #[test]
    fn dependent_columns_are_counted_once() {
        let a = sample(12, 3) * sample(3, 6);
        assert_eq!(
            PivotedQr::new(a.clone(), DMatrix::zeros(12, 0)).rank(1e-12 * a.norm()),
            3
        );
        assert_eq!(
            PivotedQr::new(DMatrix::zeros(4, 3), DMatrix::zeros(4, 1)).rank(0.0),
            0
        );
        assert_eq!(
            PivotedQr::new(DMatrix::zeros(0, 3), DMatrix::zeros(0, 1)).rank(0.0),
            0
        );
    }
}
