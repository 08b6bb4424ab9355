//! How far a point moves when a facet is not where it is drawn.
//!
//! Reading r of a beam that meets the facets 1…n is the point P = M_n ∘ … ∘ M_1 (r·u), M_k being the reflection of points
//! in plane k, {m·x = h}: x ↦ x − 2(m·x − h)m. A facet that is turned by ω about its center c and shifted by t has
//! m + ω×m and h + δh with δh = (ω×m)·c + m·t, and moves the image of x by
//!
//! ```text
//! δM(x) = −2·[m (x − c)ᵀ + (m·x − h)·I]·(ω×m) + 2·(m·t)·m
//! ```
//!
//! which the mirrors behind it turn like any direction. A turn about the normal and a shift along the plane move nothing.
//! Glass moves with its facet, so it does not count here; it adds a walk of its own millimetres times the turn.

use super::element::Traced;
use catoptric_model::beam;
use catoptric_model::frame::tangent_basis;
use catoptric_sim::structure::Structure;
use nalgebra::{Matrix3, Matrix3x2, Point3, Vector3};

/// Reading for which it is stated, in metres from the scanner.
pub(super) const RANGE_M: f64 = 4.0;

/// How the point of one reading moves with one facet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Shift {
    /// With a turn of the facet about the two axes of its plane, in metres per radian.
    pub(super) turn: Matrix3x2<f64>,
    /// With a shift of the facet along its normal, without unit.
    pub(super) shift: Vector3<f64>,
}

impl Shift {
    /// Largest movement over the directions of a turn, in metres per radian: the greater singular value.
    pub(super) fn worst_turn(&self) -> f64 {
        let square = self.turn.transpose() * self.turn;
        let half = 0.5 * square.trace();
        let rest = (half * half - square.determinant()).max(0.0);
        (half + rest.sqrt()).sqrt()
    }
}

/// How the point of a reading of a beam moves with the facets that its chief ray meets, one for every bounce.
pub(super) fn shifts(structure: &Structure, traced: &Traced, range: f64) -> Vec<Shift> {
    let facets = traced.chief.facets();
    let mut image = Point3::from(beam::direction(beam::azimuth(traced.beam)).into_inner() * range);
    let mut shifts: Vec<Shift> = Vec::with_capacity(facets.len());
    for &facet in facets {
        let face = &structure.facets[facet].face;
        let m = face.normal.into_inner();
        let height = m.dot(&(image - face.origin));
        let reflection = Matrix3::identity() - m * m.transpose() * 2.0;
        for before in &mut shifts {
            before.turn = reflection * before.turn;
            before.shift = reflection * before.shift;
        }
        let from_center = image - center(&face.corners);
        let of_normal = (m * from_center.transpose() + Matrix3::identity() * height) * -2.0;
        let (a, b) = tangent_basis(&face.normal);
        // ω = a turns m by a×m, ω = b by b×m.
        let turned = Matrix3x2::from_columns(&[a.cross(&m), b.cross(&m)]);
        shifts.push(Shift {
            turn: of_normal * turned,
            shift: m * 2.0,
        });
        image -= m * (2.0 * height);
    }
    shifts
}

/// Mean of the corners, about which a facet is turned.
pub(crate) fn center(corners: &[Point3<f64>]) -> Point3<f64> {
    Point3::from(corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len().max(1) as f64)
}
