//! Triangle meshes as data: the content of a mesh file, before it is placed.

use nalgebra::Point3;

/// Triangles over shared vertices, in the unit of the file. The front of a triangle is the side from which its vertices
/// are counterclockwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// Why vertices and triangles do not form a valid mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// No triangles.
    #[error("it has no triangles")]
    Empty,
    /// A vertex with an infinite or NaN coordinate.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Index of the vertex, from 0.
        vertex: usize,
    },
    /// A triangle that uses a nonexistent vertex.
    #[error("triangle {triangle} uses vertex {vertex}; there are {count}, numbered from 0")]
    NoVertex {
        /// Index of the triangle, from 0.
        triangle: usize,
        /// Index of the missing vertex.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
}

impl Mesh {
    /// Builds a mesh and checks that all vertices are finite and all indices valid.
    ///
    /// # Errors
    /// [`MeshError`] names the invalid vertex or triangle.
    pub fn new(vertices: Vec<Point3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        if triangles.is_empty() {
            return Err(MeshError::Empty);
        }
        let finite = |p: &Point3<f64>| p.iter().all(|c| c.is_finite());
        if let Some(vertex) = vertices.iter().position(|p| !finite(p)) {
            return Err(MeshError::NotFinite { vertex });
        }
        let count = vertices.len();
        for (triangle, corners) in triangles.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|v| **v as usize >= count) {
                return Err(MeshError::NoVertex {
                    triangle,
                    vertex,
                    count,
                });
            }
        }
        Ok(Self { vertices, triangles })
    }

    /// Returns the vertices.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Returns the triangles, each as three vertex indices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}
