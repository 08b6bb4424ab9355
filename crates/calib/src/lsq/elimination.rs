//! The linear problem min ‖J·p − b‖ for an arrow-shaped J: each group's own columns are eliminated by QR, then the
//! rest.
//!
//! ```text
//! Q_gᵀ (B_g A_g b_g) = ( R_g T_g t_g )      R_g·y_g = t_g − T_g·x
//!                      (  0  A'_g b'_g )     all A'_g together: R·x = t   (the Schur complement, as a QR)
//! ```
//!
//! Columns are first normalized to length 1, so that one threshold detects dependence in any units. A damped problem,
//! with rows √μ·D below, starts from the triangles and not from J: its cost does not depend on the number of residuals.

use super::problem::{GroupJacobian, ProblemError};
use super::qr::{PivotedQr, dot};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Rows of one group: own columns, shared columns, right side.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    pub(super) own: DMatrix<f64>,
    pub(super) shared: DMatrix<f64>,
    pub(super) right: DVector<f64>,
}

impl Rows {
    /// Rows of residuals f and their derivatives, which must have one column per shared and own parameter.
    pub(super) fn of_group(
        group: usize,
        f: &DVector<f64>,
        jacobian: Option<GroupJacobian>,
        [shared, own]: [usize; 2],
    ) -> Result<Self, ProblemError> {
        let part = jacobian
            .filter(|j| is_finite(&j.shared) && is_finite(&j.own))
            .ok_or(ProblemError::Undefined {
                group,
                place: "point reached",
            })?;
        for (parameters, matrix, columns) in [("shared", &part.shared, shared), ("own", &part.own, own)] {
            if matrix.shape() != (f.len(), columns) {
                return Err(ProblemError::Shape {
                    group,
                    parameters,
                    rows: f.len(),
                    columns,
                    found_rows: matrix.nrows(),
                    found_columns: matrix.ncols(),
                });
            }
        }
        Ok(Self {
            own: part.own,
            shared: part.shared,
            right: -f,
        })
    }
}

fn is_finite(matrix: &DMatrix<f64>) -> bool {
    matrix.iter().all(|v| v.is_finite())
}

/// The eliminated problem. Coordinates: shared, then each group's own.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Elimination {
    /// Length of each column of J, 1 for a column of zeros.
    scale: DVector<f64>,
    shared: Triangle,
    shared_right: DVector<f64>,
    groups: Vec<Eliminated>,
}

#[derive(Debug, Clone, PartialEq)]
struct Eliminated {
    own: Triangle,
    coupling: DMatrix<f64>,
    right: DVector<f64>,
}

/// The first `rank` rows of a pivoted R.
#[derive(Debug, Clone, PartialEq)]
struct Triangle {
    r: DMatrix<f64>,
    order: Vec<usize>,
    rank: usize,
}

impl Elimination {
    /// Eliminates; a column counts as dependent if the others leave less than `threshold` of its length.
    pub(super) fn new(mut rows: Vec<Rows>, shared_width: usize, threshold: f64) -> Self {
        let scale = column_lengths(&rows, shared_width).map(|s| if s > 0.0 { s } else { 1.0 });
        let shorten: Vec<f64> = scale.iter().map(|s| 1.0 / s).collect();
        let mut from = shared_width;
        for group in &mut rows {
            let to = from + group.own.ncols();
            scale_columns(&mut group.shared, &shorten[..shared_width]);
            scale_columns(&mut group.own, &shorten[from..to]);
            from = to;
        }
        Self::scaled(rows, scale, shared_width, threshold)
    }

    /// The problem with rows √μ·D added, whose right side is 0.
    pub(super) fn damped(&self, mu: f64, d: &DVector<f64>) -> Self {
        let same = DVector::from_element(d.len(), 1.0);
        let rows = self.triangles(&same, &(d.component_div(&self.scale) * mu.sqrt()));
        Self::scaled(rows, self.scale.clone(), self.shared.width(), 0.0)
    }

    /// The problem with its columns multiplied by factors, and with a row of right side 0 for each nonzero weight.
    pub(super) fn changed(&self, factors: &DVector<f64>, weights: &DVector<f64>, threshold: f64) -> Self {
        let rows = self.triangles(factors, &weights.component_div(&self.scale));
        let mut changed = Self::new(rows, self.shared.width(), threshold);
        changed.scale.component_mul_assign(&self.scale);
        changed
    }

    /// The triangles as rows of a problem in scaled parameters, with factors and weights as in
    /// [`changed`](Self::changed). Those of the shared parameters come last, as a group without own parameters.
    fn triangles(&self, factors: &DVector<f64>, weights: &DVector<f64>) -> Vec<Rows> {
        let width = self.shared.width();
        let (factors, weights) = (factors.as_slice(), weights.as_slice());
        let mut from = width;
        let mut all = Vec::with_capacity(self.groups.len() + 1);
        for group in &self.groups {
            let to = from + group.own.width();
            let own = group.own.rows_in_order(&factors[from..to], &weights[from..to]);
            let mut coupling = group.coupling.clone();
            scale_columns(&mut coupling, &factors[..width]);
            all.push(Rows {
                shared: coupling.resize_vertically(own.nrows(), 0.0),
                right: group.right.clone().resize_vertically(own.nrows(), 0.0),
                own,
            });
            from = to;
        }
        let shared = self.shared.rows_in_order(&factors[..width], &weights[..width]);
        all.push(Rows {
            own: DMatrix::zeros(shared.nrows(), 0),
            right: self.shared_right.clone().resize_vertically(shared.nrows(), 0.0),
            shared,
        });
        all
    }

    fn scaled(rows: Vec<Rows>, scale: DVector<f64>, shared_width: usize, threshold: f64) -> Self {
        let eliminate = |group: Rows| Eliminated::of(group, shared_width, threshold);
        let (groups, rest): (Vec<_>, Vec<_>) = if rows.len() < 2 {
            rows.into_iter().map(eliminate).unzip()
        } else {
            rows.into_par_iter().with_max_len(1).map(eliminate).unzip()
        };
        let height = rest.iter().map(DMatrix::nrows).sum();
        let mut all = DMatrix::zeros(height, shared_width + 1);
        let mut row = 0;
        for part in &rest {
            all.rows_mut(row, part.nrows()).copy_from(part);
            row += part.nrows();
        }
        let right = all.columns(shared_width, 1).into_owned();
        let (shared, carried) = Triangle::of(all.columns(0, shared_width).into_owned(), right, threshold);
        let shared_right = carried.column(0).rows(0, shared.rank).into_owned();
        Self {
            scale,
            shared,
            shared_right,
            groups,
        }
    }

    pub(super) fn dimension(&self) -> usize {
        self.scale.len()
    }

    pub(super) fn rank(&self) -> usize {
        self.shared.rank + self.groups.iter().map(|g| g.own.rank).sum::<usize>()
    }

    /// Length of each column of J, 1 for a column of zeros.
    pub(super) fn scale(&self) -> &DVector<f64> {
        &self.scale
    }

    /// ln det(JᵀJ) over the independent columns.
    pub(super) fn log_determinant(&self) -> f64 {
        let triangles = self.groups.iter().map(|g| &g.own).chain([&self.shared]);
        let diagonal: f64 = triangles
            .map(|t| (0..t.rank).map(|i| libm::log(t.r[(i, i)].abs())).sum::<f64>())
            .sum();
        let scale: f64 = self.scale.iter().map(|s| libm::log(*s)).sum();
        2.0 * (diagonal + scale)
    }

    /// p that minimizes ‖J·p − b‖, with 0 for dependent columns.
    pub(super) fn solve(&self) -> DVector<f64> {
        let x = self.shared.solve(&self.shared_right);
        self.complete(&x, |group, x| &group.right - &group.coupling * x)
            .component_div(&self.scale)
    }

    /// z with ‖z‖² = gᵀ(JᵀJ)⁻¹g, and zᵢ·zⱼ = gᵢᵀ(JᵀJ)⁻¹gⱼ: Rᵀz = g, over the independent columns.
    pub(super) fn half_solve(&self, g: &DVector<f64>) -> DVector<f64> {
        let g = g.component_div(&self.scale);
        let mut rest = g.rows(0, self.shared.width()).into_owned();
        let mut z = Vec::with_capacity(self.dimension());
        let mut from = self.shared.width();
        for group in &self.groups {
            let width = group.own.width();
            let of_group = &g.as_slice()[from..from + width];
            if of_group.iter().all(|v| *v == 0.0) {
                z.resize(z.len() + group.own.rank, 0.0);
            } else {
                let part = group.own.solve_transposed(of_group);
                rest -= group.coupling.tr_mul(&part);
                z.extend_from_slice(part.as_slice());
            }
            from += width;
        }
        z.extend_from_slice(self.shared.solve_transposed(rest.as_slice()).as_slice());
        DVector::from_vec(z)
    }

    /// The part of z of [`half_solve`](Self::half_solve) that is nonzero for a g of shared and one group's own
    /// parameters: that of the group, then that of the shared parameters.
    pub(super) fn half_solve_within(&self, group: usize, shared: &[f64], own: &[f64]) -> DVector<f64> {
        let width = self.shared.width();
        let from = width + self.own_widths().take(group).sum::<usize>();
        let scaled = |g: &[f64], from: usize| {
            let lengths = &self.scale.as_slice()[from..];
            DVector::from_iterator(g.len(), g.iter().zip(lengths).map(|(g, s)| g / s))
        };
        let group = &self.groups[group];
        let part = group.own.solve_transposed(scaled(own, from).as_slice());
        let rest = scaled(shared, 0) - group.coupling.tr_mul(&part);
        let mut z = part.as_slice().to_vec();
        z.extend_from_slice(self.shared.solve_transposed(rest.as_slice()).as_slice());
        DVector::from_vec(z)
    }

    /// Number of own parameters of each group.
    pub(super) fn own_widths(&self) -> impl Iterator<Item = usize> + '_ {
        self.groups.iter().map(|g| g.own.width())
    }

    /// Number of shared parameters.
    pub(super) fn shared_width(&self) -> usize {
        self.shared.width()
    }

    /// (JᵀJ)⁻¹g from z of [`half_solve`](Self::half_solve), with 0 for dependent columns.
    pub(super) fn other_half(&self, z: &DVector<f64>) -> DVector<f64> {
        let mut from = 0;
        let own: Vec<DVector<f64>> = self
            .groups
            .iter()
            .map(|group| {
                let part = z.rows(from, group.own.rank).into_owned();
                from += group.own.rank;
                part
            })
            .collect();
        let x = self.shared.solve(&z.rows(from, self.shared.rank).into_owned());
        let mut all = x.as_slice().to_vec();
        for (group, part) in self.groups.iter().zip(own) {
            all.extend_from_slice(group.own.solve(&(part - &group.coupling * &x)).as_slice());
        }
        DVector::from_vec(all).component_div(&self.scale)
    }

    /// ‖J·p‖.
    pub(super) fn image_norm(&self, p: &DVector<f64>) -> f64 {
        let p = p.component_mul(&self.scale);
        let x = p.rows(0, self.shared.width()).into_owned();
        let mut sum = self.shared.image(&x).norm_squared();
        let mut from = self.shared.width();
        for group in &self.groups {
            let y = p.rows(from, group.own.width()).into_owned();
            sum += (group.own.image(&y) + &group.coupling * &x).norm_squared();
            from += group.own.width();
        }
        sum.sqrt()
    }

    /// Vectors that span the null space of J with its columns at length 1; not orthogonal.
    pub(super) fn null_vectors(&self) -> Vec<DVector<f64>> {
        let width = self.shared.width();
        let mut all: Vec<_> = self
            .shared
            .null_vectors()
            .iter()
            .map(|x| self.complete(x, |group, x| -(&group.coupling * x)))
            .collect();
        let mut from = width;
        for group in &self.groups {
            for y in group.own.null_vectors() {
                let mut vector = DVector::zeros(self.dimension());
                vector.rows_mut(from, y.len()).copy_from(&y);
                all.push(vector);
            }
            from += group.own.width();
        }
        all
    }

    /// x with each group's own part solved for a right side.
    fn complete(
        &self,
        x: &DVector<f64>,
        right: impl Fn(&Eliminated, &DVector<f64>) -> DVector<f64>,
    ) -> DVector<f64> {
        let mut all = x.as_slice().to_vec();
        for group in &self.groups {
            all.extend_from_slice(group.own.solve(&right(group, x)).as_slice());
        }
        DVector::from_vec(all)
    }
}

impl Eliminated {
    /// The group without its own parameters, and its remaining rows: shared columns, right side.
    fn of(group: Rows, shared_width: usize, threshold: f64) -> (Self, DMatrix<f64>) {
        let height = group.own.nrows();
        let mut carried = group.shared.resize_horizontally(shared_width + 1, 0.0);
        carried.set_column(shared_width, &group.right);
        let (own, carried) = Triangle::of(group.own, carried, threshold);
        let rank = own.rank;
        let eliminated = Self {
            coupling: carried.view((0, 0), (rank, shared_width)).into_owned(),
            right: carried.view((0, shared_width), (rank, 1)).column(0).into_owned(),
            own,
        };
        (eliminated, carried.rows(rank, height - rank).into_owned())
    }
}

impl Triangle {
    fn of(matrix: DMatrix<f64>, carried: DMatrix<f64>, threshold: f64) -> (Self, DMatrix<f64>) {
        let qr = PivotedQr::new(matrix, carried);
        let rank = qr.rank(threshold);
        let triangle = Self {
            r: qr.r.rows(0, rank).into_owned(),
            order: qr.order,
            rank,
        };
        (triangle, qr.carried)
    }

    fn width(&self) -> usize {
        self.order.len()
    }

    /// R with its columns in the order of the matrix, multiplied by factors, followed by a row for each nonzero weight.
    fn rows_in_order(&self, factors: &[f64], weights: &[f64]) -> DMatrix<f64> {
        let weighted = weights.iter().enumerate().filter(|(_, w)| **w != 0.0);
        let mut rows = DMatrix::zeros(self.rank + weighted.clone().count(), self.width());
        for (place, column) in self.order.iter().enumerate() {
            let part = self.r.column(place) * factors[*column];
            rows.view_mut((0, *column), (self.rank, 1)).copy_from(&part);
        }
        for (i, (column, weight)) in weighted.enumerate() {
            rows[(self.rank + i, column)] = *weight;
        }
        rows
    }

    /// The columns of the square part of R, one per independent parameter.
    fn columns(&self) -> impl DoubleEndedIterator<Item = &[f64]> + ExactSizeIterator {
        // A rank of 0 has no columns, yet chunks must not be empty.
        self.r.as_slice().chunks_exact(self.rank.max(1)).take(self.rank)
    }

    fn back_substitute(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut x = right.clone();
        let x_of = x.as_mut_slice();
        for (i, column) in self.columns().enumerate().rev() {
            x_of[i] /= column[i];
            let known = x_of[i];
            for (x, r) in x_of[..i].iter_mut().zip(column) {
                *x -= known * r;
            }
        }
        x
    }

    fn solve(&self, right: &DVector<f64>) -> DVector<f64> {
        let mut x = DVector::zeros(self.width());
        for (value, column) in self.back_substitute(right).iter().zip(&self.order) {
            x[*column] = *value;
        }
        x
    }

    fn solve_transposed(&self, g: &[f64]) -> DVector<f64> {
        let mut z = DVector::zeros(self.rank);
        let z_of = z.as_mut_slice();
        for (i, column) in self.columns().enumerate() {
            z_of[i] = (g[self.order[i]] - dot(&column[..i], &z_of[..i])) / column[i];
        }
        z
    }

    fn image(&self, x: &DVector<f64>) -> DVector<f64> {
        let placed = DVector::from_iterator(self.width(), self.order.iter().map(|column| x[*column]));
        &self.r * placed
    }

    fn null_vectors(&self) -> Vec<DVector<f64>> {
        (self.rank..self.width())
            .map(|place| {
                let mut vector = self.solve(&-self.r.column(place));
                vector[self.order[place]] = 1.0;
                vector
            })
            .collect()
    }
}

fn column_lengths(rows: &[Rows], shared_width: usize) -> DVector<f64> {
    let shared = (0..shared_width).map(|column| {
        let squares: f64 = rows.iter().map(|g| g.shared.column(column).norm_squared()).sum();
        squares.sqrt()
    });
    let own = rows
        .iter()
        .flat_map(|g| g.own.column_iter().map(|c| c.norm()).collect::<Vec<_>>());
    DVector::from_vec(shared.chain(own).collect())
}

fn scale_columns(matrix: &mut DMatrix<f64>, factors: &[f64]) {
    for (mut column, factor) in matrix.column_iter_mut().zip(factors) {
        column *= *factor;
    }
}
