//! Atomic writing of one file: it is written next to its destination, flushed to disk, then renamed.

use super::error::IoError;
use super::json::to_json;
use super::paths::parent;
use catoptric_model::Stop;
use serde::Serialize;
use sha2::{Digest, Sha256};
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;

/// Writes a file completely or not at all, replacing any existing file.
///
/// Links are followed; a pipe or a device, which cannot be replaced, is written to directly.
///
/// # Errors
/// [`IoError`] if the system refuses; then the file is unchanged and no temporary file is left.
///
/// ```
/// let folder = tempfile::tempdir()?;
/// let path = folder.path().join("note.txt");
/// catoptric_files::write_file(&path, b"one scan")?;
/// assert_eq!(std::fs::read(&path)?, b"one scan");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_file(path: impl AsRef<Path>, bytes: &[u8]) -> Result<(), IoError> {
    let path = path.as_ref();
    let fail = |e| IoError::write(path, e);
    match fs::metadata(path) {
        Ok(there) if there.is_file() => replace(&fs::canonicalize(path).map_err(fail)?, bytes).map_err(fail),
        Ok(there) if there.is_dir() => Err(fail(io::ErrorKind::IsADirectory.into())),
        Ok(_) => write_through(path, bytes).map_err(fail),
        Err(e) if e.kind() == io::ErrorKind::NotFound => replace(path, bytes).map_err(fail),
        Err(e) => Err(fail(e)),
    }
}

/// Writes a temporary file in the same folder and renames it.
fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = temporary(parent(path))?;
    file.write_all(bytes)?;
    place(file, path)
}

/// Flushes a temporary file to disk and renames it.
fn place(file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.as_file().sync_all()?;
    file.persist(path).map_err(|e| e.error)?;
    sync_folder(parent(path));
    Ok(())
}

fn temporary(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".partial-");
    #[cfg(unix)]
    {
        // Temporary files are private by default; this one gets the ordinary permissions under the user's mask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
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
    Staged(BufWriter<NamedTempFile>),
    Direct(BufWriter<File>),
}

impl StagedOutput {
    /// Begins a file; an existing one remains until [`finish`](Self::finish).
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn create(path: impl AsRef<Path>) -> Result<Self, IoError> {
        let shown = path.as_ref().to_owned();
        let fail = |e| IoError::write(&shown, e);
        let (place, direct) = match fs::metadata(&shown) {
            Ok(there) if there.is_file() => (fs::canonicalize(&shown).map_err(fail)?, false),
            Ok(there) if there.is_dir() => return Err(fail(io::ErrorKind::IsADirectory.into())),
            Ok(_) => (shown.clone(), true),
            Err(e) if e.kind() == io::ErrorKind::NotFound => (shown.clone(), false),
            Err(e) => return Err(fail(e)),
        };
        let target = if direct {
            let file = File::options().write(true).open(&place).map_err(fail)?;
            Target::Direct(BufWriter::new(file))
        } else {
            Target::Staged(BufWriter::new(temporary(parent(&place)).map_err(fail)?))
        };
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
            Target::Staged(file) => file.write_all(bytes),
            Target::Direct(file) => file.write_all(bytes),
        }
        .map_err(|e| IoError::write(&self.shown, e))
    }

    /// Overwrites the beginning of a file, which must not be a pipe; nothing may be appended afterwards.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses.
    pub fn rewrite_start(&mut self, bytes: &[u8]) -> Result<(), IoError> {
        let rewritten = match &mut self.target {
            Target::Staged(file) => file.rewind().and_then(|()| file.write_all(bytes)),
            Target::Direct(_) => Err(io::ErrorKind::NotSeekable.into()),
        };
        rewritten.map_err(|e| IoError::write(&self.shown, e))
    }

    /// Ends the file and moves it to its destination.
    ///
    /// # Errors
    /// [`IoError`] if the system refuses; then no part of it is left.
    pub fn finish(self) -> Result<(), IoError> {
        let ended = match self.target {
            Target::Staged(file) => match file.into_inner() {
                Ok(file) => place(file, &self.place),
                Err(e) => Err(e.into_error()),
            },
            Target::Direct(mut file) => file.flush(),
        };
        ended.map_err(|e| IoError::write(&self.shown, e))
    }
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::options().write(true).open(path)?;
    file.write_all(bytes)?;
    file.flush()
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
pub fn write_json(path: impl AsRef<Path>, value: &impl Serialize) -> Result<(), IoError> {
    let path = path.as_ref();
    write_file(path, &to_json(path, value)?)
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
    let mut file = File::open(path)?;
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
        write_json(&path, &[2.5, f64::INFINITY]).expect("written again");
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
        assert!(matches!(error, IoError::Write { .. }));
        let error = read_json::<u8>(folder.path().join("none.json")).expect_err("no file");
        assert!(matches!(error, IoError::Read { .. }));
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
