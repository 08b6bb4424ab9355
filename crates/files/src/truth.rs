//! The truth of a simulated dataset, which has to belong to it: the manifest lists it, or nothing does and the session
//! agrees with it.

use super::dataset::{MANIFEST, TRUTH, read_checked, read_manifest, read_session};
use super::door;
use super::error::IoError;
use catoptric_model::Session;
use catoptric_sim::Truth;
use std::path::Path;

/// Reads the truth of a dataset; `None` if the dataset has none.
///
/// # Errors
/// [`IoError`] if it cannot be read, has an unknown version, was changed since the dataset was written, or belongs to
/// another dataset.
pub fn read_truth(dataset: &Path) -> Result<Option<Truth>, IoError> {
    let path = dataset.join(TRUTH);
    if !path.exists() {
        return Ok(None);
    }
    let manifest = read_manifest(dataset)?;
    if manifest.as_ref().is_some_and(|m| !m.files.contains_key(TRUTH)) {
        let message = format!(
            "is not in {}: this dataset was written without its truth, and nothing shows that this one belongs to it",
            dataset.join(MANIFEST).display()
        );
        return Err(IoError::content(path, message));
    }
    let bytes = read_checked(dataset, TRUTH, manifest.as_ref().map(|m| &m.files))?;
    let found = parse_truth(&bytes, &path)?;
    let session = read_session(dataset)?;
    let mut checked = check(&found, &session);
    if manifest.is_none() {
        checked = checked.and_then(|()| belongs(&found, &session));
    }
    checked.map_err(|message| IoError::content(&path, message))?;
    Ok(Some(found))
}

/// Reads a truth from the bytes of its file; `path` names it in errors.
///
/// # Errors
/// [`IoError::Text`] with line and column if it is invalid, or has an unknown version.
pub fn parse_truth(bytes: &[u8], path: impl AsRef<Path>) -> Result<Truth, IoError> {
    door::from_json(bytes, path.as_ref())
}

/// Reads the truth to judge a calibration by; `None` if the manifest states that there is none, or if `blind`.
///
/// # Errors
/// As [`read_truth`], and [`IoError::NoTruth`] if the truth is missing although nothing states that the dataset is blind.
pub fn read_reference(dataset: &Path, blind: bool) -> Result<Option<Truth>, IoError> {
    if blind {
        return Ok(None);
    }
    if let Some(found) = read_truth(dataset)? {
        return Ok(Some(found));
    }
    let message = match read_manifest(dataset)? {
        Some(manifest) if !manifest.files.contains_key(TRUTH) => return Ok(None),
        Some(_) => format!("is missing, although {MANIFEST} lists it"),
        None => format!("is missing, and there is no {MANIFEST} that states that the dataset is blind"),
    };
    Err(IoError::NoTruth {
        path: dataset.join(TRUTH),
        message,
    })
}

/// Why a truth may not be the one of its dataset: a sentence, if it has one and no manifest that could show that it was
/// changed.
///
/// # Errors
/// As [`read_truth`], except for the truth itself, which is not read.
pub fn unverified_truth(dataset: &Path) -> Result<Option<String>, IoError> {
    let path = dataset.join(TRUTH);
    let is_unverified = path.exists() && read_manifest(dataset)?.is_none();
    Ok(is_unverified.then(|| {
        format!(
            "{} is not verified: there is no {MANIFEST} that would show a change of it",
            path.display()
        )
    }))
}

/// Checks that the beams of a truth are among those of the scanner of its dataset.
fn check(truth: &Truth, session: &Session) -> Result<(), String> {
    let beams = session.scanner.scan.beams();
    match truth.beams.iter().enumerate().find(|(_, b)| b.beam >= beams) {
        None => Ok(()),
        Some((place, b)) => Err(format!(
            "beams[{place}].beam is {}, but the session's scanner has the beams 0…{}",
            b.beam,
            beams.saturating_sub(1)
        )),
    }
}

/// Checks that a truth may be that of a session that no manifest ties it to.
fn belongs(truth: &Truth, session: &Session) -> Result<(), String> {
    if truth.name != session.name {
        return Err(format!(
            "is the truth of {:?}, but the session is that of {:?}",
            truth.name, session.name
        ));
    }
    let has = |name: &str| truth.facets.iter().any(|f| f.name == name);
    match session.facets.iter().find(|f| !has(&f.name)) {
        Some(facet) => Err(format!("has no facet {:?}, which the session has", facet.name)),
        None => Ok(()),
    }
}
