//! Everything that is read or written.

pub mod diagnostic;
pub mod scene;

mod format;
mod tree;
