//! Deflection of a beam by a facet: its plane gives the distance, its local normal at the beam gives the direction.

use super::group::{FIGURE, FIGURE_ORDERS, JointElement};
use catoptric_model::{frame, mirror};
use nalgebra::{DVector, Unit, Vector3};

/// Root mean square of a figure over a fan, in units of its 1σ: √(1 + 1/4 + 1/9).
pub(super) const FIGURE_RMS: f64 = 1.166_666_666_666_666_7;

/// How far facets are from flat, 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Flatness {
    /// Variation of a facet's normal about its mean along the fan, about each axis, in radians.
    pub(super) figure: f64,
    /// Deviation of a beam's direction from what its facet gives it, along each axis, in radians.
    pub(super) tau: f64,
}

/// Dependence of an element's direction on its facet: derivatives of v and d with respect to the facet's plane.
pub(super) struct Fan {
    pub(super) v: Unit<Vector3<f64>>,
    pub(super) distance: f64,
    /// ∂v/∂(two tilts), columns.
    pub(super) turned: [Vector3<f64>; 2],
    /// ∂d/∂(two tilts, offset).
    pub(super) moved: [f64; 3],
    /// Weight of each order of the figure in the tilts.
    pub(super) orders: [f64; FIGURE_ORDERS],
}

/// A facet at given parameters.
pub(super) struct Shape<'p> {
    pub(super) normal: Unit<Vector3<f64>>,
    pub(super) offset: f64,
    /// In standard deviations: all orders about one axis, then all about the other.
    pub(super) figure: &'p DVector<f64>,
}

/// Legendre polynomials P₁, P₂, P₃ of unit mean square over the fan, scaled by 1/k with the order k.
pub(super) fn orders(t: f64) -> [f64; FIGURE_ORDERS] {
    [
        3.0_f64.sqrt() * t,
        5.0_f64.sqrt() * (1.5 * t * t - 0.5) / 2.0,
        7.0_f64.sqrt() * (2.5 * t * t - 1.5) * t / 3.0,
    ]
}

impl Fan {
    /// A facet's deflection of a beam; `None` if the facet does not face it.
    ///
    /// The plane gives the distance, its local normal at the beam gives the direction.
    pub(super) fn of(element: &JointElement, shape: &Shape, flatness: &Flatness) -> Option<Self> {
        let u = &element.u;
        let (a, b) = frame::tangent_basis(&shape.normal);
        let orders = orders(element.along).map(|p| p * flatness.figure);
        let tilt = |axis: usize| -> f64 {
            let of_axis = shape.figure.rows(axis * FIGURE_ORDERS, FIGURE_ORDERS);
            orders.iter().zip(of_axis.iter()).map(|(p, c)| p * c).sum()
        };
        let tilted = shape.normal.into_inner() + a.into_inner() * tilt(0) + b.into_inner() * tilt(1);
        let normal = Unit::new_normalize(tilted);
        let facing = shape.normal.dot(u);
        let distance = shape.offset / facing;
        let local = normal.dot(u);
        if !(facing < 0.0 && local < 0.0 && distance > 0.0) {
            return None;
        }
        let turned =
            |e: &Unit<Vector3<f64>>| -2.0 * (e.dot(u) * normal.into_inner() + local * e.into_inner());
        let moved = |e: &Unit<Vector3<f64>>| -distance * e.dot(u) / facing;
        Some(Self {
            v: mirror::reflect(u, &normal),
            distance,
            turned: [turned(&a), turned(&b)],
            moved: [moved(&a), moved(&b), 1.0 / facing],
            orders,
        })
    }

    /// ∂v/∂(tilts and figure), each with its column among the facet's parameters.
    pub(super) fn directions(&self) -> impl Iterator<Item = (usize, Vector3<f64>)> + '_ {
        let tilts = self.turned.iter().copied().enumerate();
        let figure = (0..FIGURE).map(|i| {
            let (axis, order) = (i / FIGURE_ORDERS, i % FIGURE_ORDERS);
            (3 + i, self.turned[axis] * self.orders[order])
        });
        tilts.chain(figure)
    }
}
