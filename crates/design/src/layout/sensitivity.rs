//! Sensitivity of a measured point to errors of the facets.
//!
//! A reading r of a beam that hits the facets 1…n is the point P = M_n ∘ … ∘ M_1 (r·u), where M_k is the reflection of
//! points in plane k, {m·x = h}: x ↦ x − 2(m·x − h)m. A facet turned by ω about its center c and shifted by t has m +
//! ω×m and h + δh with δh = (ω×m)·c + m·t, and moves the image of x by
//!
//! ```text
//! δM(x) = −2·[m (x − c)ᵀ + (m·x − h)·I]·(ω×m) + 2·(m·t)·m
//! ```
//!
//! which the mirrors behind it reflect like any direction. A turn about the normal and a shift along the plane move
//! nothing. Glass moves with its facet and is neglected here; its effect is about its thickness in millimeters times
//! the turn.

use catoptric_cast::Polygon;
use catoptric_model::beam;
use catoptric_model::frame::tangent_basis;
use nalgebra::{Matrix3, Matrix3x2, Point3, Vector3};

/// Reading for which the sensitivity is stated, in meters from the scanner.
pub(super) const RANGE_M: f64 = 4.0;

/// Derivatives of the point of one reading by the pose of one facet.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Shift {
    /// By a turn of the facet about the two axes of its plane, in meters per radian.
    pub(super) turn: Matrix3x2<f64>,
    /// By a shift of the facet along its normal, dimensionless.
    pub(super) shift: Vector3<f64>,
}

impl std::ops::Add for Shift {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            turn: self.turn + other.turn,
            shift: self.shift + other.shift,
        }
    }
}

impl Shift {
    /// Returns the maximum displacement over all axes of a turn, in meters per radian: the larger singular value.
    pub(super) fn worst_turn(&self) -> f64 {
        let square = self.turn.transpose() * self.turn;
        let half = 0.5 * square.trace();
        let rest = (half * half - square.determinant()).max(0.0);
        (half + rest.sqrt()).sqrt()
    }
}

/// How the point of a reading of a beam of this base azimuth moves with the faces that its chief ray meets, one for every bounce.
pub(super) fn shifts<'f>(azimuth: f64, faces: impl Iterator<Item = &'f Polygon>, range: f64) -> Vec<Shift> {
    let mut image = Point3::from(beam::direction(azimuth).into_inner() * range);
    let mut shifts: Vec<Shift> = Vec::new();
    for face in faces {
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

/// Returns the mean of the corners, about which a facet is turned.
pub fn center(corners: &[Point3<f64>]) -> Point3<f64> {
    Point3::from(corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len().max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Rotation3;

    fn face(center: [f64; 3], normal: [f64; 3]) -> Polygon {
        let m = nalgebra::Unit::new_normalize(Vector3::from(normal));
        let (a, b) = tangent_basis(&m);
        let corners = [(-0.01, -0.02), (0.03, -0.02), (0.03, 0.02), (-0.01, 0.02)];
        let place = |(x, y): (f64, f64)| Point3::from(Vector3::from(center) + a.scale(x) + b.scale(y));
        let corners: Vec<_> = corners.map(place).to_vec();
        let face = Polygon::new(corners).expect("it has an area");
        if face.normal.dot(&m) > 0.0 {
            face
        } else {
            face.turned().expect("so has its back")
        }
    }

    fn moved(face: &Polygon, turn: Vector3<f64>, shift: Vector3<f64>) -> Polygon {
        let (middle, turn) = (center(&face.corners), Rotation3::new(turn));
        let corners = face.corners.iter().map(|c| middle + shift + turn * (c - middle));
        Polygon::new(corners.collect()).expect("it has an area")
    }

    /// The point of a reading, by reflection after reflection.
    fn point(faces: &[Polygon], azimuth: f64, range: f64) -> Point3<f64> {
        let start = Point3::from(beam::direction(azimuth).into_inner() * range);
        faces.iter().fold(start, |p, f| {
            let m = f.normal.into_inner();
            p - m * (2.0 * m.dot(&(p - f.origin)))
        })
    }

    #[test]
    fn derivatives_for_two_mirrors_are_finite_differences() {
        /// Ten steps of 0.25°.
        const AZIMUTH: f64 = 2.5 * std::f64::consts::PI / 180.0;
        let faces = [
            face([0.07, 0.0, 0.0], [-1.0, 0.2, 1.0]),
            face([0.07, 0.02, 0.3], [0.1, 0.4, -1.0]),
        ];
        let found = shifts(AZIMUTH, faces.iter(), RANGE_M);
        assert_eq!(found.len(), 2);
        let step = 1e-5;
        for (number, shift) in found.iter().enumerate() {
            let with = |turn: Vector3<f64>, by: Vector3<f64>| {
                let mut faces = faces.clone();
                faces[number] = moved(&faces[number], turn, by);
                point(&faces, AZIMUTH, RANGE_M)
            };
            let (a, b) = tangent_basis(&faces[number].normal);
            for (column, axis) in [a, b].into_iter().enumerate() {
                let turn = axis.into_inner() * step;
                let difference =
                    (with(turn, Vector3::zeros()) - with(-turn, Vector3::zeros())) / (2.0 * step);
                assert!(
                    (difference - shift.turn.column(column)).norm() < 1e-6,
                    "{number} {column}"
                );
            }
            let by = faces[number].normal.into_inner() * step;
            let difference = (with(Vector3::zeros(), by) - with(Vector3::zeros(), -by)) / (2.0 * step);
            assert!((difference - shift.shift).norm() < 1e-9, "{number}");
        }
    }
}
