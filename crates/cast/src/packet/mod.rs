//! Many rays side by side, and as packets in lanes.

pub(crate) mod bundle;
pub(crate) mod in_rows;
pub(crate) mod pyramid;
pub(crate) mod rays;
pub(crate) mod rows;

pub use rays::Rays;
pub use rows::BUNDLE;
