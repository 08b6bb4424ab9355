//! Results as JSON: calibrations (our own or third-party), characterizations.

use super::door;
use super::error::IoError;
use super::json::bytes_of;
use catoptric_model::{Calibration, Characterization, Session};
use std::path::Path;

/// Reads a calibration, our own or third-party.
///
/// # Errors
/// [`IoError`] with line and column if it is invalid, or has an unknown version.
pub fn read_calibration(path: &Path) -> Result<Calibration, IoError> {
    parse_calibration(&bytes_of(path)?, path)
}

/// Reads a calibration from the bytes of its file; `path` names it in errors.
///
/// # Errors
/// As [`read_calibration`].
pub fn parse_calibration(bytes: &[u8], path: &Path) -> Result<Calibration, IoError> {
    door::from_json(bytes, path)
}

/// Reads a calibration for use with a dataset of this session: it must be of the same scanner, if it states one.
///
/// # Errors
/// As [`read_calibration`], and [`IoError::Inconsistent`] if it belongs to a scanner with other beams.
pub fn read_calibration_for(path: &Path, session: &Session) -> Result<Calibration, IoError> {
    let found = read_calibration(path)?;
    match found.check_scanner(session) {
        Ok(()) => Ok(found),
        Err(source) => Err(IoError::Inconsistent {
            path: path.to_owned(),
            source,
        }),
    }
}

/// Reads a characterization of the bare sensor.
///
/// # Errors
/// [`IoError`] with line and column if it is invalid, or has an unknown version.
pub fn read_characterization(path: &Path) -> Result<Characterization, IoError> {
    parse_characterization(&bytes_of(path)?, path)
}

/// Reads a characterization from the bytes of its file; `path` names it in errors.
///
/// # Errors
/// As [`read_characterization`].
pub fn parse_characterization(bytes: &[u8], path: &Path) -> Result<Characterization, IoError> {
    door::from_json(bytes, path)
}
