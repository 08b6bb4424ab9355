//! Files that several verbs read.

use super::error::CliError;
use catoptric::files::{self, IoError, dataset};
use catoptric::model::{Calibration, Characterization, calibration, characterization};
use catoptric::sim::{Truth, truth};
use std::path::Path;

/// The truth of a dataset; `None` if the dataset is blind.
pub(crate) fn read_truth(folder: &Path) -> Result<Option<Truth>, CliError> {
    let path = folder.join(dataset::TRUTH);
    if !path.exists() {
        return Ok(None);
    }
    let found: Truth = files::read_json(&path)?;
    require_version(&path, found.schema_version, truth::SCHEMA_VERSION)?;
    Ok(Some(found))
}

/// A calibration, ours or anybody's.
pub(crate) fn read_calibration(path: &Path) -> Result<Calibration, CliError> {
    let found: Calibration = files::read_json(path)?;
    require_version(path, found.schema_version, calibration::SCHEMA_VERSION)?;
    Ok(found)
}

/// A characterization of the bare sensor.
pub(crate) fn read_characterization(path: &Path) -> Result<Characterization, CliError> {
    let found: Characterization = files::read_json(path)?;
    require_version(path, found.schema_version, characterization::SCHEMA_VERSION)?;
    Ok(found)
}

fn require_version(path: &Path, found: u32, known: u32) -> Result<(), CliError> {
    if found == known {
        return Ok(());
    }
    let message = format!("schema_version is {found}, this program reads {known}");
    Err(IoError::content(path, message).into())
}
