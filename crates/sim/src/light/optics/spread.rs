//! How curved mirrors spread the light of a point: from the lens to the target, and by the same measure back.
//!
//! Eq. (1) lets the light of a spot spread as 1/R² on its way back. Behind curved mirrors it spreads as 1/A, where A is the
//! area over which a unit of solid angle that leaves the lens is spread at the target: by reciprocity, the target's light
//! is spread over the lens by as much (the determinant of a path's B matrix is the same in both directions). A follows from
//! the curvature tensor W of the wavefront:
//!
//! ```text
//! from the lens over s     W = (1 − d·dᵀ)/s            A = s²
//! over a further s         W ← W·(1 + s·W)⁻¹           A ← A·(1 + s·tr W + s²·det W)
//! at a mirror              W ← R·(W + 2(n·d)·Pᵀ·S·P)·R    R = 1 − 2n·nᵀ, P = 1 − d·nᵀ/(n·d)
//! ```
//!
//! with the direction d, the mirror's normal n and the map S by which its normal turns along it: the equations of
//! Coddington, without their restriction to symmetric planes. Near a focus A vanishes, and no more light can come back than
//! the mirror itself lets through from there.

use super::path::RayPath;
use super::setting::Setting;
use catoptric_cast::Ray;
use catoptric_model::curve::CurvedSurface;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

/// How the light of a path spreads after its last mirror.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Length of the path up to there, in meters.
    length: f64,
    /// A at that mirror, in square meters.
    area: f64,
    /// Trace and determinant of W across the path.
    trace: f64,
    determinant: f64,
    /// Area of the smallest curved mirror on the path, as the light sees it, in square meters.
    window: f64,
}

/// A reflection, as far as it matters here.
pub(crate) struct Turn<'a> {
    pub(crate) point: Point3<f64>,
    pub(crate) after: Unit<Vector3<f64>>,
    /// The surface of a curved mirror, and its area over its plane.
    pub(crate) curved: Option<(&'a CurvedSurface, f64)>,
}

impl Spread {
    /// After some reflections of a ray; `None` if all mirrors are flat.
    pub(crate) fn after<'a>(start: &Ray, turns: impl Iterator<Item = Turn<'a>>) -> Option<Self> {
        let (mut last, mut length, mut area) = (*start, 0.0, 0.0);
        let (mut tensor, mut window) = (Matrix3::zeros(), f64::INFINITY);
        for turn in turns {
            let leg = (turn.point - last.origin).norm();
            let d = last.direction.into_inner();
            if length == 0.0 {
                area = leg * leg;
                tensor = (Matrix3::identity() - d * d.transpose()) / leg;
            } else {
                area *= grown(&tensor, leg);
                // Singular only in a focus, where the light turns around itself.
                let further = (Matrix3::identity() + tensor * leg).try_inverse()?;
                tensor *= further;
            }
            length += leg;
            let normal = Unit::new_normalize(turn.after.into_inner() - d).into_inner();
            let facing = normal.dot(&d);
            if let Some((surface, face)) = turn.curved {
                let onto = Matrix3::identity() - d * normal.transpose() / facing;
                tensor += onto.transpose() * surface.shape_at(&turn.point) * onto * (2.0 * facing);
                window = window.min(face * facing.abs());
            }
            let mirrored = Matrix3::identity() - normal * normal.transpose() * 2.0;
            tensor = mirrored * tensor * mirrored;
            last = Ray {
                origin: turn.point,
                direction: turn.after,
            };
        }
        let (trace, determinant) = invariants(&tensor);
        window.is_finite().then_some(Self {
            length,
            area,
            trace,
            determinant,
            window,
        })
    }

    /// Factor on the light that comes back from a spot at a path length, compared with flat mirrors; `lens` is the area of
    /// the receiver's lens, in square meters.
    pub fn gain(&self, range: f64, lens: f64) -> f64 {
        let leg = range - self.length;
        let spread = (self.area * (1.0 + leg * (self.trace + leg * self.determinant))).abs();
        // All light through the mirror, if it all reached the lens; flat mirrors are taken for large enough.
        let most = (self.window * range * range / (leg * leg * lens)).max(1.0);
        (range * range / spread).min(most)
    }
}

impl Spread {
    /// Longest path from which as much light comes back as by flat mirrors over `flat` meters.
    pub fn reach(&self, flat: f64) -> f64 {
        let most = flat * flat / self.area;
        // 1 + leg·tr W + leg²·det W reaches ± that: the larger root of each.
        let last = |size: f64| {
            let (a, b, c) = (self.determinant, self.trace, 1.0 - size);
            let root = (b * b - 4.0 * a * c).sqrt();
            let sum = -0.5 * (b + f64::copysign(root, b));
            let roots = [sum / a, c / sum];
            roots
                .into_iter()
                .filter(|leg| leg.is_finite() && *leg > 0.0)
                .fold(0.0, f64::max)
        };
        let endless = self.trace == 0.0 && self.determinant == 0.0 && most >= 1.0;
        if endless || most.is_infinite() {
            return f64::INFINITY;
        }
        self.length + last(most).max(last(-most))
    }
}

fn grown(tensor: &Matrix3<f64>, leg: f64) -> f64 {
    let (trace, determinant) = invariants(tensor);
    1.0 + leg * (trace + leg * determinant)
}

/// Sum and product of the two principal curvatures of a tensor across a path, whose third one is zero.
fn invariants(tensor: &Matrix3<f64>) -> (f64, f64) {
    let trace = tensor.trace();
    (trace, 0.5 * (trace * trace - (tensor * tensor).trace()))
}

impl Setting<'_> {
    /// How the light of a ray's path spreads after its last mirror; `None` if all its mirrors are flat.
    pub fn spread_along(&self, start: &Ray, path: &RayPath) -> Option<Spread> {
        let met = path.facets().iter().zip(path.points()).zip(path.meetings());
        self.spread(
            start,
            met.map(|((facet, point), meeting)| (*facet, *point, meeting.after)),
        )
    }

    /// How the light of a path spreads after its last mirror; `None` if all its mirrors are flat.
    pub(super) fn spread(
        &self,
        start: &Ray,
        met: impl Iterator<Item = (usize, Point3<f64>, Unit<Vector3<f64>>)>,
    ) -> Option<Spread> {
        if !self.contents.bends {
            return None;
        }
        let turn = |(facet, point, after): (usize, Point3<f64>, Unit<Vector3<f64>>)| {
            let bent = self.contents.facets[facet].bent.as_ref();
            Turn {
                point,
                after,
                curved: bent.map(|bent| (&bent.face.surface, bent.face.area())),
            }
        };
        Spread::after(start, met.map(turn))
    }
}

#[cfg(test)]
mod tests;
