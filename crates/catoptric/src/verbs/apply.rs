//! From the readings of a stretch to a cloud in a file, in memory that does not grow with its points.

use crate::Error;
use catoptric_assess::apply::{CloudSheet, Lift};
use catoptric_files::cloud::{CloudFormat, cloud_header, point_bytes};
use catoptric_files::{Content, IoError, Output, StagedOutput};
use catoptric_model::{Calibration, CloudFrame, Dataset};

/// As [`apply`](fn@crate::apply), into a file that appears whole or not at all; its name says which format it has.
///
/// ```no_run
/// use catoptric::{CloudFrame, apply_into, read_calibration, read_dataset};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let (dataset, calibration) = (read_dataset("data".as_ref())?, read_calibration("calibration.json".as_ref())?);
/// let cloud = apply_into(&dataset, &calibration, None, CloudFrame::Room, "room.ply")?;
/// assert!(cloud.points > 0);
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Apply`] if there is no such stretch, [`Error::File`] if it cannot be written or is there already as something else, [`Error::Invalid`] if the name
/// ends in nothing that is known.
pub fn apply_into(
    dataset: &Dataset,
    calibration: &Calibration,
    pose: Option<usize>,
    frame: CloudFrame,
    out: impl Into<Output>,
) -> Result<CloudSheet, Error> {
    let out = out.into();
    let path = out.path().to_owned();
    let format = CloudFormat::of_path(&path).map_err(|e| Error::invalid(e.to_string(), None))?;
    let lift = Lift::new(dataset, calibration, pose, frame)?;
    let header = cloud_header(format, frame, lift.sheet.points);
    let mut file = StagedOutput::create(out, &Content::of(header.as_bytes()))?;
    file.write(header.as_bytes())?;
    lift.each(|point| {
        let bytes = point_bytes(&point).map_err(|e| IoError::write(&path, e))?;
        Ok::<_, Error>(file.write(&bytes)?)
    })?;
    file.finish()?;
    Ok(lift.sheet)
}
