//! Results as JSON: calibrations (our own or third-party), characterizations.

use super::error::IoError;
use super::json::read_json;
use catoptric_model::{Calibration, Characterization, Session, calibration, characterization};
use std::path::Path;

/// Reads a calibration, our own or third-party.
///
/// # Errors
/// [`IoError`] with line and column if it is invalid, or has an unknown version.
pub fn read_calibration(path: &Path) -> Result<Calibration, IoError> {
    let found: Calibration = read_json(path)?;
    require_version(path, found.schema_version, calibration::SCHEMA_VERSION)?;
    Ok(found)
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
    let found: Characterization = read_json(path)?;
    require_version(path, found.schema_version, characterization::SCHEMA_VERSION)?;
    Ok(found)
}

/// Checks that a file has the newest version of its format or an older one, all of which can be read.
pub(super) fn require_version(path: &Path, found: u32, newest: u32) -> Result<(), IoError> {
    if (1..=newest).contains(&found) {
        return Ok(());
    }
    let known = match newest {
        1 => "1".to_owned(),
        newest => format!("1 to {newest}"),
    };
    let message = format!("schema_version is {found}, this program reads {known}");
    Err(IoError::content(path, message))
}
