//! The truth of a simulated dataset, which has to belong to it: the manifest lists it, or nothing does and the session
//! agrees with it.

use super::dataset::{MANIFEST, TRUTH, read_checked, read_manifest, read_session};
use super::error::IoError;
use super::results::require_version;
use catoptric_model::Session;
use catoptric_sim::Truth;
use std::collections::BTreeSet;
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
    let found: Truth = serde_json::from_slice(&bytes).map_err(|e| IoError::json(&path, &e))?;
    require_version(&path, found.schema_version, catoptric_sim::truth::SCHEMA_VERSION)?;
    let session = read_session(dataset)?;
    let mut checked = check(&found, &session);
    if manifest.is_none() {
        checked = checked.and_then(|()| belongs(&found, &session));
    }
    checked.map_err(|message| IoError::content(&path, message))?;
    Ok(Some(found))
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

/// Checks that a truth agrees with itself and with the scanner of its dataset.
fn check(truth: &Truth, session: &Session) -> Result<(), String> {
    let beams = session.scanner.scan.beams();
    let facets: BTreeSet<&str> = truth.facets.iter().map(|f| f.name.as_str()).collect();
    let mut seen = BTreeSet::new();
    for (place, b) in truth.beams.iter().enumerate() {
        if b.beam >= beams {
            return Err(format!(
                "beams[{place}].beam is {}, but the session's scanner has the beams 0…{}",
                b.beam,
                beams.saturating_sub(1)
            ));
        }
        if !seen.insert(b.beam) {
            return Err(format!(
                "beams[{place}].beam: beam {} is listed more than once",
                b.beam
            ));
        }
        if let Some(name) = b.facets.iter().find(|name| !facets.contains(name.as_str())) {
            return Err(format!("beams[{place}].facets: there is no facet {name:?}"));
        }
        let angles = [b.azimuth_rad, b.elevation_rad, b.distance_m];
        if angles.into_iter().flatten().any(|x| !x.is_finite()) {
            return Err(format!("beams[{place}] has a number that is not finite"));
        }
    }
    Ok(())
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
