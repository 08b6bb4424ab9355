//! Files: the only part of the library that reads or writes.

pub mod diagnostic;
pub mod scene;

mod format;
mod tree;
