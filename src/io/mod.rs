//! Files: the only part of the library that reads or writes.
//!
//! A dataset is a folder ([`dataset`]) whose observations are a recording in the Robot Operating System's own
//! format ([`recording`], [`playback`]), so that others' tools open it. Whatever is written appears whole or not
//! at all ([`file`](mod@file), [`folder`]); whatever goes wrong names the file ([`error`]).

mod bodies;
mod container;
pub mod error;
pub mod file;
pub mod folder;

pub mod cdr;
pub mod definitions;
mod gathering;
pub mod messages;
pub mod playback;
pub mod recording;
mod schedule;

pub mod diagnostic;
mod expression;
mod format;
mod parameters;
pub mod scene;
pub mod template;
mod tree;

pub mod cloud;
pub mod dataset;
pub mod manifest;
pub mod mesh;
pub mod npy;
pub mod rays;

pub use dataset::{DatasetWriter, read_dataset, read_session};
pub use error::IoError;
pub use file::{StagedOutput, read_json, write_file, write_json};
pub use manifest::{Manifest, Provenance};
pub use playback::read_recording;
pub use recording::RecordingWriter;

#[cfg(test)]
mod tests;
