//! An eight-wide BVH over boxes and triangles, and its construction.

pub(crate) mod build;
pub(crate) mod wide;
