//! All tests of the program as a whole, in one binary.
#![allow(clippy::unwrap_used)] // A failure in a test should panic where it is.

mod bad_input;
mod cli;
mod common;
