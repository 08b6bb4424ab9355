//! One element linearized at a point: its predicted readings, its deviation from its facet, and their derivatives.

use super::fan::Fan;
use super::group::{BOARD_ERRORS, FACET_PARAMETERS, FIGURE_ORDERS, Group, JointElement};
use super::placed::{Boards, Placed};
use super::problem::Joint;
use crate::lsq::{GroupJacobian, Point};
use crate::readings::jacobian;
use catoptric_model::glass::{GlassEffect, GlassSheet};
use catoptric_model::{BoardPlane, frame};
use nalgebra::{DVector, Dyn, Matrix2, OMatrix, Point3, U2, Unit, Vector2, Vector3};

/// Maximum number of iterations for a beam's own deviation, and the change that ends them, in radians.
const DEVIATION_ROUNDS: usize = 8;
const SETTLED: f64 = 1e-14;

/// An element linearized: prediction errors, and derivatives of the predicted range.
pub(super) struct Linear {
    /// z − r̂ + Hδ over the sights, each divided by its standard deviation.
    pub(super) y: DVector<f64>,
    /// Derivatives along the two axes of the deviation, divided by the standard deviations.
    pub(super) h: OMatrix<f64, Dyn, U2>,
    /// The deviation that fits best.
    pub(super) delta: Vector2<f64>,
    /// The two axes.
    pub(super) axes: [Vector3<f64>; 2],
    /// Exit direction.
    pub(super) v: Unit<Vector3<f64>>,
    /// The facet's deflection of the beam.
    pub(super) fan: Fan,
    /// What glass does to the range, in meters, and its relative change per change of the cosine of the deflection.
    glass: GlassEffect,
    glass_change: f64,
    sightlines: Vec<Sightline>,
}

/// One board where the beam meets it.
#[derive(Clone, Copy, Default)]
struct Sightline {
    /// Range without biases.
    range: f64,
    /// Distance from the mirror to the board, and the signed cosine of incidence.
    s: f64,
    closing: f64,
    /// Derivatives of the biased range with respect to the range and to that cosine; a deviation does not change them.
    by_range: f64,
    by_closing: f64,
    /// Error per standard deviation of each common error.
    common: [(usize, f64); 4],
}

/// (I + τ²HHᵀ)^(−½), the weight of the rows of an element that deviates from its facet.
pub(super) struct Weight<'l> {
    h: &'l OMatrix<f64, Dyn, U2>,
    inner: Matrix2<f64>,
    /// ln det(I + τ²HᵀH).
    pub(super) log_determinant: f64,
}

impl Linear {
    /// Range to each board without biases, and the signed cosine of incidence there.
    pub(super) fn met(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.sightlines.iter().map(|line| (line.range, line.closing))
    }

    /// Change of each biased range per tilt of the mirror's normal about one of its two axes.
    pub(super) fn by_tilt(&self, axis: usize, planes: &[BoardPlane]) -> impl Iterator<Item = f64> {
        let turned = self.fan.turned[axis];
        let lines = self.sightlines.iter().zip(planes);
        lines.map(move |(line, plane)| line.lever() * plane.normal.dot(&turned))
    }

    /// Change of the range to a plane per thickness of a glass.
    pub(super) fn through_glass(
        &self,
        u: &Unit<Vector3<f64>>,
        plane: &BoardPlane,
        glass: &GlassSheet,
    ) -> f64 {
        glass.effect(u, &self.fan.v).on_plane(u, &self.v, &plane.normal)
    }

    /// Prediction errors that remain after the deviation, divided by the standard deviations.
    pub(super) fn rest(&self) -> DVector<f64> {
        &self.y - &self.h * self.delta
    }

    /// The weight for deviations of 1σ τ; `None` if there are none.
    pub(super) fn weight(&self, tau: f64) -> Option<Weight<'_>> {
        (tau > 0.0).then(|| {
            let squares = self.h.tr_mul(&self.h) * (tau * tau);
            let eigen = squares.symmetric_eigen();
            // (1/√(1 + x) − 1)/x without cancellation.
            let gain = eigen.eigenvalues.map(|x| {
                let root = (1.0 + x.max(0.0)).sqrt();
                -1.0 / (root * (1.0 + root))
            });
            let gain = Matrix2::from_diagonal(&gain);
            Weight {
                h: &self.h,
                inner: eigen.eigenvectors * gain * eigen.eigenvectors.transpose() * (tau * tau),
                log_determinant: libm::log((Matrix2::identity() + squares).determinant()),
            }
        })
    }
}

impl Weight<'_> {
    /// Applies the weight to one column of the element's rows.
    pub(super) fn apply(&self, column: &mut [f64]) {
        let (across, up) = self.h.as_slice().split_at(column.len());
        let product = |axis: &[f64]| -> f64 { axis.iter().zip(&*column).map(|(h, m)| h * m).sum() };
        let part = self.inner * Vector2::new(product(across), product(up));
        for ((m, a), u) in column.iter_mut().zip(across).zip(up) {
            *m += a * part.x + u * part.y;
        }
    }
}

impl Joint<'_> {
    /// What glass, as thick as w says, does to the range of an element.
    fn glass_effect(&self, element: &JointElement, fan: &Fan, w: &DVector<f64>) -> GlassEffect {
        let (Some(glass), Some(_)) = (self.glass, element.facet) else {
            return GlassEffect::default();
        };
        let more = self
            .glass_column()
            .map_or(0.0, |column| w[column] * glass.thickness_sd_mm);
        let thickness_mm = glass.thickness_mm + more;
        GlassSheet {
            thickness_mm,
            ..*glass
        }
        .stated(&element.u, &fan.v)
    }

    /// An element linearized at a point; `None` if it meets none of its boards.
    pub(super) fn element(
        &self,
        element: &JointElement,
        shared: &Point,
        own: &Point,
        boards: &Boards,
    ) -> Option<Linear> {
        let w = &shared.numbers(0)?.as_slice()[self.first_common..];
        let fan = match element.facet {
            Some(facet) => Fan::of(element, &Self::shape(own, facet)?, &self.flatness)?,
            None => Fan {
                v: element.u,
                distance: 0.0,
                turned: [Vector3::zeros(); 2],
                moved: [0.0; 3],
                orders: [0.0; FIGURE_ORDERS],
            },
        };
        let glass = self.glass_effect(element, &fan, shared.numbers(0)?);
        let start = fan.distance + glass.setback;
        let origin = Point3::from(element.u.into_inner() * start);
        let (across, up) = frame::tangent_basis(&fan.v);
        let base = [across.into_inner(), up.into_inner()];
        let rows = element.sights.len();
        let tau = self.deviation(element);
        let mut delta = Vector2::<f64>::zeros();
        let mut y = DVector::zeros(rows);
        let mut h = OMatrix::<f64, Dyn, U2>::zeros(rows);
        let (mut v, mut axes) = (fan.v, base);
        let mut sightlines = vec![Sightline::default(); rows];
        for round in 0..DEVIATION_ROUNDS {
            let q: Vector3<f64> = fan.v.into_inner() + base[0] * delta.x + base[1] * delta.y;
            let length = q.norm();
            v = Unit::new_unchecked(q / length);
            axes = base.map(|a| (a - v.into_inner() * v.dot(&a)) / length);
            for (row, (sight, line)) in element.sights.iter().zip(&mut sightlines).enumerate() {
                let Placed {
                    plane, paint, drift, ..
                } = &boards.placed[sight.board];
                line.s = plane.distance_along(&origin, &v)?;
                line.closing = plane.normal.dot(&v);
                let range = start + line.s + glass.delay;
                line.range = range;
                let cos = line.closing.abs().min(1.0);
                if round == 0 {
                    let (by_range, by_cos) = paint.slopes(range, cos);
                    line.by_range = by_range;
                    line.by_closing = by_cos * line.closing.signum();
                }
                line.common = self.common.entries(range, cos, paint.place);
                let common: f64 = line.common.iter().map(|(i, c)| c * w[*i]).sum();
                let predicted = range + paint.bias.terms(range, cos).total() + common + drift;
                let lever = line.lever() / sight.sd;
                for (column, axis) in axes.iter().enumerate() {
                    h[(row, column)] = lever * plane.normal.dot(axis);
                }
                y[row] = (sight.mean - predicted) / sight.sd;
            }
            y += &h * delta;
            if tau == 0.0 {
                break;
            }
            let inner = Matrix2::identity() + h.tr_mul(&h) * (tau * tau);
            let next = inner.try_inverse()? * h.tr_mul(&y) * (tau * tau);
            let change = (next - delta).norm();
            delta = next;
            if change < SETTLED || round + 1 == DEVIATION_ROUNDS {
                break;
            }
        }

        Some(Linear {
            y,
            h,
            delta,
            axes,
            v,
            glass_change: self.glass.map_or(0.0, |sheet| sheet.change(&element.u, &fan.v)),
            glass,
            fan,
            sightlines,
        })
    }

    /// Writes the derivatives of an element's predicted ranges, divided by the standard deviations, into as many rows
    /// of its group's derivatives, which must be 0.
    pub(super) fn differentiate(
        &self,
        group: &Group,
        element: &JointElement,
        boards: &Boards,
        linear: &Linear,
        into: &mut GroupJacobian,
        first_row: usize,
    ) {
        let Linear { fan, v, .. } = linear;
        let origin = Point3::from(element.u.into_inner() * (fan.distance + linear.glass.setback));
        for (i, (sight, line)) in element.sights.iter().zip(&linear.sightlines).enumerate() {
            let row = first_row + i;
            let board = &boards.placed[sight.board];
            let n = board.plane.normal;
            let weight = 1.0 / sight.sd;
            let hit = origin + v.into_inner() * line.s;
            let mut motion = jacobian::of_mount(&hit, &n, v) * line.by_range;
            let turn: Vector3<f64> = -n.cross(v) * line.by_closing;
            for axis in 0..3 {
                motion[3 + axis] += turn[axis];
            }
            for (column, by_w) in boards.motion.column_iter().enumerate() {
                into.shared[(row, column)] = motion.tr_dot(&by_w) * weight;
            }
            for (column, value) in &line.common {
                into.shared[(row, self.first_common + column)] += value * weight;
            }
            if let (Some(column), Some(glass), Some(_)) = (self.glass_column(), self.glass, element.facet) {
                let path = linear.through_glass(&element.u, &board.plane, glass);
                into.shared[(row, column)] = line.by_range * path * glass.thickness_sd_mm * 1e-3 * weight;
            }
            if let Some(facet) = element.facet {
                let first = facet * FACET_PARAMETERS;
                let lever = line.lever();
                let by_distance = line.by_range * (1.0 - n.dot(&element.u) / line.closing);
                // A tilt also changes the path in the glass.
                let in_glass = by_distance * linear.glass.setback + line.by_range * linear.glass.delay;
                for (column, dv) in fan.directions() {
                    let turned = lever * n.dot(&dv) + in_glass * linear.glass_change * element.u.dot(&dv);
                    into.own[(row, first + column)] = turned * weight;
                }
                for (column, moved) in fan.moved.iter().enumerate() {
                    into.own[(row, first + column)] += by_distance * moved * weight;
                }
            }
            let first = group.board_column(sight.board);
            into.own[(row, first)] = self.drift_sd * weight;
            let a = board.fit.coordinates(&hit);
            for column in 0..BOARD_ERRORS - 1 {
                let height = a.dot(&board.errors.column(column));
                into.own[(row, first + 1 + column)] = line.by_range * height / line.closing * weight;
            }
        }
    }
}

impl Sightline {
    /// Total derivative of the biased range with respect to the cosine when the beam turns.
    fn lever(&self) -> f64 {
        self.by_closing - self.by_range * self.s / self.closing
    }
}
