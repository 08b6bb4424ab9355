//! What a killed run left behind is removed by the next one that writes to the same folder.
//!
//! Every temporary file and folder is locked by the run that fills it, and the system releases the lock when that run
//! ends, however it ends. So one that can be locked belongs to nobody: it is removed. One that cannot be locked is in use,
//! or lies on a system without locks, and stays.

use super::output::same;
use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use tempfile::{NamedTempFile, TempDir};

/// What the names of temporary files and folders contain.
const MARK: &str = ".partial-catoptric-";

/// Number of random characters behind the mark.
const RANDOM: usize = 6;

/// Name of the folder with the files in a temporary folder.
pub(super) const NEW: &str = "new";

/// Name of the earlier folder in a temporary folder, while it is being replaced in two steps.
pub(super) const OLD: &str = "old";

/// A temporary folder and its lock, which is released after the folder is gone.
#[derive(Debug)]
pub(super) struct Staging {
    pub(super) folder: TempDir,
    _lock: Option<File>,
}

/// Creates a locked temporary file in a folder.
pub(super) fn file_in(folder: &Path) -> io::Result<NamedTempFile> {
    clear(folder);
    let mut builder = tempfile::Builder::new();
    builder.prefix(MARK).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        // Temporary files are private by default; this one gets the ordinary permissions under the user's mask.
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    loop {
        let file = builder.tempfile_in(folder)?;
        if is_held(file.as_file(), file.path()) {
            return Ok(file);
        }
    }
}

/// Creates a locked temporary folder beside a folder of this name that is to be written.
pub(super) fn folder_in(above: &Path, name: &str) -> io::Result<Staging> {
    clear(above);
    let prefix = format!(".{name}{MARK}");
    loop {
        let mut builder = tempfile::Builder::new();
        let folder = builder.prefix(&prefix).rand_bytes(RANDOM).tempdir_in(above)?;
        // Not every system can open a folder; on those, leftovers stay.
        let Ok(lock) = File::open(folder.path()) else {
            return Ok(Staging { folder, _lock: None });
        };
        if is_held(&lock, folder.path()) {
            let lock = Some(lock);
            return Ok(Staging { folder, _lock: lock });
        }
    }
}

/// Locks something just created. Another run may have locked it before, to remove it as a leftover.
fn is_held(lock: &File, path: &Path) -> bool {
    match lock.try_lock() {
        Ok(()) => path.exists(),
        Err(TryLockError::WouldBlock) => false,
        Err(TryLockError::Error(_)) => true,
    }
}

/// Removes what killed runs left in a folder, once in the life of a process.
pub(super) fn clear(folder: &Path) {
    static CLEARED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    let Ok(real) = folder.canonicalize() else { return };
    if CLEARED
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .insert(real.clone())
    {
        clear_now(&real);
    }
}

/// Removes what killed runs left in a folder. What the system refuses to remove stays: it hinders nobody.
fn clear_now(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let Some((before, random)) = name.to_str().and_then(|name| name.rsplit_once(MARK)) else {
            continue;
        };
        let ours = random.len() == RANDOM && random.bytes().all(|b| b.is_ascii_alphanumeric());
        let Ok(kind) = entry.file_type() else { continue };
        let path = entry.path();
        match before.strip_prefix('.') {
            Some(of) if ours && kind.is_dir() => {
                if let Some(_lock) = abandoned(&path, File::options().read(true)) {
                    restore(&path.join(OLD), &folder.join(of));
                    let _ = fs::remove_dir_all(&path);
                }
            }
            None if ours && before.is_empty() && kind.is_file() => {
                if let Some(_lock) = abandoned(&path, File::options().read(true).write(true)) {
                    let _ = fs::remove_file(&path);
                }
            }
            _ => {}
        }
    }
}

/// The lock of a leftover; none if a run still holds it, or it was published or removed meanwhile.
fn abandoned(path: &Path, how: &fs::OpenOptions) -> Option<File> {
    let lock = how.open(path).ok()?;
    lock.try_lock().ok()?;
    let (opened, there) = (lock.metadata().ok()?, fs::symlink_metadata(path).ok()?);
    same(&opened, &there).then_some(lock)
}

/// Puts an earlier folder back whose replacement was cut off between two steps.
fn restore(old: &Path, place: &Path) {
    if old.is_dir() && fs::symlink_metadata(place).is_err() {
        let _ = fs::rename(old, place);
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("folder").flatten();
        let mut names: Vec<String> = entries
            .map(|e| e.file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    #[test]
    fn leftovers_are_removed_and_what_is_in_use_stays() {
        let folder = tempfile::tempdir().expect("folder");
        let at = |name: &str| folder.path().join(name);
        let live = file_in(folder.path()).expect("created");
        let staging = folder_in(folder.path(), "data").expect("created");
        fs::write(at(".partial-catoptric-abc123"), "half").expect("written");
        fs::create_dir_all(at(".data.partial-catoptric-abc123/new")).expect("created");
        // Names that only resemble ours are not ours.
        let kept = [
            ".partial-catoptric-abc",
            ".partial-catoptric-abc-12",
            "x.partial-catoptric-abc123",
            ".partial-notes",
        ];
        for name in kept {
            fs::write(at(name), "mine").expect("written");
        }
        fs::create_dir(at("data")).expect("created");
        clear_now(folder.path());
        let mut expected: Vec<String> = kept.map(str::to_owned).to_vec();
        for path in [live.path(), staging.folder.path()] {
            expected.push(path.file_name().expect("a name").to_string_lossy().into_owned());
        }
        expected.push("data".to_owned());
        expected.sort();
        assert_eq!(names(folder.path()), expected);
    }

    #[test]
    fn a_replacement_cut_off_in_between_is_undone() {
        let folder = tempfile::tempdir().expect("folder");
        let left = folder.path().join(".data.partial-catoptric-abc123");
        fs::create_dir_all(left.join(OLD)).expect("created");
        fs::create_dir_all(left.join(NEW)).expect("created");
        fs::write(left.join(OLD).join("a"), "earlier").expect("written");
        clear_now(folder.path());
        assert_eq!(names(folder.path()), ["data"]);
        assert_eq!(fs::read(folder.path().join("data/a")).expect("there"), b"earlier");
    }
}
