//! The linear problem min ‖J·p − b‖ of an arrow-shaped J: each group's own columns are eliminated by QR, then the rest.
//!
//! ```text
//! Q_gᵀ (B_g A_g b_g) = ( R_g T_g t_g )      R_g·y_g = t_g − T_g·x
//!                      (  0  A'_g b'_g )     all A'_g together: R·x = t   (the Schur complement, as a QR)
//! ```
//!
//! Columns are first brought to length 1, so one threshold tells dependence in any units. A damped problem, with rows
//! √μ·D below, starts from the triangles and not from J: its cost does not depend on the number of residuals.

use super::qr::{PivotedQr, dot};
use nalgebra::{DMatrix, DVector};

/// Rows of one group: own columns, shared columns, right side.
#[derive(Debug, Clone)]
pub(super) struct Rows {
    pub(super) own: DMatrix<f64>,
    pub(super) shared: DMatrix<f64>,
    pub(super) right: DVector<f64>,
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
    /// Eliminates; columns shorter than `threshold`, in parts of their whole length, count as dependent.
    pub(super) fn new(mut rows: Vec<Rows>, shared_width: usize, threshold: f64) -> Self {
        let scale = column_lengths(&rows, shared_width).map(|s| if s > 0.0 { s } else { 1.0 });
        let mut from = shared_width;
        for group in &mut rows {
            divide(&mut group.shared, &scale.as_slice()[..shared_width]);
            let to = from + group.own.ncols();
            divide(&mut group.own, &scale.as_slice()[from..to]);
            from = to;
        }
        Self::scaled(rows, &[], scale, shared_width, threshold)
    }

    /// The problem with rows √μ·D of right side 0 added.
    pub(super) fn damped(&self, mu: f64, d: &DVector<f64>) -> Self {
        let damping = d.component_div(&self.scale) * mu.sqrt();
        let width = self.shared.width();
        let mut from = width;
        let rows = self
            .groups
            .iter()
            .map(|group| {
                let (count, rank) = (group.own.width(), group.own.rank);
                let mut own = group.own.rows_in_order().resize_vertically(rank + count, 0.0);
                for i in 0..count {
                    own[(rank + i, i)] = damping[from + i];
                }
                from += count;
                Rows {
                    own,
                    shared: group.coupling.clone().resize_vertically(rank + count, 0.0),
                    right: group.right.clone().resize_vertically(rank + count, 0.0),
                }
            })
            .collect();
        let rank = self.shared.rank;
        let mut below = self.shared.rows_in_order().resize_vertically(rank + width, 0.0);
        for i in 0..width {
            below[(rank + i, i)] = damping[i];
        }
        let right = self.shared_right.clone().resize_vertically(rank + width, 0.0);
        Self::scaled(rows, &[(below, right)], self.scale.clone(), width, 0.0)
    }

    fn scaled(
        rows: Vec<Rows>,
        more: &[(DMatrix<f64>, DVector<f64>)],
        scale: DVector<f64>,
        shared_width: usize,
        threshold: f64,
    ) -> Self {
        let mut groups = Vec::with_capacity(rows.len());
        let mut rest = Vec::with_capacity(rows.len() + more.len());
        for group in rows {
            let (height, columns) = (group.own.nrows(), group.own.ncols());
            let mut carried = group.shared.resize_horizontally(shared_width + 1, 0.0);
            carried.set_column(shared_width, &group.right);
            let (own, carried) = Triangle::of(group.own, carried, threshold);
            debug_assert_eq!(own.width(), columns);
            let (rank, left) = (own.rank, height - own.rank);
            groups.push(Eliminated {
                coupling: carried.view((0, 0), (rank, shared_width)).into_owned(),
                right: carried.view((0, shared_width), (rank, 1)).column(0).into_owned(),
                own,
            });
            rest.push(carried.rows(rank, left).into_owned());
        }
        for (matrix, right) in more {
            let mut both = matrix.clone().resize_horizontally(shared_width + 1, 0.0);
            both.set_column(shared_width, right);
            rest.push(both);
        }
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

    /// p of the least ‖J·p − b‖, with 0 for dependent columns.
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
            let part = group.own.solve_transposed(&g.rows(from, width).into_owned());
            rest -= group.coupling.transpose() * &part;
            z.extend_from_slice(part.as_slice());
            from += width;
        }
        z.extend_from_slice(self.shared.solve_transposed(&rest).as_slice());
        DVector::from_vec(z)
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

    /// R with its columns in the order of the matrix.
    fn rows_in_order(&self) -> DMatrix<f64> {
        let mut rows = DMatrix::zeros(self.rank, self.width());
        for (place, column) in self.order.iter().enumerate() {
            rows.set_column(*column, &self.r.column(place));
        }
        rows
    }

    /// The columns of the square part of R, which are those of as many independent parameters.
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

    fn solve_transposed(&self, g: &DVector<f64>) -> DVector<f64> {
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

fn divide(matrix: &mut DMatrix<f64>, lengths: &[f64]) {
    for (mut column, length) in matrix.column_iter_mut().zip(lengths) {
        column /= *length;
    }
}
