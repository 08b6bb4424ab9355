//! Paths: the folder of a file, and quoting for the shell in printed or recorded commands.

use std::path::Path;

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
