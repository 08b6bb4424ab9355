//! Triangle meshes as data: what a file describes, before it is placed anywhere.

use nalgebra::Point3;

/// Triangles over shared vertices, in the unit of its file. The front of a triangle is the side from which its
/// vertices run counter-clockwise.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Mesh {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
}

/// Why numbers are no mesh.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// Nothing to meet.
    #[error("it has no triangles")]
    Empty,
    /// A vertex that is nowhere.
    #[error("vertex {vertex} is not finite")]
    NotFinite {
        /// Its number, from 0.
        vertex: usize,
    },
    /// A triangle over a vertex that there is not.
    #[error("triangle {triangle} uses vertex {vertex}; there are {count}, numbered from 0")]
    NoVertex {
        /// The triangle's number, from 0.
        triangle: usize,
        /// The vertex it uses.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
}

impl Mesh {
    /// A mesh of finite vertices, each triangle over three of them.
    ///
    /// # Errors
    /// [`MeshError`] says which vertex or triangle is wrong.
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

    /// The vertices.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// The triangles, each three numbers of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}
