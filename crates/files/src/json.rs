//! Reading and writing values as JSON.

use super::error::IoError;
use super::paths::unread;
use super::waiting;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// A value as indented JSON with a trailing newline; numbers that are not finite become null.
///
/// # Errors
/// [`IoError::Text`] if the value has no JSON form, such as a map whose keys are not strings; `path` names it.
pub fn to_json(path: impl AsRef<Path>, value: &impl Serialize) -> Result<Vec<u8>, IoError> {
    let mut bytes = serde_json::to_vec_pretty(value).map_err(|e| IoError::json(path, &e))?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// Reads a value from JSON.
///
/// # Errors
/// [`IoError::Read`] if the file cannot be read, [`IoError::Text`] with line and column if it is not valid.
pub fn read_json<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T, IoError> {
    let path = path.as_ref();
    parse_json(&bytes_of(path)?, path)
}

/// The bytes of a file.
pub(super) fn bytes_of(path: &Path) -> Result<Vec<u8>, IoError> {
    waiting::read(path).map_err(|e| IoError::read(path, unread(path, e)))
}

/// Reads a value from the bytes of a JSON file, with or without a byte order mark; `path` names it in errors.
///
/// # Errors
/// [`IoError::Text`] with line and column if they are not valid.
pub fn parse_json<T: DeserializeOwned>(bytes: &[u8], path: impl AsRef<Path>) -> Result<T, IoError> {
    let bytes = bytes.strip_prefix(MARK).unwrap_or(bytes);
    serde_json::from_slice(bytes).map_err(|e| match no_number(bytes, &e) {
        None => IoError::json(path, &e),
        Some(message) => IoError::Text {
            path: path.as_ref().to_owned(),
            line: e.line(),
            column: e.column(),
            message,
        },
    })
}

/// The message about a literal that other languages write for numbers, if a JSON file went wrong at one.
pub(super) fn no_number(bytes: &[u8], error: &serde_json::Error) -> Option<String> {
    let literal = literal(bytes, error)?;
    Some(format!(
        "{literal} is no number in JSON; what is not known is null, or left out"
    ))
}

/// Position of a part of a text in that text, in bytes.
pub(super) fn position_of(text: &str, part: &str) -> usize {
    part.as_ptr()
        .addr()
        .saturating_sub(text.as_ptr().addr())
        .min(text.len())
}

/// Byte order mark of UTF-8, which some programs put before a text.
pub(crate) const MARK: &[u8] = b"\xef\xbb\xbf";

/// The literal at which a JSON file went wrong, if it is one that other languages write for numbers.
fn literal(bytes: &[u8], error: &serde_json::Error) -> Option<&'static str> {
    let line = bytes
        .split(|byte| *byte == b'\n')
        .nth(error.line().checked_sub(1)?)?;
    // The error stands at the first letter that cannot be, or behind a minus.
    let from = error.column().saturating_sub(2).min(line.len());
    let near = &line[from..];
    ["-Infinity", "Infinity", "NaN", "nan", "inf"]
        .into_iter()
        .find(|literal| (0..=2.min(near.len())).any(|skip| near[skip..].starts_with(literal.as_bytes())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_is_passed_over_and_literals_of_other_languages_are_named() {
        assert_eq!(
            parse_json::<Vec<f64>>(b"\xef\xbb\xbf[1]", "x.json").expect("read"),
            [1.0]
        );
        for (text, name, column) in [
            ("[NaN]", "NaN", 2),
            ("[1, -Infinity]", "Infinity", 6),
            ("{\n\"a\": NaN}", "NaN", 6),
        ] {
            let error = parse_json::<serde_json::Value>(text.as_bytes(), "x.json").expect_err("refused");
            let IoError::Text {
                column: at, message, ..
            } = error
            else {
                panic!("it has a place");
            };
            assert!(message.contains(name), "{message}");
            assert_eq!(at, column, "{text}");
        }
        let plain = parse_json::<Vec<f64>>(b"[1,,2]", "x.json")
            .expect_err("refused")
            .to_string();
        assert!(plain.contains("x.json:1:4: "), "{plain}");
    }
}
