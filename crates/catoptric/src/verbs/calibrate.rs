//! From a recorded experiment to a calibration, and step 1 before it.

use crate::{Control, Error};
use catoptric_calib::{Method, Options};
use catoptric_model::{Calibration, Characterization, Dataset};

/// Calibrates a recorded experiment by the method `joint`: where every mirrored beam goes, and how well that is known.
///
/// # Errors
/// [`Error::Calibration`] if no calibration can be made from the dataset at all; an element that cannot be solved has a
/// status and a reason instead.
pub fn calibrate(dataset: &Dataset) -> Result<Calibration, Error> {
    Ok(catoptric_calib::calibrate(
        dataset,
        Method::default(),
        &Options::default(),
    )?)
}

/// As [`calibrate`], by any method.
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
/// As [`calibrate`], and [`Error::Stopped`].
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

/// Measures the errors of the bare sensor (step 1): Tables 1 to 4, and the numbers of Eqs. (3) to (5).
///
/// # Errors
/// [`Error::Calibration`] if no board was recorded before the bare sensor.
pub fn characterize(dataset: &Dataset) -> Result<Characterization, Error> {
    Ok(catoptric_calib::characterize(dataset)?)
}
