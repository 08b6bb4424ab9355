//! The surface of a shape as triangles, for pictures, volumes and exported files.

use crate::shape::Shape;
use crate::solid::{Block, Cylinder, Polygon};
use nalgebra::{Point3, Vector3};

/// A triangle; its corners are counterclockwise seen from outside.
pub type Triangle = [Point3<f64>; 3];

/// Flat faces that approximate a cylinder: they deviate from it by 0.2 % of the radius.
pub const CYLINDER_FACES: usize = 48;

/// Faces of a box as indices into [`Block::corners`], counterclockwise seen from outside.
const BOX_FACES: [[usize; 4]; 6] = [
    [0, 4, 6, 2],
    [1, 3, 7, 5],
    [0, 1, 5, 4],
    [2, 6, 7, 3],
    [0, 2, 3, 1],
    [4, 5, 7, 6],
];

impl Shape {
    /// Returns the surface as triangles, in meters: closed for a body, a single sheet for a polygon or
    /// a curved mirror.
    pub fn triangles(&self) -> Vec<Triangle> {
        match self {
            Self::Polygon(polygon) => polygon.triangles(),
            Self::Block(block) => block.triangles(),
            Self::Cylinder(cylinder) => cylinder.triangles(),
            Self::Mesh(mesh) => mesh.skin(),
            Self::Curved(curved) => curved.triangles(),
        }
    }
}

impl Polygon {
    /// Returns the polygon as a fan of triangles around its first corner.
    pub fn triangles(&self) -> Vec<Triangle> {
        fan(&self.corners)
    }
}

impl Block {
    fn triangles(&self) -> Vec<Triangle> {
        let corners = self.corners();
        let faces = BOX_FACES.iter();
        faces
            .flat_map(|face| fan(&face.map(|corner| corners[corner])))
            .collect()
    }
}

impl Cylinder {
    fn triangles(&self) -> Vec<Triangle> {
        let rim = |step: usize, z: f64| {
            // The last corner is bit-identical to the first.
            let turn = std::f64::consts::TAU * (step % CYLINDER_FACES) as f64 / CYLINDER_FACES as f64;
            let (sin, cos) = libm::sincos(turn);
            self.frame_from_cylinder * Point3::new(self.radius * cos, self.radius * sin, z)
        };
        let h = self.half_height;
        let [bottom, top] = [-h, h].map(|z| self.frame_from_cylinder * Point3::from(Vector3::z() * z));
        (0..CYLINDER_FACES)
            .flat_map(|i| {
                let [a, b, c, d] = [rim(i, -h), rim(i + 1, -h), rim(i + 1, h), rim(i, h)];
                [[a, b, c], [a, c, d], [bottom, b, a], [top, d, c]]
            })
            .collect()
    }
}

fn fan(corners: &[Point3<f64>]) -> Vec<Triangle> {
    let Some((first, rest)) = corners.split_first() else {
        return Vec::new();
    };
    rest.windows(2).map(|pair| [*first, pair[0], pair[1]]).collect()
}

/// Returns the volume inside a closed surface, in cubic meters: the sum of the signed volumes of the tetrahedra between its
/// triangles and the origin.
pub fn volume(triangles: &[Triangle]) -> f64 {
    let of_one = |[a, b, c]: &Triangle| a.coords.dot(&b.coords.cross(&c.coords)) / 6.0;
    triangles.iter().map(of_one).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::Pose;
    use nalgebra::{Translation3, UnitQuaternion};

    fn place() -> Pose {
        Pose::from_parts(
            Translation3::new(0.3, -0.2, 0.7),
            UnitQuaternion::from_euler_angles(0.3, -1.1, 2.0),
        )
    }

    /// Whether every edge is traversed once in each direction.
    fn is_closed(triangles: &[Triangle]) -> bool {
        let key = |p: &Point3<f64>| p.coords.map(f64::to_bits).data.0[0];
        let edges = triangles
            .iter()
            .flat_map(|t| (0..3).map(move |i| (key(&t[i]), key(&t[(i + 1) % 3]))));
        let mut seen = std::collections::BTreeMap::new();
        for edge in edges {
            *seen.entry(edge).or_insert(0) += 1;
        }
        seen.iter()
            .all(|((a, b), count)| *count == 1 && seen.contains_key(&(*b, *a)))
    }

    #[test]
    fn bodies_are_closed_and_have_the_expected_volume() {
        let block = Shape::Block(Block::new(place(), Vector3::new(0.1, 0.2, 0.05))).triangles();
        assert!(is_closed(&block));
        assert!((volume(&block) / (0.1 * 0.2 * 0.05) - 1.0).abs() < 1e-12);
        let rod = Shape::Cylinder(Cylinder::new(place(), 0.1, 0.3)).triangles();
        assert!(is_closed(&rod));
        // A prism over a regular polygon inscribed in the circle.
        let n = CYLINDER_FACES as f64;
        let prism = 0.5 * n * 0.05 * 0.05 * libm::sin(std::f64::consts::TAU / n) * 0.3;
        assert!((volume(&rod) / prism - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_polygon_keeps_its_front() {
        let corners = [(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 2.0), (0.0, 1.0)];
        let polygon =
            Polygon::new(corners.map(|(x, y)| Point3::new(x, y, 0.5)).to_vec()).expect("a nonzero area");
        let sheet = Shape::Polygon(polygon).triangles();
        let normals: Vec<Vector3<f64>> = sheet.iter().map(|[a, b, c]| (b - a).cross(&(c - a))).collect();
        assert_eq!(sheet.len(), 3);
        assert!(normals.iter().all(|n| n.z > 0.0));
        // Twice the areas of the square below and the triangle above it.
        assert!((normals.iter().map(|n| n.z).sum::<f64>() - 6.0).abs() < 1e-12);
    }
}
