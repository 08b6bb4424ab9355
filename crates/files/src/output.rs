//! Where a result is written, and what may be written over there.
//!
//! A file is written over if its beginning shows that it holds the same kind of result, and it is no input of the run.
//! Scenes, sessions, recordings and files of other programs are written over on request only.

use super::content::Content;
use super::error::IoError;
use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// Where a result is written, and what may be written over there. A path is one, with the cautious rule.
///
/// ```
/// use catoptric_files::{Output, write_file};
///
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("mine.toml");
/// std::fs::write(&path, "[scanner]\npreset = \"ust-20lx\"\n")?;
/// let page = b"<!DOCTYPE html>";
/// assert!(write_file(&path, page).is_err());
/// write_file(Output::new(&path).replacing(true), page)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Output {
    path: PathBuf,
    replace: bool,
    inputs: Vec<PathBuf>,
}

impl<P: AsRef<Path>> From<P> for Output {
    fn from(path: P) -> Self {
        Self::new(path)
    }
}

/// What is at the place of a file to be written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum There {
    /// Nothing, and nothing that appears meanwhile may be written over.
    Nothing,
    /// A file that may be written over, by its own path.
    File(PathBuf),
    /// A link to nothing, which may be replaced.
    Link,
    /// A pipe or a device.
    Device,
}

impl Output {
    /// A place where only results of the same kind are written over.
    pub fn new(path: impl AsRef<Path>) -> Self {
        Self {
            path: path.as_ref().to_owned(),
            replace: false,
            inputs: Vec::new(),
        }
    }

    /// Whether any file there may be written over.
    #[must_use]
    pub fn replacing(mut self, replace: bool) -> Self {
        self.replace = replace;
        self
    }

    /// The same, but these files are not written over either: they are inputs of the run.
    #[must_use]
    pub fn sparing(mut self, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Self {
        self.inputs
            .extend(inputs.into_iter().map(|p| p.as_ref().to_owned()));
        self
    }

    /// The place.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether any file there may be written over.
    pub fn replaces(&self) -> bool {
        self.replace
    }

    /// A place in the folder at this place, by the same rule.
    #[must_use]
    pub fn join(&self, name: impl AsRef<Path>) -> Self {
        Self {
            path: self.path.join(name),
            ..self.clone()
        }
    }

    /// Whether a file of this content may be written here.
    ///
    /// # Errors
    /// [`IoError::Exists`] says what is there instead; [`IoError::Foreign`] if it is a folder.
    pub fn admit(&self, content: &Content) -> Result<(), IoError> {
        self.there(content).map(|_| ())
    }

    /// What is there, if a file of this content may be written here.
    pub(super) fn there(&self, content: &Content) -> Result<There, IoError> {
        let path = &self.path;
        let exists = |what: String| IoError::Exists {
            path: path.clone(),
            what,
        };
        let found = match fs::metadata(path) {
            Ok(found) => found,
            Err(e) if e.kind() == io::ErrorKind::NotFound => {
                return match fs::symlink_metadata(path) {
                    Ok(_) if self.replace => Ok(There::Link),
                    Ok(_) => Err(exists("is a link to a file that does not exist".to_owned())),
                    Err(_) => Ok(There::Nothing),
                };
            }
            Err(e) => return Err(IoError::write(path, e)),
        };
        if found.is_dir() {
            return Err(IoError::Foreign {
                path: path.clone(),
                what: "is a folder, not a file".to_owned(),
            });
        }
        if !found.is_file() {
            return Ok(There::Device);
        }
        let place = fs::canonicalize(path).map_err(|e| IoError::write(path, e))?;
        if self.replace {
            return Ok(There::File(place));
        }
        if self.inputs.iter().any(|input| is_same(input, &found)) {
            return Err(exists("is an input of this run".to_owned()));
        }
        let held = Content::of_file(path).map_err(|e| IoError::read(path, e))?;
        if held == Content::Empty || held == *content && held.is_made() {
            return Ok(There::File(place));
        }
        Err(exists(format!("is {}", held.words())))
    }
}

/// Whether a path leads to a file, by whatever name or link.
fn is_same(path: &Path, file: &Metadata) -> bool {
    fs::metadata(path).is_ok_and(|other| same(&other, file))
}

/// Whether both describe one file.
#[cfg(unix)]
pub(super) fn same(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

/// Whether both may describe one file: this system gives files no numbers.
#[cfg(not(unix))]
pub(super) fn same(a: &Metadata, b: &Metadata) -> bool {
    a.is_file() == b.is_file()
        && a.len() == b.len()
        && a.created().ok() == b.created().ok()
        && a.modified().ok() == b.modified().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &[u8] = b"schema_version = 1\n[scanner]\npreset = \"ust-20lx\"\n";
    const SCORE: &[u8] = b"{\"schema_version\":1,\"method\":\"joint\",\"verdict\":\"pass\"}\n";

    fn refused(output: &Output, content: &Content) -> String {
        let error = output.admit(content).expect_err("refused");
        assert_eq!(error.exit_code(), 2);
        error.to_string()
    }

    #[test]
    fn only_results_of_the_same_kind_are_written_over() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            fs::write(&path, bytes).expect("written");
            Output::new(path)
        };
        let scene = at("mine.toml", SCENE);
        assert!(refused(&scene, &Content::Scene).contains("mine.toml exists already and is a scene; "));
        let score = at("score.json", SCORE);
        score.admit(&Content::Score).expect("the same kind");
        assert!(refused(&score, &Content::Calibration).contains("already and is a score; "));
        let input = score.clone().sparing([folder.path().join("score.json")]);
        assert!(refused(&input, &Content::Score).contains("is an input of this run"));
        at("empty.json", b"")
            .admit(&Content::Score)
            .expect("nothing is lost");
        let letter = at("letter", b"Dear all,\n");
        assert!(refused(&letter, &Content::Unknown).contains("did not write"));
        for output in [scene, score, input, letter] {
            output.replacing(true).admit(&Content::Page).expect("asked for");
        }
        let there = Output::new(folder.path());
        assert!(refused(&there.replacing(true), &Content::Page).contains("is a folder"));
        Output::new(folder.path().join("new"))
            .admit(&Content::Page)
            .expect("nothing there");
    }

    #[cfg(unix)]
    #[test]
    fn links_of_both_kinds_lead_to_the_same_input() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        fs::write(at("in.json"), SCORE).expect("written");
        std::os::unix::fs::symlink(at("in.json"), at("soft")).expect("linked");
        fs::hard_link(at("in.json"), at("hard")).expect("linked");
        for name in ["in.json", "soft", "hard"] {
            let output = Output::new(at(name)).sparing([at("in.json")]);
            assert!(
                refused(&output, &Content::Score).contains("is an input"),
                "{name}"
            );
        }
        std::os::unix::fs::symlink(at("nowhere"), at("dangling")).expect("linked");
        assert!(refused(&Output::new(at("dangling")), &Content::Score).contains("is a link"));
    }
}
