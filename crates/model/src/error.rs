//! Errors in the quantities of this crate.

use crate::scan::ScanAngles;

/// A quantity whose value is impossible or inconsistent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// Three points on a line, which span no plane.
    #[error("three points that span a plane are needed; these enclose {area_m2:e} m²")]
    CollinearPoints {
        /// Area of their triangle.
        area_m2: f64,
    },
    /// A table whose columns differ in length or whose abscissae do not increase.
    #[error("{name}: {reason}")]
    BadTable {
        /// Name of the table.
        name: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// A dataset that refers to something it does not contain, or whose numbers of beams differ.
    #[error("{0}")]
    Inconsistent(String),
    /// A calibration of a different scanner than the dataset's.
    #[error("the calibration is of a scanner with {calibration}; the dataset's has {dataset}")]
    OtherScanner {
        /// Beam directions of the calibration.
        calibration: ScanAngles,
        /// Beam directions of the dataset.
        dataset: ScanAngles,
    },
}
