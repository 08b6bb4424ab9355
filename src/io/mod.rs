//! Files: the only part of the library that reads or writes.

pub mod cloud;
