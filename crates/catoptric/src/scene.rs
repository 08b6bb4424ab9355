//! A scene as its author keeps it: the text, its file, the settings that change it, and the resolved scene.

use crate::Error;
use catoptric_files::scene::{self, Template};
use std::path::{Path, PathBuf};

/// A scene: one experiment in TOML (or JSON), with its parameters, patterns and meshes resolved.
///
/// ```
/// use catoptric::{Scene, Template};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::template(Template::TwoMirror).with(&["experiment.scans_per_pose=20"])?;
/// assert_eq!(scene.resolved().experiment.scans_per_pose, 20);
/// let wrong = Scene::parse("name = \"mine\"\nscaner = {}").unwrap_err().to_string();
/// assert!(wrong.contains("scene.toml:2:1") && wrong.contains("did you mean `scanner`?"), "{wrong}");
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    text: String,
    name: String,
    folder: PathBuf,
    settings: Vec<String>,
    seed: Option<u64>,
    resolved: catoptric_sim::Scene,
}

impl Scene {
    /// Reads a scene file and the meshes it refers to.
    ///
    /// # Errors
    /// [`Error::Scene`] if the file cannot be read or is invalid; lists every problem.
    pub fn load(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load_with(path, &[] as &[&str])
    }

    /// Reads a scene file and applies settings such as `experiment.scans_per_pose=20`.
    ///
    /// # Errors
    /// Same as [`load`](Self::load); a problem with a setting names the setting.
    pub fn load_with(path: impl AsRef<Path>, settings: &[impl AsRef<str>]) -> Result<Self, Error> {
        let path = path.as_ref();
        let settings = owned(settings);
        let (text, resolved) = scene::load_text(path, &settings)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        Ok(Self {
            text,
            name: path.display().to_string(),
            folder: folder.unwrap_or(Path::new(".")).to_owned(),
            settings,
            seed: None,
            resolved,
        })
    }

    /// Reads a scene from TOML text; mesh files are looked up in the current folder.
    ///
    /// # Errors
    /// [`Error::Scene`] with every problem.
    pub fn parse(text: &str) -> Result<Self, Error> {
        Self::parse_in(text, "scene.toml", ".", &[] as &[&str])
    }

    /// Reads a scene from text as if it were a file of this name (JSON if it ends in `.json`) in this folder.
    ///
    /// # Errors
    /// Same as [`load_with`](Self::load_with).
    pub fn parse_in(
        text: &str,
        name: &str,
        folder: impl AsRef<Path>,
        settings: &[impl AsRef<str>],
    ) -> Result<Self, Error> {
        let settings = owned(settings);
        let resolved = scene::parse_in(text, name, folder.as_ref(), &settings)?;
        Ok(Self {
            text: text.to_owned(),
            name: name.to_owned(),
            folder: folder.as_ref().to_owned(),
            settings,
            seed: None,
            resolved,
        })
    }

    /// A built-in scene to start from.
    #[expect(
        clippy::missing_panics_doc,
        reason = "built-in scenes are valid: a test reads them all"
    )]
    pub fn template(template: Template) -> Self {
        let name = format!("{}.toml", template.name());
        match Self::parse_in(template.text(), &name, ".", &[] as &[&str]) {
            Ok(scene) => scene,
            Err(error) => panic!("the built-in scene {name} is not valid: {error}"),
        }
    }

    /// The same scene with additional settings.
    ///
    /// # Errors
    /// [`Error::Scene`] with every problem of the changed scene.
    pub fn with(&self, settings: &[impl AsRef<str>]) -> Result<Self, Error> {
        let mut all = self.settings.clone();
        all.extend(owned(settings));
        let scene = Self::parse_in(&self.text, &self.name, &self.folder, &all)?;
        Ok(match self.seed {
            Some(seed) => scene.with_seed(seed),
            None => scene,
        })
    }

    /// The same scene with another seed of all random effects.
    #[must_use]
    pub fn with_seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self.resolved.seed = seed;
        self
    }

    /// The resolved scene: every default, expression, pattern and mesh evaluated.
    pub fn resolved(&self) -> &catoptric_sim::Scene {
        &self.resolved
    }

    /// What is probably not meant, and hinders nothing, such as a mirror that no beam reaches.
    pub fn warnings(&self) -> Vec<String> {
        let found = catoptric_sim::check::warnings(&self.resolved);
        found.into_iter().map(|problem| problem.message).collect()
    }

    /// The text it was read from.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The name of its file, as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The folder that mesh file names are relative to.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The files it was read from, if this was the first: it and its meshes.
    pub fn files(&self, scene: impl AsRef<Path>) -> Vec<PathBuf> {
        let meshes = self.resolved.mesh_shapes().into_iter();
        let mut files = vec![scene.as_ref().to_owned()];
        files.extend(meshes.map(|(_, mesh)| self.folder.join(&mesh.file)));
        files
    }

    /// The settings applied to it, in order.
    pub fn settings(&self) -> &[String] {
        &self.settings
    }
}

fn owned(settings: &[impl AsRef<str>]) -> Vec<String> {
    settings.iter().map(|s| s.as_ref().to_owned()).collect()
}
