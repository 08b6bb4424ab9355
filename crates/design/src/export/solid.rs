//! Closed bodies as triangle meshes.

use catoptric_cast::Triangle;
use catoptric_sim::build::Bent;
use nalgebra::{Point3, Unit, Vector3};

/// A closed body in the sensor frame; its triangles are counterclockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    /// Name.
    pub name: String,
    /// Its surface, in meters.
    pub triangles: Vec<Triangle>,
}

impl Solid {
    /// Returns the body between two convex outlines with the same number of corners, both counterclockwise seen from
    /// the top.
    pub(super) fn between(name: &str, bottom: &[Point3<f64>], top: &[Point3<f64>]) -> Self {
        let mut triangles = Vec::new();
        for i in 1..top.len().max(2) - 1 {
            triangles.push([top[0], top[i], top[i + 1]]);
            triangles.push([bottom[0], bottom[i + 1], bottom[i]]);
        }
        for i in 0..top.len() {
            let j = (i + 1) % top.len();
            triangles.push([bottom[i], bottom[j], top[j]]);
            triangles.push([bottom[i], top[j], top[i]]);
        }
        Self {
            name: name.to_owned(),
            triangles,
        }
    }

    /// Returns the body of a curved mirror: its face, as near as its triangles are, and a back that is as far behind it along
    /// the normal of its outline.
    pub(super) fn shell(name: &str, bent: &Bent, thickness: f64) -> Self {
        let behind = bent.face.outline.normal.into_inner() * thickness;
        let mut triangles = bent.face.triangles();
        let back = triangles
            .iter()
            .map(|[a, b, c]| [a - behind, c - behind, b - behind]);
        let back: Vec<Triangle> = back.collect();
        triangles.extend(back);
        let rim = bent.face.rim();
        for (a, b) in rim.iter().zip(rim.iter().cycle().skip(1)) {
            triangles.push([a - behind, b - behind, *b]);
            triangles.push([a - behind, *b, *a]);
        }
        Self {
            name: name.to_owned(),
            triangles,
        }
    }

    /// Returns a square bar from one point to another.
    pub(super) fn bar(name: &str, from: Point3<f64>, to: Point3<f64>, width: f64) -> Option<Self> {
        let along = Unit::try_new(to - from, 1e-6)?;
        // Any perpendicular direction will do; a horizontal one where it is defined.
        let across = Unit::try_new(Vector3::z().cross(&along), 1e-3).unwrap_or(Vector3::x_axis());
        let up = along.cross(&across);
        let end = |at: Point3<f64>| {
            [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)]
                .map(|(a, b)| at + across.into_inner() * (a * width) + up * (b * width))
        };
        Some(Self::between(name, &end(from), &end(to)))
    }

    /// Returns a horizontal disc between two heights.
    pub(super) fn disc(name: &str, radius: f64, [bottom, top]: [f64; 2]) -> Self {
        let corners = |z: f64| -> Vec<Point3<f64>> {
            (0..catoptric_cast::CYLINDER_FACES)
                .map(|k| {
                    let turn = std::f64::consts::TAU * k as f64 / catoptric_cast::CYLINDER_FACES as f64;
                    let (sin, cos) = libm::sincos(turn);
                    Point3::new(radius * cos, radius * sin, z)
                })
                .collect()
        };
        Self::between(name, &corners(bottom), &corners(top))
    }
}
