//! What calibrates: one interface for our methods and for anybody's.

use crate::error::CalibError;
use crate::method::Method;
use crate::options::Options;
use catoptric_model::{Calibration, Dataset};

/// Something that turns a dataset into a calibration, and sees nothing else.
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
    /// The word that tables and files call it by.
    fn name(&self) -> &str;

    /// One entry for each element that was looked at.
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
