//! One binary for all integration tests; each module documents what it proves and what it does not.
#![allow(clippy::unwrap_used, clippy::print_stderr, missing_docs)]

mod bad_geometry;
mod bad_input;
mod characterize;
#[path = "../../examples/ci/calibrator.rs"]
mod ci_example;
mod cli;
mod closure;
mod common;
mod compare;
mod consistency;
mod detection;
mod determinism;
mod docs;
mod door;
mod edits;
mod energy;
mod export;
mod gates;
mod hostile_names;
mod house;
mod layout;
mod mishaps;
mod motion;
mod noise;
mod optimize;
mod overwriting;
mod paper;
mod parametric;
mod physics;
mod pipeline;
mod plan;
mod properties;
mod referee;
mod scan_geometry;
mod scenes;
mod stopping;
mod streaming;
mod study;
mod sub_rays;
mod tiers;
mod tolerance;
mod tracing;
mod traps;
