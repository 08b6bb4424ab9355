//! Errors in reading and writing files. Every message names the file.

use catoptric_model::{ModelError, Stopped};
use std::io;
use std::path::{Path, PathBuf};

/// A file or folder that cannot be read, written or understood.
#[derive(Debug, thiserror::Error)]
pub enum IoError {
    /// The caller stopped the work.
    #[error(transparent)]
    Stopped(#[from] Stopped),
    /// The operating system refused to read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The operating system refused to write.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// The disk, or the user's quota on it, is full, or a file is larger than it may become.
    #[error("{}: cannot be written: {}; nothing half-written was left behind", path.display(), full(source))]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// The operating system's reason.
        source: io::Error,
    },
    /// Something exists already that is replaced only on request.
    #[error("{} exists already and {what}; it was not changed", path.display())]
    Exists {
        /// The file or folder.
        path: PathBuf,
        /// What exists there.
        what: String,
    },
    /// Something exists already that is never touched.
    #[error("{}: {what}; it is left as it is", path.display())]
    Foreign {
        /// The file or folder.
        path: PathBuf,
        /// What exists there instead.
        what: String,
    },
    /// Text that is not valid content for the file.
    #[error("{}:{line}:{column}: {message}", path.display())]
    Text {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
        /// What is wrong, with the key.
        message: String,
    },
    /// Text with several problems.
    #[error("{}", listed(path, faults, *count))]
    Faults {
        /// The file.
        path: PathBuf,
        /// The first of them, in the order of the file.
        faults: Vec<TextFault>,
        /// Number of all.
        count: usize,
    },
    /// A recording that is cut off or corrupt, or holds unexpected messages.
    #[error("{}: {what} (by byte {offset})", path.display())]
    Recording {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        what: String,
        /// Byte offset at which it was detected.
        offset: u64,
    },
    /// A damaged recording of which some can be used.
    #[error("{source}; the other {kept} stretches can be read")]
    Damaged {
        /// The damage.
        source: Box<IoError>,
        /// Number of stretches that are whole.
        kept: usize,
    },
    /// Inconsistent values.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file or folder.
        path: PathBuf,
        /// What is wrong.
        message: String,
    },
    /// Inconsistent parts of a dataset, or an inconsistent dataset and calibration.
    #[error("{}: {source}", path.display())]
    Inconsistent {
        /// The folder or file.
        path: PathBuf,
        /// The inconsistency.
        source: ModelError,
    },
    /// The truth of a dataset that is not known to be blind is missing.
    #[error("{}: {message}", path.display())]
    NoTruth {
        /// The file.
        path: PathBuf,
        /// What is missing.
        message: String,
    },
    /// A file whose SHA-256 is not the one in the manifest.
    #[error("{}: changed since it was written: its SHA-256 is not the one in {}", path.display(), manifest.display())]
    Changed {
        /// The file.
        path: PathBuf,
        /// The manifest.
        manifest: PathBuf,
    },
}

/// One of several problems of a text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TextFault {
    /// Line, from 1.
    pub line: usize,
    /// Column, from 1.
    pub column: usize,
    /// What is wrong, with the key.
    pub message: String,
}

/// A line for each problem, and one for the rest.
fn listed(path: &Path, faults: &[TextFault], count: usize) -> String {
    let line = |f: &TextFault| format!("{}:{}:{}: {}", path.display(), f.line, f.column, f.message);
    let mut lines: Vec<String> = faults.iter().map(line).collect();
    if count > faults.len() {
        lines.push(format!(
            "{}: and {} more problems",
            path.display(),
            count - faults.len()
        ));
    }
    lines.join("\n")
}

impl IoError {
    /// An error in reading.
    pub fn read(path: impl AsRef<Path>, source: io::Error) -> Self {
        let path = path.as_ref().to_owned();
        Self::Read { path, source }
    }

    /// An error in writing; a full disk is a separate variant.
    pub fn write(path: impl AsRef<Path>, source: io::Error) -> Self {
        let path = path.as_ref().to_owned();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge => {
                Self::DiskFull { path, source }
            }
            _ => Self::Write { path, source },
        }
    }

    /// An error in the content as a whole.
    pub fn content(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        Self::Content {
            path: path.as_ref().to_owned(),
            message: message.into(),
        }
    }

    /// An error in a TOML file.
    pub fn toml(path: impl AsRef<Path>, text: &str, error: &toml::de::Error) -> Self {
        let before = text.get(..error.span().map_or(0, |s| s.start)).unwrap_or(text);
        let line_start = before.rfind('\n').map_or(0, |i| i + 1);
        // Without its input, the error names the key instead of printing the line.
        let mut bare = error.clone();
        bare.set_input(None);
        Self::Text {
            path: path.as_ref().to_owned(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            message: bare.to_string().trim_end().replace('\n', " "),
        }
    }

    /// An error in a JSON file.
    pub fn json(path: impl AsRef<Path>, error: &serde_json::Error) -> Self {
        let whole = error.to_string();
        let place = format!(" at line {} column {}", error.line(), error.column());
        Self::Text {
            path: path.as_ref().to_owned(),
            line: error.line().max(1),
            column: error.column().max(1),
            message: whole.strip_suffix(&place).unwrap_or(&whole).to_owned(),
        }
    }

    /// The exit code of a program that ends with this error: 2 if the content of a file is wrong, or an existing file or
    /// folder may not be replaced, 3 if the system could not read or write.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Stopped(_) => 130,
            Self::Text { .. }
            | Self::Faults { .. }
            | Self::Recording { .. }
            | Self::Damaged { .. }
            | Self::Content { .. }
            | Self::Inconsistent { .. }
            | Self::NoTruth { .. }
            | Self::Changed { .. }
            | Self::Exists { .. }
            | Self::Foreign { .. } => 2,
            Self::Read { .. } | Self::Write { .. } | Self::DiskFull { .. } => 3,
        }
    }
}

/// What is full.
fn full(source: &io::Error) -> &'static str {
    match source.kind() {
        io::ErrorKind::FileTooLarge => "the file is larger than the system allows",
        _ => "the disk is full",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_disk_is_a_separate_error() {
        let full = IoError::write("d/f", io::Error::from(io::ErrorKind::StorageFull));
        assert!(matches!(full, IoError::DiskFull { .. }));
        assert!(full.to_string().starts_with("d/f: ") && full.to_string().contains("disk is full"));
        assert_eq!(full.exit_code(), 3);
        let other = IoError::write("d/f", io::Error::from(io::ErrorKind::PermissionDenied));
        assert!(matches!(other, IoError::Write { .. }));
    }

    #[test]
    fn text_errors_have_a_line_and_a_column() {
        let text = "a = 1\nbé = \"x\"\n";
        let error = toml::from_str::<std::collections::BTreeMap<String, u8>>(text).expect_err("not TOML");
        let shown = IoError::toml("s.toml", text, &error).to_string();
        assert!(shown.starts_with("s.toml:2:"), "{shown}");
        let error = serde_json::from_str::<Vec<u8>>("[1,\n \"x\"]").expect_err("not numbers");
        let shown = IoError::json("t.json", &error);
        assert_eq!(shown.exit_code(), 2);
        let shown = shown.to_string();
        assert!(
            shown.starts_with("t.json:2:4: ") && !shown.contains("line"),
            "{shown}"
        );
    }
}
