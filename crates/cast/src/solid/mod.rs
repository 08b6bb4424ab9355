//! Shapes with a closed-form ray intersection: polygon, box and cylinder.

pub(crate) mod block;
mod cylinder;
pub(crate) mod polygon;

pub use block::Block;
pub use cylinder::Cylinder;
pub use polygon::{Polygon, area_vector};
