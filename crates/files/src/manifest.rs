//! `manifest.json`: the provenance of a dataset, and the hashes of its files when it was written. It has no timestamps.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of `manifest.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// The commit this library was built from; "unknown" if it was not built from a checkout.
pub const GIT_HASH: &str = env!("CATOPTRIC_GIT_HASH");

/// The provenance of a dataset, as known to the caller.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Seed of all randomness.
    pub seed: u64,
    /// The command in canonical form: without machine-specific paths, options in a fixed order.
    pub command_line: String,
    /// Name of the rule that generates random numbers from the seed.
    pub rng_rule: String,
}

/// `manifest.json`, written last: a folder without it is unfinished, or was recorded by a third party.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this file's format.
    #[schemars(range(min = 1, max = SCHEMA_VERSION))]
    pub schema_version: u32,
    /// Version of catoptric.
    pub version: String,
    /// Commit of catoptric.
    pub git_hash: String,
    /// Whether the dataset was written without its truth; then seed and command, which would give it, are absent.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub blind: bool,
    /// Seed of all randomness.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// The command that wrote the dataset.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub command_line: Option<String>,
    /// Name of the rule that generates random numbers from the seed.
    pub rng_rule: String,
    /// SHA-256 of the resolved scene, `truth/scene.toml`; `None` if there is none.
    pub scene_sha256: Option<String>,
    /// SHA-256 of every other file by its path in the dataset, with forward slashes.
    pub files: BTreeMap<String, String>,
}

impl Manifest {
    /// The manifest of a dataset written by this library; `scene` is the path of the resolved scene.
    pub fn new(provenance: Provenance, scene: &str, files: BTreeMap<String, String>) -> Self {
        Self {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            git_hash: GIT_HASH.to_owned(),
            blind: false,
            seed: Some(provenance.seed),
            command_line: Some(provenance.command_line),
            rng_rule: provenance.rng_rule,
            scene_sha256: files.get(scene).cloned(),
            files,
        }
    }

    /// The same without what would give the truth away.
    #[must_use]
    pub fn hidden(self) -> Self {
        Self {
            blind: true,
            seed: None,
            command_line: None,
            scene_sha256: None,
            ..self
        }
    }
}
