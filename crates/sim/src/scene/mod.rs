//! The scene: everything that is simulated, as a person writes it in TOML.
//!
//! Every key carries its unit. Values that nobody published are defaults marked *assumed*. The checks that need more
//! than one value are in [`crate::check`].

mod detection;
mod errors;
mod room;
mod scanner;
mod superstructure;

pub use detection::{Detection, Detector, EchoChoice, Principle};
pub use errors::{Characterization, Correlated, ErrorModel, Errors, Interference, NoiseTable, WarmUp};
pub use room::{Board, BoardPose, Color, Experiment, Mocap, MocapProfile, Room};
pub use scanner::{BeamShape, Light, Limits, Mount, Preset, Scanner};
pub use superstructure::{
    AsBuilt, Facet, FacetShape, Marker, Mirror, PolygonShape, Post, RectangleShape, Superstructure, Wedge,
};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the scene format.
pub const SCHEMA_VERSION: u32 = 1;

/// A complete experiment: sensor, mirrors, boards, room, procedure and errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of this format, 1.
    #[schemars(range(min = 1, max = 1))]
    pub schema_version: u32,
    /// Name of the experiment.
    pub name: String,
    /// Seed of every random draw; `--seed` overrides it.
    #[serde(default = "one")]
    pub seed: u64,
    /// The scanner.
    pub scanner: Scanner,
    /// Terms of Eq. 1.
    #[serde(default)]
    pub light: Light,
    /// From received light to a range.
    #[serde(default)]
    pub detection: Detection,
    /// Mirrors, posts and markers.
    pub superstructure: Superstructure,
    /// Surface colors beside the built-in ones.
    #[serde(default)]
    pub color: BTreeMap<String, Color>,
    /// The target boards; poses take them in turn.
    #[serde(default)]
    pub board: Vec<Board>,
    /// The room.
    pub room: Room,
    /// Motion capture.
    #[serde(default)]
    pub mocap: Mocap,
    /// The procedure.
    #[serde(default)]
    pub experiment: Experiment,
    /// Errors of the sensor.
    #[serde(default)]
    pub errors: Errors,
    /// How well step 1 knows those errors.
    #[serde(default)]
    pub characterization: Characterization,
}

fn one() -> u64 {
    1
}
