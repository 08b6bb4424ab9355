//! Shapes with a closed-form ray intersection: polygon, box, cylinder and curved mirror.

pub(crate) mod block;
mod curved;
mod cylinder;
pub(crate) mod polygon;

pub use block::Block;
pub use curved::Curved;
pub use cylinder::Cylinder;
pub use polygon::{Polygon, area_vector};
