//! Atomic writing of one file: it is written next to its destination, flushed to disk, then renamed.

use super::content::Content;
use super::error::IoError;
use super::json::to_json;
use super::leftovers;
use super::output::{Output, There};
use super::paths::parent;
use super::waiting;
use catoptric_model::Stop;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::File;
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes a file completely or not at all.
///
/// An existing file is written over as [`Output`] says. Links are followed; a pipe or a device, which cannot be replaced, is
/// written to directly.
///
/// # Errors
/// [`IoError::Exists`] if something else is there, or the error of the system; then the file is unchanged and no temporary
/// file is left.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("note.txt");
/// catoptric_files::write_file(&path, b"one scan")?;
/// assert_eq!(std::fs::read(&path)?, b"one scan");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_file(out: impl Into<Output>, bytes: &[u8]) -> Result<(), IoError> {
    let mut file = StagedOutput::create(out, &Content::of(bytes))?;
    file.write(bytes)?;
    file.finish()
}

/// Writes several files, none of which appears before all are on disk. They appear in the order given.
///
/// # Errors
/// As [`write_file`], and [`IoError::Foreign`] if two of them have the same place.
pub fn write_files(files: &[(Output, Vec<u8>)]) -> Result<(), IoError> {
    let mut staged: Vec<StagedOutput> = Vec::with_capacity(files.len());
    for (out, bytes) in files {
        let mut file = StagedOutput::create(out.clone(), &Content::of(bytes))?;
        if !file.is_direct() && staged.iter().any(|other| other.place == file.place) {
            return Err(IoError::Foreign {
                path: file.shown,
                what: "would be written twice by this run".to_owned(),
            });
        }
        file.write(bytes)?;
        file.flush()?;
        staged.push(file);
    }
    staged.into_iter().try_for_each(StagedOutput::finish)
}

/// A file written piece by piece, completely or not at all. A pipe or a device receives the pieces directly.
#[derive(Debug)]
pub struct StagedOutput {
    place: PathBuf,
    shown: PathBuf,
    target: Target,
}

#[derive(Debug)]
enum Target {
    Staged {
        file: BufWriter<NamedTempFile>,
        /// Whether something may be there that is replaced.
        replaces: bool,
    },
    Direct(BufWriter<File>),
}

impl StagedOutput {
    /// Begins a file of this content; an existing one remains until [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`IoError`] if the system refuses, or if what is there may not be written over.
    pub fn create(out: impl Into<Output>, content: &Content) -> Result<Self, IoError> {
        let out = out.into();
        let shown = out.path().to_owned();
        let fail = |e| IoError::write(&shown, e);
        let (place, replaces) = match out.there(content)? {
            There::Nothing => (shown.clone(), false),
            There::Link => (shown.clone(), true),
            There::File(place) => (place, true),
            There::Device => {
                let file = File::options().write(true).open(&shown).map_err(fail)?;
                return Ok(Self {
                    place: shown.clone(),
                    target: Target::Direct(BufWriter::new(file)),
                    shown,
                });
            }
        };
        let file = leftovers::file_in(parent(&place)).map_err(fail)?;
        let file = BufWriter::new(file);
        let target = Target::Staged { file, replaces };
        Ok(Self { place, shown, target })
    }

    /// Whether the pieces go to a pipe or a device, which cannot be rewritten.
    pub fn is_direct(&self) -> bool {
        matches!(self.target, Target::Direct(_))
    }

    /// Appends bytes.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn write(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        match &mut self.target {
            Target::Staged { file, .. } => file.write_all(bytes),
            Target::Direct(file) => file.write_all(bytes),
        }
        .map_err(|e| IoError::write(&self.shown, e))
    }

    /// Flushes what was written to disk.
    fn flush(&mut self) -> Result<(), IoError> {
        let flushed = match &mut self.target {
            Target::Staged { file, .. } => file.flush().and_then(|()| file.get_ref().as_file().sync_all()),
            Target::Direct(file) => file.flush(),
        };
        flushed.map_err(|e| IoError::write(&self.shown, e))
    }

    /// Overwrites the beginning of a file, which must not be a pipe; nothing may be appended afterwards.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn rewrite_start(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        let rewritten = match &mut self.target {
            Target::Staged { file, .. } => file.rewind().and_then(|()| file.write_all(bytes)),
            Target::Direct(_) => Err(io::ErrorKind::NotSeekable.into()),
        };
        rewritten.map_err(|e| IoError::write(&self.shown, e))
    }

    /// Ends the file and moves it to its destination.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses, or if something appeared there meanwhile; then no part of it is left.
    pub fn finish(mut self) -> Result<(), IoError> {
        self.flush()?;
        let Self { place, shown, target } = self;
        let Target::Staged { file, replaces } = target else {
            return Ok(());
        };
        let fail = |e| IoError::write(&shown, e);
        let file = file.into_inner().map_err(|e| fail(e.into_error()))?;
        let file = if replaces {
            Err(file)
        } else {
            match file.persist_noclobber(&place) {
                Ok(_) => Ok(()),
                Err(error) if error.error.kind() == io::ErrorKind::AlreadyExists => {
                    return Err(IoError::Exists {
                        path: shown,
                        what: "appeared while this run was going on".to_owned(),
                    });
                }
                // Not every file system can do that.
                Err(error) => Err(error.file),
            }
        };
        if let Err(file) = file {
            file.persist(&place).map_err(|e| fail(e.error))?;
        }
        sync_folder(parent(&place));
        Ok(())
    }
}

/// Flushes a rename to disk.
pub(super) fn sync_folder(folder: &Path) {
    // Not every system can open a folder; on those, the rename reaches the disk later.
    if let Ok(folder) = File::open(folder) {
        let _ = folder.sync_all();
    }
}

/// Writes a value as JSON, completely or not at all; numbers that are not finite become null.
///
/// # Errors
/// [`IoError`] as [`write_file`] and [`to_json`].
pub fn write_json(out: impl Into<Output>, value: &impl Serialize) -> Result<(), IoError> {
    let out = out.into();
    let bytes = to_json(out.path(), value)?;
    write_file(out, &bytes)
}

/// SHA-256 of some bytes, in hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    hexadecimal(&Sha256::digest(bytes))
}

/// SHA-256 of a file, in hexadecimal.
///
/// # Errors
/// The error of the operating system if it cannot be read.
/// Once a stop is requested, it ends with an error.
pub(super) fn sha256_file(path: &Path, stop: &Stop) -> io::Result<String> {
    let mut hasher = Sha256::new();
    let mut file = waiting::open(path)?;
    let mut buffer = vec![0; 1 << 16];
    loop {
        stop.check().map_err(io::Error::other)?;
        match io::Read::read(&mut file, &mut buffer)? {
            0 => return Ok(hexadecimal(&hasher.finalize())),
            n => hasher.update(&buffer[..n]),
        }
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_json;
    use std::fs;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("folder");
        let name = |e: io::Result<fs::DirEntry>| e.expect("entry").file_name().to_string_lossy().into_owned();
        entries.map(name).collect()
    }

    #[test]
    fn a_file_is_replaced_without_leftovers() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.json");
        write_json(&path, &[1.0, f64::NAN]).expect("written");
        let error = write_json(&path, &[2.5]).expect_err("it is no result of ours");
        assert!(matches!(error, IoError::Exists { .. }), "{error}");
        write_json(Output::new(&path).replacing(true), &[2.5, f64::INFINITY]).expect("written again");
        let back: Vec<Option<f64>> = read_json(&path).expect("read");
        assert_eq!(back, [Some(2.5), None]);
        assert_eq!(names(folder.path()), ["a.json"]);
    }

    #[test]
    fn failures_name_the_file() {
        let folder = tempfile::tempdir().expect("folder");
        let missing = folder.path().join("no/such/place.txt");
        let error = write_file(&missing, b"").expect_err("no folder");
        assert_eq!(error.exit_code(), 3);
        assert!(error.to_string().contains("place.txt"));
        let error = write_file(folder.path(), b"").expect_err("a folder");
        assert!(matches!(error, IoError::Foreign { .. }));
        let error = read_json::<u8>(folder.path().join("none.json")).expect_err("no file");
        assert!(matches!(error, IoError::Read { .. }));
    }

    #[test]
    fn several_files_appear_together_or_not_at_all() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| Output::new(folder.path().join(name));
        let fine = (at("a"), b"a".to_vec());
        let missing = (at("no/such/b"), b"b".to_vec());
        write_files(&[fine.clone(), missing]).expect_err("no folder");
        let error = write_files(&[fine.clone(), fine.clone()]).expect_err("the same place");
        assert!(error.to_string().contains("written twice"), "{error}");
        assert!(names(folder.path()).is_empty());
        write_files(&[fine, (at("b"), b"b".to_vec())]).expect("written");
        assert_eq!(names(folder.path()).len(), 2);
    }

    #[test]
    fn what_appears_meanwhile_is_not_written_over() {
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("a.json");
        let mut file = StagedOutput::create(&path, &Content::Score).expect("nothing there");
        file.write(b"{}").expect("written");
        fs::write(&path, "mine").expect("written");
        let error = file.finish().expect_err("it appeared");
        assert!(matches!(error, IoError::Exists { .. }), "{error}");
        assert_eq!(fs::read(&path).expect("there"), b"mine");
        assert_eq!(names(folder.path()), ["a.json"]);
    }

    /// The device that is always full is used for the disk.
    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_device_is_recognized() {
        let error = write_file("/dev/full", b"x").expect_err("full");
        assert!(matches!(error, IoError::DiskFull { .. }), "{error}");
        write_file("/dev/null", b"x").expect("a device is written to, not replaced");
        assert!(!fs::metadata("/dev/null").expect("still there").is_file());
    }

    #[test]
    fn the_hash_is_sha256() {
        // FIPS 180-2, appendix B.1
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), expected);
        let folder = tempfile::tempdir().expect("folder");
        let path = folder.path().join("abc");
        write_file(&path, b"abc").expect("written");
        assert_eq!(sha256_file(&path, &Stop::default()).expect("read"), expected);
    }
}
