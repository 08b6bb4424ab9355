//! The interface of a calibrator, the same for our methods and for third-party ones.

use crate::error::CalibError;
use crate::method::Method;
use crate::options::Options;
use catoptric_model::{Calibration, Dataset};

/// Turns a dataset into a calibration, and sees nothing else.
///
/// ```
/// use catoptric_calib::{CalibError, Calibrator, Method};
/// use catoptric_model::{Calibration, Dataset};
///
/// fn both(dataset: &Dataset) -> Result<Vec<Calibration>, CalibError> {
///     let contestants: [&dyn Calibrator; 2] = [&Method::Beam, &Method::Recursive];
///     contestants.iter().map(|c| c.calibrate(dataset)).collect()
/// }
/// ```
pub trait Calibrator {
    /// The name used in tables and files.
    fn name(&self) -> &str;

    /// One entry for each element that was examined.
    ///
    /// # Errors
    /// [`CalibError`] if no calibration can be made from the dataset at all.
    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError>;
}

impl Calibrator for Method {
    fn name(&self) -> &str {
        Method::name(*self)
    }

    /// With the default [`Options`].
    fn calibrate(&self, dataset: &Dataset) -> Result<Calibration, CalibError> {
        crate::calibrate(dataset, *self, &Options::default())
    }
}
