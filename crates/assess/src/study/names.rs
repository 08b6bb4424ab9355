//! The files of a study in its folder, by their names.

use super::StudyError;
use catoptric_files::IoError;
use std::path::Path;

/// File name of the result.
pub const RESULT: &str = "study.json";
/// File name of the plan.
pub const PLAN: &str = "plan.json";
/// File name of the page.
pub const PAGE: &str = "report.html";
/// File name of the table of the scatter of elements.
pub const SPREAD: &str = "spread.csv";

/// Removes the files of a study from a folder, and nothing else; its plan, by which it is recognized, last.
///
/// # Errors
/// [`StudyError::File`] if a file cannot be removed.
pub(super) fn remove_study(folder: &Path) -> Result<(), StudyError> {
    let entries = std::fs::read_dir(folder).map_err(|e| IoError::read(folder, e))?;
    let mut names = Vec::new();
    for entry in entries {
        let entry = entry.map_err(|e| IoError::read(folder, e))?;
        names.push(entry.file_name().to_string_lossy().into_owned());
    }
    names.retain(|name| is_table(name) || [RESULT, SPREAD, PAGE].contains(&name.as_str()));
    names.push(PLAN.to_owned());
    for name in names {
        let path = folder.join(name);
        std::fs::remove_file(&path).map_err(|e| IoError::write(path, e))?;
    }
    Ok(())
}

/// Whether a file of this name is a table of runs, of all or of a chunk.
fn is_table(name: &str) -> bool {
    let Some(stem) = name.strip_suffix(".csv") else {
        return false;
    };
    ["runs", "elements", "times"].iter().any(|kind| {
        stem.strip_prefix(kind).is_some_and(|rest| {
            let number = rest.strip_prefix('-');
            rest.is_empty() || number.is_some_and(|n| n.len() >= 6 && n.bytes().all(|b| b.is_ascii_digit()))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_recognized_by_their_names() {
        for name in ["runs.csv", "elements-000012.csv", "times-1000000.csv"] {
            assert!(is_table(name), "{name}");
        }
        for name in [
            "runs-mine.csv",
            "runs-1.csv",
            "runs.txt",
            "my-runs.csv",
            "times-.csv",
        ] {
            assert!(!is_table(name), "{name}");
        }
    }
}
