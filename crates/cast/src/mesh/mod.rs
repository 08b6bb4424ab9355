//! Triangle meshes: as data, and placed in a frame with an index over their triangles.

pub(crate) mod data;
pub(crate) mod eight;
pub(crate) mod exact;
pub(crate) mod finish;
pub(crate) mod packet;
pub(crate) mod pending;
pub(crate) mod single;
pub(crate) mod triangles;

pub use data::{Mesh, MeshError};
pub use exact::TriangleHit;
pub use triangles::Triangles;
