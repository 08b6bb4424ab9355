//! Atomic writing of one folder: it is filled next to its destination, flushed to disk, then renamed.

use super::error::IoError;
use super::file::sync_folder;
use super::paths::parent;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use tempfile::TempDir;

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
    /// Holds `new`, and, during a replacement, `old`.
    staging: TempDir,
    out: PathBuf,
    occupant: Occupant,
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
            what: "a dataset needs a folder of its own",
        })?;
        let above = parent(out);
        fs::create_dir_all(above).map_err(|e| IoError::write(above, e))?;
        let prefix = format!(".{}.partial-", name.to_string_lossy());
        let staging = tempfile::Builder::new().prefix(&prefix).tempdir_in(above);
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
        self.staging.path().join("new")
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
        let old = self.staging.path().join("old");
        if self.occupant == Occupant::Replaceable {
            fs::rename(&self.out, &old).map_err(fail)?;
        } else if self.out.is_dir() {
            fs::remove_dir(&self.out).map_err(fail)?; // fails unless it is still empty
        }
        if let Err(error) = fs::rename(self.root(), &self.out) {
            if old.exists() && fs::rename(&old, &self.out).is_err() {
                // A dataset under a strange name is better than a lost one.
                let kept = self.staging.keep();
                return Err(IoError::write(kept.join("old"), error));
            }
            return Err(fail(error));
        }
        sync_folder(parent(&self.out));
        Ok(())
    }
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
