//! Atomic writing of one folder: it is filled next to its destination, flushed to disk, then renamed.
//!
//! An earlier folder and the new one change places in one step where the system can do that, as Linux can: at no moment is
//! there neither. Elsewhere the earlier one is moved away first; if the run is killed just then, the next one that writes
//! there moves it back.

use super::content::Content;
use super::error::IoError;
use super::file::sync_folder;
use super::leftovers::{self, NEW, OLD, Staging, folder_in};
use super::output::Output;
use super::paths::parent;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// What exists at the destination of a folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Occupant {
    /// Nothing, or an empty folder.
    Nothing,
    /// A folder that may be replaced on request.
    Replaceable,
}

/// A folder being filled. It is deleted if dropped before [`publish`](Self::publish).
#[derive(Debug)]
pub struct StagedFolder {
    /// Holds the new folder, and, during a replacement, the earlier one.
    staging: Staging,
    out: PathBuf,
    occupant: Occupant,
}

/// A temporary folder of a run, removed with all that is in it; if the run is killed, by the next one that needs one.
#[derive(Debug)]
pub struct WorkFolder(Staging);

impl WorkFolder {
    /// Creates a folder for some work among the system's temporary files.
    ///
    /// # Errors
    /// The error of the system.
    pub fn create(work: &str) -> io::Result<Self> {
        folder_in(&std::env::temp_dir(), work).map(Self)
    }

    /// Its path.
    pub fn path(&self) -> &Path {
        self.0.folder.path()
    }
}

/// Removes the unfinished files of killed runs from a folder. Every writer does so; this is for who looks what is there
/// before he writes.
pub fn clear_leftovers(folder: &Path) {
    leftovers::clear(folder);
}

/// A file in a folder being filled.
#[derive(Debug)]
pub struct StagedFile {
    file: BufWriter<File>,
    shown: PathBuf,
}

impl StagedFolder {
    /// Begins a folder that will appear at `out`. Missing parent folders are created.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn create(out: &Path, occupant: Occupant) -> Result<Self, IoError> {
        let name = out.file_name().ok_or_else(|| IoError::Foreign {
            path: out.to_owned(),
            what: "is no name for a folder of its own".to_owned(),
        })?;
        let above = parent(out);
        fs::create_dir_all(above).map_err(|e| IoError::write(above, e))?;
        let staging = folder_in(above, &name.to_string_lossy());
        let staged = Self {
            staging: staging.map_err(|e| IoError::write(out, e))?,
            out: out.to_owned(),
            occupant,
        };
        // A nested folder: the temporary one is private to its owner, the published one is not.
        fs::create_dir(staged.root()).map_err(|e| IoError::write(out, e))?;
        Ok(staged)
    }

    /// Temporary location of the files until the folder is published.
    fn root(&self) -> PathBuf {
        self.staging.folder.path().join(NEW)
    }

    /// Final path of a file, used in errors.
    pub fn shown(&self, relative: &str) -> PathBuf {
        self.out.join(relative)
    }

    /// Opens a new file; missing parent folders are created.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn open(&self, relative: &str) -> Result<StagedFile, IoError> {
        let shown = self.shown(relative);
        let path = self.root().join(relative);
        let open = || {
            fs::create_dir_all(parent(&path))?;
            File::create_new(&path)
        };
        let file = BufWriter::new(open().map_err(|e| IoError::write(&shown, e))?);
        Ok(StagedFile { file, shown })
    }

    /// Writes a new file.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn write(&self, relative: &str, bytes: &[u8]) -> Result<(), IoError> {
        let mut file = self.open(relative)?;
        file.write_all(bytes)
            .map_err(|e| IoError::write(&file.shown, e))?;
        file.finish()
    }

    /// Whether a file was written already.
    pub fn has(&self, relative: &str) -> bool {
        self.root().join(relative).exists()
    }

    /// All files so far, ordered by name: name with forward slashes, and temporary path.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn files(&self) -> Result<Vec<(String, PathBuf)>, IoError> {
        list(&self.root()).map_err(|e| IoError::read(&self.out, e))
    }

    /// Moves the folder to its destination. Every file was flushed to disk when it was finished.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses; then the earlier folder is restored.
    pub fn publish(self) -> Result<(), IoError> {
        let fail = |e| IoError::write(&self.out, e);
        match self.occupant {
            Occupant::Replaceable if exchanged(&self.root(), &self.out) => {}
            Occupant::Replaceable => return self.publish_in_two_steps(),
            Occupant::Nothing => {
                if self.out.is_dir() {
                    fs::remove_dir(&self.out).map_err(fail)?; // fails unless it is still empty
                }
                fs::rename(self.root(), &self.out).map_err(fail)?;
            }
        }
        sync_folder(parent(&self.out));
        Ok(())
    }

    fn publish_in_two_steps(mut self) -> Result<(), IoError> {
        let old = self.staging.folder.path().join(OLD);
        fs::rename(&self.out, &old).map_err(|e| IoError::write(&self.out, e))?;
        if let Err(error) = fs::rename(self.root(), &self.out) {
            if fs::rename(&old, &self.out).is_err() {
                // A folder under a strange name is better than a lost one.
                self.staging.folder.disable_cleanup(true);
                return Err(IoError::write(old, error));
            }
            return Err(IoError::write(&self.out, error));
        }
        sync_folder(parent(&self.out));
        Ok(())
    }
}

/// Lets two folders change places in one step; false if the system cannot do that.
#[cfg(target_os = "linux")]
fn exchanged(a: &Path, b: &Path) -> bool {
    use rustix::fs::{CWD, RenameFlags, renameat_with};
    renameat_with(CWD, a, CWD, b, RenameFlags::EXCHANGE).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn exchanged(_: &Path, _: &Path) -> bool {
    false
}

/// The files that a verb writes as one folder; by them an earlier folder of the same verb is recognized.
#[derive(Debug, Clone)]
pub struct FolderKind {
    /// What the folder holds, as in "holds a layout".
    pub what: &'static str,
    /// The file that every such folder has.
    pub result: (&'static str, Content),
    /// Whether a file of this name below the folder, with this content, is one of them.
    pub owns: fn(&str, &Content) -> bool,
}

impl FolderKind {
    /// Begins a folder of this kind. One that exists is replaced as a whole: nothing of an earlier result stays in it.
    ///
    /// # Errors
    /// As [`admit`](Self::admit), and [`IoError`] if the system refuses.
    pub fn create(&self, out: &Output) -> Result<StagedFolder, IoError> {
        StagedFolder::create(out.path(), self.admit(out)?)
    }

    /// What exists at a place where a folder of this kind is to be written.
    ///
    /// # Errors
    /// [`IoError::Exists`] if it is replaced only on request: it holds scenes, which a person may have changed.
    /// [`IoError::Foreign`] if it holds anything that would be lost.
    pub fn admit(&self, out: &Output) -> Result<Occupant, IoError> {
        let path = out.path().to_owned();
        let Some(files) = files_there(&path)? else {
            return Ok(Occupant::Nothing);
        };
        let foreign = |what: String| IoError::Foreign {
            path: path.clone(),
            what,
        };
        let mut has_result = false;
        let mut scene = None;
        for (name, file) in &files {
            let content = Content::of_file(file).map_err(|e| IoError::read(file, e))?;
            if !(self.owns)(name, &content) {
                return Err(foreign(format!(
                    "holds {name}, which would be lost with the folder: {} is written as a folder of its own",
                    self.what
                )));
            }
            has_result |= *name == self.result.0 && content == self.result.1;
            if content == Content::Scene {
                scene = Some(name);
            }
        }
        if !has_result {
            return Err(foreign(format!("holds files, but no {}", self.result.0)));
        }
        match scene {
            Some(scene) if !out.replaces() => Err(IoError::Exists {
                what: format!("holds {} with scenes, such as {scene}", self.what),
                path,
            }),
            _ => Ok(Occupant::Replaceable),
        }
    }
}

/// The files of a folder; none if it does not exist or is empty.
fn files_there(path: &Path) -> Result<Option<Vec<(String, PathBuf)>>, IoError> {
    let foreign = |what: &str| IoError::Foreign {
        path: path.to_owned(),
        what: what.to_owned(),
    };
    match fs::symlink_metadata(path) {
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(e) => return Err(IoError::read(path, e)),
        Ok(there) if there.is_symlink() => return Err(foreign("is a link")),
        Ok(there) if !there.is_dir() => return Err(foreign("is a file, not a folder")),
        Ok(_) => {}
    }
    let mut entries = fs::read_dir(path).map_err(|e| IoError::read(path, e))?;
    if entries.next().is_none() {
        return Ok(None);
    }
    list(path).map(Some).map_err(|e| IoError::read(path, e))
}

impl StagedFile {
    /// Flushes the file to disk.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses. Dropping the file instead may truncate it silently.
    pub fn finish(mut self) -> Result<(), IoError> {
        let synced = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        synced.map_err(|e| IoError::write(&self.shown, e))
    }
}

impl Write for StagedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// All files below a folder, ordered by name: name with forward slashes, and path.
pub(super) fn list(root: &Path) -> io::Result<Vec<(String, PathBuf)>> {
    let mut found = Vec::new();
    let mut folders = vec![(String::new(), root.to_owned())];
    while let Some((prefix, folder)) = folders.pop() {
        for entry in fs::read_dir(folder)? {
            let entry = entry?;
            let name = format!("{prefix}{}", entry.file_name().to_string_lossy());
            if entry.file_type()?.is_dir() {
                folders.push((name + "/", entry.path()));
            } else {
                found.push((name, entry.path()));
            }
        }
    }
    found.sort_unstable();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KIND: FolderKind = FolderKind {
        what: "a layout",
        result: ("layout.json", Content::Layout),
        owns: |name, content| match content {
            Content::Layout => name == "layout.json",
            Content::Svg => true,
            Content::Scene => name == "best.toml",
            _ => false,
        },
    };
    const LAYOUT: &[u8] = b"{\"schema_version\":1,\"layouts\":[]}";

    fn publish(out: &Output, files: &[&str]) -> Result<(), IoError> {
        let folder = KIND.create(out)?;
        folder.write("layout.json", LAYOUT)?;
        for name in files {
            folder.write(name, b"<svg />")?;
        }
        folder.publish()
    }

    #[test]
    fn nothing_of_an_earlier_folder_stays_and_nothing_foreign_is_lost() {
        let place = tempfile::tempdir().expect("folder");
        let path = place.path().join("layout");
        let out = Output::new(&path);
        publish(&out, &["a.svg", "b.svg"]).expect("new");
        publish(&out, &["c.svg"]).expect("an earlier one");
        let names: Vec<String> = list(&path)
            .expect("there")
            .into_iter()
            .map(|(name, _)| name)
            .collect();
        assert_eq!(names, ["c.svg", "layout.json"]);
        assert_eq!(fs::read_dir(place.path()).expect("there").count(), 1);

        fs::write(path.join("best.toml"), "[scanner]\n").expect("written");
        let error = publish(&out, &[]).expect_err("a scene");
        assert!(matches!(error, IoError::Exists { .. }), "{error}");
        publish(&out.clone().replacing(true), &[]).expect("asked for");

        fs::write(path.join("notes.txt"), "mine").expect("written");
        let error = publish(&out.clone().replacing(true), &[]).expect_err("notes");
        assert!(error.to_string().contains("holds notes.txt"), "{error}");
        fs::remove_file(path.join("notes.txt")).expect("removed");
        fs::remove_file(path.join("layout.json")).expect("removed");
        fs::write(path.join("a.svg"), "<svg />").expect("written");
        let error = publish(&out.replacing(true), &[]).expect_err("no result");
        assert!(error.to_string().contains("no layout.json"), "{error}");
        assert_eq!(fs::read(path.join("a.svg")).expect("there"), b"<svg />");
    }

    #[test]
    fn two_steps_replace_as_one_does() {
        let place = tempfile::tempdir().expect("folder");
        let out = Output::new(place.path().join("layout"));
        publish(&out, &["a.svg"]).expect("new");
        let folder = KIND.create(&out).expect("an earlier one");
        folder.write("layout.json", LAYOUT).expect("written");
        folder.publish_in_two_steps().expect("replaced");
        assert_eq!(list(out.path()).expect("there").len(), 1);
        assert_eq!(fs::read_dir(place.path()).expect("there").count(), 1);
    }
}
