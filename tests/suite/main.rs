//! One binary for all integration tests; each module says what it proves and what it does not.
#![allow(clippy::unwrap_used, clippy::print_stderr, missing_docs)]

mod bad_input;
mod cli;
mod closure;
mod common;
mod consistency;
mod detection;
mod determinism;
mod docs;
mod motion;
mod paper;
mod physics;
mod pipeline;
mod scenes;
mod traps;
