//! The scanner's presets: numbers from data sheets, and from Cooper's Table 1.

use crate::scene::{BeamShape, Limits, Preset, Scanner};

/// What the UST-20LX reports (data sheet): 40 Hz, 20 m, one echo. It vouches for 60 mm on, but reports ranges from
/// 21 mm on.
pub const UST_20LX: Limits = Limits {
    range_min_m: 0.021,
    range_max_m: 20.0,
    scan_rate_hz: 40.0,
    echoes: 1,
};

/// What the UTM-30LX-EW reports (data sheet): 40 Hz, 0.1 to 30 m, three echoes.
pub const UTM_30LX_EW: Limits = Limits {
    range_min_m: 0.1,
    range_max_m: 30.0,
    scan_rate_hz: 40.0,
    echoes: 3,
};

/// Steps of a turn of which a scan takes its beams.
const STEPS_PER_TURN: f64 = 1440.0;

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
            Self::Utm30lxEw => "utm-30lx-ew",
            Self::Custom => "custom",
        }
    }

    /// What it can report.
    pub fn limits(self) -> Limits {
        match self {
            Self::Ust20lx | Self::Ust20lxCooper | Self::Custom => UST_20LX,
            Self::Utm30lxEw => UTM_30LX_EW,
        }
    }

    /// Shape of a beam.
    pub fn beam_shape(self) -> BeamShape {
        match self {
            // 160 × 25 mm at 10 m to the front, 25 × 160 mm to the side (Hokuyo's manual). The UTM-30LX-EW, of the same
            // maker and wavelength, publishes no spot: assumed equal. A custom scanner brings its own.
            Self::Ust20lx | Self::Utm30lxEw | Self::Custom => BeamShape {
                wide_full_mrad: 16.0,
                narrow_full_mrad: 2.5,
                wide_aperture_mm: 0.0,
                narrow_aperture_mm: 0.0,
                turns: true,
            },
            // Table 1 as the union of three neighbours: width 33.6 mrad·R less two steps of 0.25°, height
            // 3.0 mm + 0.85 mrad·R. The reading as a union is assumed. 33.6 mrad is the slope through the origin of all
            // widths but that at 2 m, which lies 12 mm under what its neighbours at 1 m and 3 m have between them.
            Self::Ust20lxCooper => BeamShape {
                wide_full_mrad: 24.9,
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

    /// What it can report: the scene's for a scanner of one's own, or else the preset's.
    pub fn limits(&self) -> Limits {
        match self.preset {
            Preset::Custom => self.custom.unwrap_or(UST_20LX),
            preset => preset.limits(),
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        UST_20LX
    }
}

impl Limits {
    /// Time from the start of one scan to the start of the next, in seconds.
    pub fn scan_period_s(&self) -> f64 {
        1.0 / self.scan_rate_hz
    }

    /// Time between two beams of a scan, in seconds.
    pub fn step_period_s(&self) -> f64 {
        self.scan_period_s() / STEPS_PER_TURN
    }
}
