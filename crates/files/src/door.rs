//! The door of every file that is TOML or JSON: nothing comes in that its type does not allow.
//!
//! A file is read as a tree, checked against the schema of its type (keys, types, limits of every number), converted, and
//! checked against the rules that concern more than one number. Every problem has its line and column.

use super::diagnostic::{Diagnostic, Lines, MOST_SHOWN, Place};
use super::error::{IoError, TextFault};
use super::format;
use super::json::MARK;
use super::tree::{self, Node, Source};
use catoptric_model::place::{KeyPath, Problem};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use serde_json::Value as Json;
use std::path::Path;

/// A type that is read from a file of its own.
pub(super) trait Readable: DeserializeOwned + JsonSchema {
    /// The schema, made once.
    fn schema() -> &'static Json;

    /// What is wrong although every single number is within its limits.
    fn problems(&self) -> Vec<Problem>;
}

/// The JSON Schema of a type, with the limits of its numbers.
pub(super) fn schema_of<T: JsonSchema>() -> Json {
    schemars::schema_for!(T).to_value()
}

/// Reads a value from JSON, with or without a byte order mark.
///
/// # Errors
/// [`IoError::Text`] or [`IoError::Faults`] with line and column of what is wrong.
pub(super) fn from_json<T: Readable>(bytes: &[u8], path: &Path) -> Result<T, IoError> {
    let text = text_of(bytes, path)?;
    let lines = Lines::of(text);
    let root = tree::from_json(text).map_err(|d| refused(path, &lines, vec![d]))?;
    let convert = || serde_json::from_str(text).map_err(|e| IoError::json(path, &e));
    checked(path, &lines, &root, convert)
}

/// Reads a value from TOML, with or without a byte order mark.
///
/// # Errors
/// As [`from_json`].
pub(super) fn from_toml<T: Readable>(bytes: &[u8], path: &Path) -> Result<T, IoError> {
    let text = text_of(bytes, path)?;
    let lines = Lines::of(text);
    let (root, wrong) = tree::from_toml(text);
    if !wrong.is_empty() {
        return Err(refused(path, &lines, wrong));
    }
    let convert = || toml::from_str(text).map_err(|e| IoError::toml(path, text, &e));
    checked(path, &lines, &root, convert)
}

fn text_of<'a>(bytes: &'a [u8], path: &Path) -> Result<&'a str, IoError> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let before = String::from_utf8_lossy(&bytes[..error.valid_up_to()]);
        let (line, column) = Lines::of(&before).position(before.len());
        IoError::Text {
            path: path.to_owned(),
            line,
            column,
            message: "the file is not UTF-8 text".to_owned(),
        }
    })
}

fn checked<T: Readable>(
    path: &Path,
    lines: &Lines<'_>,
    root: &Node,
    convert: impl FnOnce() -> Result<T, IoError>,
) -> Result<T, IoError> {
    let mut departures = format::check(root, T::schema());
    // A file of another version differs in more than its version.
    if let Some(version) = departures
        .iter()
        .position(|f| f.path == KeyPath::of("schema_version"))
    {
        departures = vec![departures.swap_remove(version)];
    }
    if !departures.is_empty() {
        let list = departures
            .into_iter()
            .map(|f| diagnostic(f.source, f.message, f.help));
        return Err(refused(path, lines, list.collect()));
    }
    let value = convert()?;
    let problems = value.problems();
    if problems.is_empty() {
        return Ok(value);
    }
    let list = problems.into_iter().map(|p| {
        let source = root.nearest(&p.path).source.clone();
        diagnostic(source, p.message, p.help)
    });
    Err(refused(path, lines, list.collect()))
}

fn diagnostic(source: Source, message: String, help: Option<String>) -> Diagnostic {
    let place = match source {
        Source::File(span) => Place::Span(span),
        Source::Set(_) | Source::Unknown => Place::Position(1, 1),
    };
    Diagnostic { place, message, help }
}

/// The error about some problems, at least one.
fn refused(path: &Path, lines: &Lines<'_>, mut list: Vec<Diagnostic>) -> IoError {
    list.sort_by_key(|d| match &d.place {
        Place::Span(span) => span.start,
        Place::Position(..) | Place::Key(_) | Place::Set(_) => 0,
    });
    let count = list.len();
    let fault = |d: Diagnostic| {
        let (line, column) = match d.place {
            Place::Span(span) => lines.position(span.start),
            Place::Position(line, column) => (line, column),
            Place::Key(_) | Place::Set(_) => (1, 1),
        };
        let message = match d.help {
            Some(help) => format!("{}; {help}", d.message),
            None => d.message,
        };
        TextFault {
            line,
            column,
            message,
        }
    };
    let mut faults: Vec<TextFault> = list.into_iter().take(MOST_SHOWN).map(fault).collect();
    if count == 1 {
        let TextFault {
            line,
            column,
            message,
        } = faults.remove(0);
        return IoError::Text {
            path: path.to_owned(),
            line,
            column,
            message,
        };
    }
    IoError::Faults {
        path: path.to_owned(),
        faults,
        count,
    }
}
