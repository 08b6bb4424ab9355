//! The scanner: preset, beam, mounting and light.

use catoptric_model::ScanDirection;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The model of the scanner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Hokuyo UST-20LX with the spot given in its manual: 160 × 25 mm at 10 m.
    #[serde(rename = "ust-20lx")]
    Ust20lx,
    /// The same with the spot of Cooper's Table 1, read as three neighboring beams.
    #[serde(rename = "ust-20lx-cooper")]
    Ust20lxCooper,
    /// Hokuyo UTM-30LX-EW: up to three echoes per beam, 30 m. Its spot is assumed to be the UST-20LX's.
    #[serde(rename = "utm-30lx-ew")]
    Utm30lxEw,
    /// A custom scanner: `scanner.custom` and `scanner.beam`. Its beams are the 1081 of the others, 0.25° apart.
    Custom,
}

/// The scanner and its mounting in the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// The preset.
    pub preset: Preset,
    /// Number of sub-rays per beam.
    #[serde(default = "Scanner::default_sub_rays")]
    #[schemars(range(min = 1, max = 4096))]
    pub sub_rays: u32,
    /// Shape of a beam, instead of the preset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<BeamShape>,
    /// Limits of a custom scanner, for the preset "custom".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub custom: Option<Limits>,
    /// Whether the scanner's own housing can block deflected beams.
    #[serde(default = "yes")]
    pub housing: bool,
    /// Boxes of the housing, instead of the preset's; a custom scanner has the UST-20LX's by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub housing_box: Option<Vec<HousingBox>>,
    /// Pose of the sensor in the rig body.
    #[serde(default)]
    pub mount: Mount,
}

fn yes() -> bool {
    true
}

impl Scanner {
    fn default_sub_rays() -> u32 {
        19
    }
}

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
    #[schemars(with = "ScanDirectionSchema")]
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

/// The sense in which a scan turns, seen from above.
#[derive(JsonSchema)]
#[serde(rename_all = "lowercase")]
#[schemars(rename = "ScanDirection")]
#[allow(dead_code)] // Read by the schema generator alone: the model crate knows no schemas.
enum ScanDirectionSchema {
    /// Counter-clockwise: azimuths grow from beam to beam.
    Ccw,
    /// Clockwise: azimuths fall from beam to beam.
    Cw,
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
    pub center_mm: [f64; 3],
    /// Its extents, in millimeters.
    #[schemars(inner(range(min = 0.01, max = 1000.0)))]
    pub size_mm: [f64; 3],
}

/// Pose of the sensor in the rig body: the drawing, and how far the true pose may be off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mount {
    /// Origin of the sensor in the rig frame, in millimeters.
    pub position_mm: [f64; 3],
    /// Yaw of the sensor in the rig frame, in degrees.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub yaw_deg: f64,
    /// Largest error of the optical axis in yaw, in degrees (data sheet: 0.3).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub yaw_tolerance_deg: f64,
    /// Largest error of the optical axis in pitch and in roll, in degrees (data sheet: 1).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub tilt_tolerance_deg: f64,
    /// Largest offset of the optical center along each axis, in millimeters (assumed).
    #[schemars(range(min = 0.0, max = 20.0))]
    pub shift_tolerance_mm: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            position_mm: [0.0, 0.0, -40.0],
            yaw_deg: 0.0,
            yaw_tolerance_deg: 0.3,
            tilt_tolerance_deg: 1.0,
            shift_tolerance_mm: 1.0,
        }
    }
}

/// The terms of Eq. (1). Only their product divided by the threshold affects a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// Transmitted peak power P_t, in watts (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub power_w: f64,
    /// Transmission of the optics τ_o (assumed).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub optics_transmission: f64,
    /// Transmission of the air τ_a, one way.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub air_transmission: f64,
    /// Diameter of the receiver D_R, in millimeters (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub receiver_diameter_mm: f64,
    /// Solid angle θ_R into which a target scatters, in steradians (π for a Lambertian surface).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub target_dispersion_sr: f64,
}

impl Default for Light {
    fn default() -> Self {
        Self {
            power_w: 10.0,
            optics_transmission: 0.9,
            air_transmission: 1.0,
            receiver_diameter_mm: 20.0,
            target_dispersion_sr: std::f64::consts::PI,
        }
    }
}
