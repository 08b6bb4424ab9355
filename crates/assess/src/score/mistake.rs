//! A mistake that would explain the errors of a score, and its sentence.

use serde::Serialize;
use std::fmt;

/// Error that a mistake has to leave at most, relative to the one found.
pub(super) const LEFT: f64 = 0.2;

/// A mistake that would explain the errors.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mistake {
    /// What would make it right, as text after "with".
    pub correction: String,
    /// The figure that it concerns.
    pub figure: &'static str,
    /// Its value as found.
    pub found: f64,
    /// Its value with the correction.
    pub would_be: f64,
}

/// A sentence: "with φ negated, the per-axis error would be 0.014° instead of 68.2°".
impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "with {}, {} would be {} instead of {}",
            self.correction,
            named(self.figure),
            figures(self.would_be, self.figure),
            figures(self.found, self.figure)
        )
    }
}

/// The figure as a reader calls it.
fn named(figure: &str) -> &'static str {
    match figure {
        "per_axis_rms_deg" => "the per-axis error",
        "distance_mm.rms" => "the error of d",
        "mounting.attitude_deg" => "the error of the mounting's attitude",
        "mounting.position_mm" => "the error of the mounting's position",
        "nees_mean" => "the mean normalized squared error",
        _ => "the figure",
    }
}

/// A value with the unit of its figure and three significant digits.
fn figures(value: f64, figure: &str) -> String {
    let unit = if figure.contains("_deg") {
        "°"
    } else if figure.contains("_mm") {
        " mm"
    } else {
        ""
    };
    let size = value.abs();
    let decimals = if size >= 100.0 {
        0
    } else if size >= 10.0 {
        1
    } else if size >= 1.0 {
        2
    } else {
        3
    };
    format!("{value:.decimals$}{unit}")
}
