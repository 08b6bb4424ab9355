//! The scanner's presets: numbers from data sheets, and from Cooper's Table 1.

use crate::scene::{BeamShape, Preset, Scanner};

/// Scans per second (UST-20LX data sheet).
pub const SCAN_RATE_HZ: f64 = 40.0;
/// Time between two beams: one turn of 25 ms in 1440 steps.
pub const STEP_PERIOD_S: f64 = 1.0 / SCAN_RATE_HZ / 1440.0;
/// Shortest range that is reported, in metres; anything nearer is too close. The data sheet vouches for 60 mm on.
pub const RANGE_MIN_M: f64 = 0.021;
/// Longest specified range, in metres.
pub const RANGE_MAX_M: f64 = 20.0;

/// Boxes of the scanner's housing in the sensor frame, center and size in millimetres: the body below the window and
/// the cap above it. The UST-20LX is 50 × 50 × 70 mm; how it is divided around the scan plane is assumed.
pub const HOUSING_MM: [([f64; 3], [f64; 3]); 2] = [
    ([0.0, 0.0, -32.0], [50.0, 50.0, 36.0]),
    ([0.0, 0.0, 16.0], [40.0, 40.0, 8.0]),
];

impl Preset {
    /// The name used in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ust20lx => "ust-20lx",
            Self::Ust20lxCooper => "ust-20lx-cooper",
        }
    }

    /// Shape of a beam.
    pub fn beam_shape(self) -> BeamShape {
        match self {
            // 160 × 25 mm at 10 m to the front, 25 × 160 mm to the side (Hokuyo's manual).
            Self::Ust20lx => BeamShape {
                wide_full_mrad: 16.0,
                narrow_full_mrad: 2.5,
                wide_aperture_mm: 0.0,
                narrow_aperture_mm: 0.0,
                turns: true,
            },
            // Table 1 as the union of three neighbours: width 34.2 mrad·R less two steps of 0.25°, height
            // 3.0 mm + 0.85 mrad·R. The reading as a union is assumed.
            Self::Ust20lxCooper => BeamShape {
                wide_full_mrad: 25.5,
                narrow_full_mrad: 0.85,
                wide_aperture_mm: 0.0,
                narrow_aperture_mm: 3.0,
                turns: true,
            },
        }
    }
}

impl Scanner {
    /// Shape of a beam: the scene's, or else the preset's.
    pub fn beam_shape(&self) -> BeamShape {
        self.beam.unwrap_or_else(|| self.preset.beam_shape())
    }
}
