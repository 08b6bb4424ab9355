//! An index over boxes and triangles for lanes.

pub(crate) mod build;
pub(crate) mod wide;
