//! Paths as a shell takes them, for commands that are printed or recorded.

/// A path as a shell takes it.
///
/// ```
/// use catoptric_files::shell::quoted;
/// assert_eq!(quoted("a/b.toml".as_ref()), "a/b.toml");
/// assert_eq!(quoted("my scene's".as_ref()), r"'my scene'\''s'");
/// ```
pub fn quoted(path: &std::path::Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "/\\._-+:".contains(c);
    if !text.is_empty() && text.chars().all(plain) {
        text
    } else {
        format!("'{}'", text.replace('\'', r"'\''"))
    }
}
