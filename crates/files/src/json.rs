//! Reading and writing values as JSON.

use super::error::IoError;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs;
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
    let bytes = fs::read(path).map_err(|e| IoError::read(path, e))?;
    serde_json::from_slice(&bytes).map_err(|e| IoError::json(path, &e))
}
