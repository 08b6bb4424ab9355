//! The meshes that a scene names.
//!
//! The library reads no files. A scene names its meshes by file; the caller who reads the scene reads them too and puts
//! them into [`Scene::meshes`](crate::Scene), where everything that places a mesh finds it.

use crate::error::SimError;
use catoptric_cast::Mesh;
use std::collections::BTreeMap;
use std::sync::Arc;

/// The meshes that a scene names, by their file names in the scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Meshes(pub BTreeMap<String, Arc<Mesh>>);

impl Meshes {
    /// The mesh of a file.
    ///
    /// # Errors
    /// [`SimError::Mesh`] if it has not been read.
    pub fn get(&self, file: &str) -> Result<&Arc<Mesh>, SimError> {
        self.0.get(file).ok_or_else(|| SimError::Mesh {
            file: file.to_owned(),
        })
    }
}
