//! What a scanner's data sheet says: how it scans, its beam, its housing.

use catoptric_model::ScanDirection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a scanner scans, and what it can report. The defaults are the UST-20LX's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Shortest range that is reported, in meters; anything closer reads as too close.
    #[schemars(range(min = 0.0, max = 10.0))]
    pub range_min_m: f64,
    /// Longest range that is reported, in meters; anything farther reads as no return.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub range_max_m: f64,
    /// Azimuth of beam 0, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub first_deg: f64,
    /// Angle between neighboring beams, in degrees.
    #[schemars(range(min = 0.01, max = 45.0))]
    pub step_deg: f64,
    /// Beams of a scan; all of them times `step_deg` make one turn at most.
    #[schemars(range(min = 1, max = 36000))]
    pub beams: u32,
    /// The sense in which it turns, seen from above.
    pub direction: ScanDirection,
    /// Scans per second.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub scan_rate_hz: f64,
    /// Time from one beam of a scan to the next, in microseconds; `step_deg`/(360·`scan_rate_hz`) unless given.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.001, max = 1e6))]
    pub beam_time_us: Option<f64>,
    /// Maximum number of echoes reported for one beam.
    #[schemars(range(min = 1, max = 8))]
    pub echoes: u32,
}

impl Limits {
    /// Time from the start of one scan to the start of the next, in seconds.
    pub fn scan_period_s(&self) -> f64 {
        1.0 / self.scan_rate_hz
    }
}

/// Shape of one beam: an ellipse whose long axis is horizontal at azimuth 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamShape {
    /// Full angle of the 1/e² contour along the long axis, in milliradians.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub wide_full_mrad: f64,
    /// Full angle of the 1/e² contour along the short axis, in milliradians.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub narrow_full_mrad: f64,
    /// Full width of the beam along its long axis as it leaves the scanner, in millimeters.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub wide_aperture_mm: f64,
    /// Full width of the beam along its short axis as it leaves the scanner, in millimeters.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub narrow_aperture_mm: f64,
    /// Whether the ellipse rotates with the azimuth, as behind a spinning 45° mirror.
    #[serde(default = "yes")]
    pub turns: bool,
}

/// A box of the scanner's housing, aligned with the axes of the sensor frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HousingBox {
    /// Its center in the sensor frame, in millimeters; the scan plane is z = 0.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
    pub center_mm: [f64; 3],
    /// Its extents, in millimeters.
    #[schemars(inner(range(min = 0.01, max = 1000.0)))]
    pub size_mm: [f64; 3],
}

fn yes() -> bool {
    true
}
