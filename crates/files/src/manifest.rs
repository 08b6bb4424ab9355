//! `manifest.json`: where a dataset comes from, and what its files were when it was written. It holds no clock.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of `manifest.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// The commit this library was built from; "unknown" if it was not built from a checkout.
pub const GIT_HASH: &str = env!("CATOPTRIC_GIT_HASH");

/// What the caller knows of where a dataset comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Provenance {
    /// Seed of all randomness.
    pub seed: u64,
    /// The command in canonical form: without paths of one machine, options in a fixed order.
    pub command_line: String,
    /// Name of the rule that makes random numbers from the seed.
    pub rng_rule: String,
}

/// `manifest.json`, written last: a folder without it was never finished, or was recorded by someone else.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Version of this file's format.
    pub schema_version: u32,
    /// Version of catoptric.
    pub version: String,
    /// Commit of catoptric.
    pub git_hash: String,
    /// Seed of all randomness.
    pub seed: u64,
    /// The command that wrote the dataset.
    pub command_line: String,
    /// Name of the rule that makes random numbers from the seed.
    pub rng_rule: String,
    /// SHA-256 of the resolved scene, `truth/scene.toml`; `None` if there was none.
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
            seed: provenance.seed,
            command_line: provenance.command_line,
            rng_rule: provenance.rng_rule,
            scene_sha256: files.get(scene).cloned(),
            files,
        }
    }
}
