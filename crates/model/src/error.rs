//! What can be wrong with the quantities of this crate.

use crate::scan::ScanAngles;

/// A quantity that cannot be what it is said to be.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// Three points on a line span no plane.
    #[error("three points that span a plane are needed; these enclose {area_m2:e} m²")]
    CollinearPoints {
        /// Area of their triangle.
        area_m2: f64,
    },
    /// A table whose columns differ in length or whose abscissae do not increase.
    #[error("{name}: {reason}")]
    BadTable {
        /// Which table.
        name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A dataset that refers to something it does not hold, or whose numbers of beams differ.
    #[error("{0}")]
    Inconsistent(String),
    /// A calibration of another scanner than the dataset's.
    #[error("the calibration is of a scanner with {calibration}; the dataset's has {dataset}")]
    OtherScanner {
        /// Where the beams of the calibration point.
        calibration: ScanAngles,
        /// Where the beams of the dataset point.
        dataset: ScanAngles,
    },
}
