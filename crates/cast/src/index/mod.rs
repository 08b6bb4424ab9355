//! An eight-wide BVH over boxes or triangles, its construction and its traversal.

pub(crate) mod build;
pub(crate) mod line;
pub(crate) mod traversal;
pub(crate) mod wide;
