//! Rays in structure-of-arrays form, and packets of them in SIMD lanes.

pub(crate) mod cast;
pub(crate) mod in_rows;
pub(crate) mod pyramid;
pub(crate) mod rays;
pub(crate) mod rows;

pub use rays::Rays;
pub use rows::PACKET;
