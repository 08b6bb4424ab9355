//! Paths: the folder of a file, and quoting for the shell in printed or recorded commands.

use catoptric_model::place::nearest;
use std::io;
use std::path::{Path, PathBuf};

/// A path quoted for the shell.
///
/// ```
/// use catoptric_files::paths::quoted;
/// assert_eq!(quoted("a/b.toml".as_ref()), "a/b.toml");
/// assert_eq!(quoted("my scene's".as_ref()), r"'my scene'\''s'");
/// ```
pub fn quoted(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/\\._-+:".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}

/// The folder that contains a file.
pub(super) fn parent(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Names in a folder that are looked through for the one that was meant.
const LOOKED_THROUGH: usize = 10_000;

/// Question about the file or folder that was probably meant by a missing one: if folders of its path are missing too, the
/// outermost.
pub(super) fn similar(path: &Path, error: &io::Error) -> Option<String> {
    if error.kind() != io::ErrorKind::NotFound {
        return None;
    }
    let missing = path
        .ancestors()
        .filter(|p| !p.as_os_str().is_empty() && !p.exists())
        .last()?;
    let folder = missing.parent().filter(|p| !p.as_os_str().is_empty());
    let entries = std::fs::read_dir(folder.unwrap_or(Path::new("."))).ok()?;
    let names = entries
        .take(LOOKED_THROUGH)
        .filter_map(|e| e.ok()?.file_name().into_string().ok());
    let mut names: Vec<String> = names.collect();
    names.sort();
    let near = nearest(missing.file_name()?.to_str()?, names.iter().map(String::as_str))?;
    let meant = folder.map_or_else(|| PathBuf::from(near), |f| f.join(near));
    Some(format!("did you mean {}?", quoted(&meant)))
}

/// The error in reading a file that people name, with the one that was probably meant.
pub(super) fn unread(path: &Path, error: io::Error) -> io::Error {
    match similar(path, &error) {
        Some(help) => io::Error::new(error.kind(), format!("{error}; {help}")),
        None => error,
    }
}
