//! Calibration of a recorded experiment, and the characterization of the bare sensor (step 1) before it.

use crate::{Control, Error};
use catoptric_calib::{Method, Options};
#[cfg(feature = "recording")]
use catoptric_files::Damage;
use catoptric_model::{Calibration, Characterization, Dataset};
#[cfg(feature = "recording")]
use std::path::Path;

/// Same as [`read_dataset`](crate::read_dataset), with damaged stretches left out on request, and under control: a stop ends
/// it, and every later pass over the readings of the dataset.
///
/// # Errors
/// [`Error::File`] names the file that is missing, changed, invalid or inconsistent with the others; [`Error::Stopped`].
#[cfg(feature = "recording")]
pub fn read_dataset_with(folder: &Path, damage: Damage, control: &Control) -> Result<Dataset, Error> {
    control.run(|| Ok(catoptric_files::read_dataset_with(folder, damage, &control.stop)?))
}

/// Calibrates a recorded experiment by the method `joint`: the direction of every mirrored beam, with its covariance.
///
/// # Errors
/// [`Error::Calibration`] if the dataset cannot be calibrated at all; an element that cannot be solved has a status and a
/// reason instead.
pub fn calibrate(dataset: &Dataset) -> Result<Calibration, Error> {
    Ok(catoptric_calib::calibrate(
        dataset,
        Method::default(),
        &Options::default(),
    )?)
}

/// Same as [`calibrate`], by any method.
///
/// ```
/// use catoptric::calib::{Method, Options};
/// use catoptric::{Control, Scene, Template, calibrate_with, simulate};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::template(Template::TwoMirror).with(&["experiment.scans_per_pose=5", "scanner.sub_rays=1"])?;
/// let (dataset, _) = simulate(&scene)?;
/// let calibration = calibrate_with(&dataset, Method::Beam, &Options::default(), &Control::default())?;
/// assert_eq!(calibration.method, "beam");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// Same as [`calibrate`], and [`Error::Stopped`].
pub fn calibrate_with(
    dataset: &Dataset,
    method: Method,
    options: &Options,
    control: &Control,
) -> Result<Calibration, Error> {
    control.run(|| {
        Ok(catoptric_calib::calibrate_until(
            dataset,
            method,
            options,
            &control.stop,
        )?)
    })
}

/// Measures the range errors of the bare sensor (step 1): Tables 1 to 4, and the numbers of Eqs. (3)–(5).
///
/// # Errors
/// [`Error::Calibration`] if no board was recorded in front of the bare sensor.
pub fn characterize(dataset: &Dataset) -> Result<Characterization, Error> {
    Ok(catoptric_calib::characterize(dataset)?)
}
