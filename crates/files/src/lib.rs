//! File formats: the only part of the library that reads or writes files.
//!
//! A dataset is a folder ([`dataset`]) whose observations are a recording in the Robot Operating System's
//! format ([`recording`], [`playback`]), readable by third-party tools. Every output is written completely or not
//! at all ([`file`](mod@file), [`folder`]), and over nothing that is not a result of the same kind ([`output`]); every error names the file ([`error`]).

#[cfg(feature = "recording")]
mod blocks;
#[cfg(feature = "recording")]
mod bodies;
#[cfg(feature = "recording")]
mod capture;
#[cfg(feature = "recording")]
mod container;
#[cfg(feature = "recording")]
pub mod content;
pub mod error;
mod extension;
#[cfg(feature = "recording")]
pub mod file;
#[cfg(feature = "recording")]
pub mod folder;
pub mod json;
#[cfg(feature = "recording")]
mod leftovers;
pub mod names;
#[cfg(feature = "recording")]
mod order;
#[cfg(feature = "recording")]
mod outlying;
pub mod output;
pub mod paths;
pub mod waiting;

#[cfg(feature = "recording")]
pub mod cdr;
#[cfg(feature = "recording")]
mod codes;
#[cfg(feature = "recording")]
pub mod definitions;
#[cfg(feature = "recording")]
mod gathering;
#[cfg(feature = "recording")]
mod lost;
#[cfg(feature = "recording")]
pub mod messages;
#[cfg(feature = "recording")]
pub mod playback;
#[cfg(feature = "recording")]
mod reading;
#[cfg(feature = "recording")]
pub mod recording;
#[cfg(feature = "recording")]
mod records;
#[cfg(feature = "recording")]
mod schedule;
#[cfg(feature = "recording")]
mod source;
#[cfg(feature = "recording")]
mod survey;
#[cfg(feature = "recording")]
mod topics;

pub mod diagnostic;
// Scenes use more of these three than other files do, and the session alone is TOML.
#[cfg_attr(not(all(feature = "recording", feature = "scene")), allow(dead_code))]
mod door;
#[cfg(feature = "scene")]
mod expression;
#[cfg_attr(not(all(feature = "recording", feature = "scene")), allow(dead_code))]
mod format;
#[cfg(feature = "scene")]
mod parameters;
#[cfg(feature = "scene")]
pub mod parametric;
mod rules;
#[cfg(feature = "scene")]
pub mod scene;
#[cfg_attr(not(all(feature = "recording", feature = "scene")), allow(dead_code))]
mod tree;
#[cfg(all(feature = "recording", feature = "scene"))]
mod truth;

pub mod cloud;
#[cfg(feature = "recording")]
pub mod dataset;
#[cfg(feature = "recording")]
pub mod manifest;
#[cfg(feature = "scene")]
pub mod mesh;
pub mod npy;
#[cfg(all(feature = "recording", feature = "scene"))]
pub mod rays;
pub mod results;
#[cfg(all(feature = "recording", feature = "scene"))]
pub mod schema;

#[cfg(feature = "recording")]
pub use content::Content;
#[cfg(feature = "recording")]
pub use dataset::{
    DatasetWriter, parse_dataset, parse_manifest, parse_session, read_dataset, read_dataset_with,
    read_session,
};
pub use error::IoError;
#[cfg(feature = "recording")]
pub use file::{StagedOutput, write_file, write_files, write_json};
pub use json::read_json;
#[cfg(feature = "recording")]
pub use manifest::{Manifest, Provenance};
#[cfg(feature = "recording")]
pub use output::Output;
#[cfg(feature = "recording")]
pub use playback::read_recording;
#[cfg(feature = "recording")]
pub use reading::Damage;
#[cfg(feature = "recording")]
pub use recording::RecordingWriter;
pub use results::{parse_calibration, parse_characterization};
pub use results::{read_calibration, read_calibration_for, read_characterization};
#[cfg(all(feature = "recording", feature = "scene"))]
pub use truth::{parse_truth, read_reference, read_truth, unverified_truth};

#[cfg(all(test, feature = "recording", feature = "scene"))]
mod tests;
