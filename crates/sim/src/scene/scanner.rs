//! The scanner: preset, beam, mounting and light.

use super::omit::is_false;
use super::preset::Preset;
use super::sheet::{BeamShape, HousingBox, Limits};
use catoptric_model::{ScanAngles, ScanError, ScanGeometry};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    /// Number of sub-rays, about, of a beam that an edge of the structure divides within four standard deviations of its
    /// chief ray; 0 for `sub_rays` there too, which finds edges to within the distance between sub-rays. The default is
    /// 48, but 0 for the preset "ust-20lx" and for single rays.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 4096))]
    pub edge_rays: Option<u32>,
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

    /// Number of sub-rays of a beam that an edge divides; `None` if it is not treated differently.
    pub fn edge_rays(&self) -> Option<usize> {
        let own = self.edge_rays.map(|rays| rays as usize);
        let wanted = own.unwrap_or_else(|| self.preset.edge_rays());
        (wanted > 0 && self.sub_rays > 1).then_some(wanted)
    }

    /// Shape of a beam: the scene's, otherwise the preset's.
    pub fn beam_shape(&self) -> BeamShape {
        self.beam.unwrap_or_else(|| self.preset.beam_shape())
    }

    /// Boxes of the housing in the sensor frame: none, the scene's, or otherwise the preset's.
    pub fn housing_boxes(&self) -> &[HousingBox] {
        match (self.housing, &self.housing_box) {
            (false, _) => &[],
            (true, Some(boxes)) => boxes,
            (true, None) => self.preset.housing(),
        }
    }

    /// What the scanner can report: the scene's limits for a custom scanner, otherwise the preset's.
    pub fn limits(&self) -> Limits {
        match (self.preset, self.custom) {
            (Preset::Custom, Some(own)) => own,
            (preset, _) => preset.limits(),
        }
    }

    /// How it scans.
    ///
    /// # Errors
    /// [`ScanError`] names the first number under `scanner.custom` that no scan can have.
    pub fn scan(&self) -> Result<ScanGeometry, ScanError> {
        let limits = self.limits();
        let angles = ScanAngles {
            first_deg: limits.first_deg,
            step_deg: limits.step_deg,
            beams: limits.beams as usize,
            direction: limits.direction,
        };
        ScanGeometry::new(angles, limits.scan_rate_hz, limits.beam_time_us)
    }
}

/// Pose of the sensor in the rig body: the drawing, and how far the true pose may be off.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mount {
    /// Origin of the sensor in the rig frame, in millimeters.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
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
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub power_w: f64,
    /// Transmission of the optics τ_o (assumed).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub optics_transmission: f64,
    /// Transmission of the air τ_a, one way.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub air_transmission: f64,
    /// Diameter of the receiver D_R, in millimeters (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    #[schemars(range(min = 0.0, max = 10000.0))]
    pub receiver_diameter_mm: f64,
    /// Solid angle θ_R into which a target scatters, in steradians (π for a Lambertian surface).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub target_dispersion_sr: f64,
    /// Wavelength, in nanometers.
    #[serde(skip_serializing_if = "is_infrared")]
    #[schemars(range(min = 200.0, max = 20000.0))]
    pub wavelength_nm: f64,
    /// Angle of the laser's linear polarization from the long axis of the beam's ellipse, with which it turns, in degrees;
    /// without it, the light is not polarized (nobody publishes it).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub polarization_deg: Option<f64>,
    /// Full angle θ_V that the receiver's detector takes, in milliradians: the third of the areas that dA is the least of,
    /// and what makes near targets no brighter than far ones. Without it, the receiver sees every spot with all of its
    /// lens.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.01, max = 3000.0))]
    pub receiver_field_of_view_mrad: Option<f64>,
    /// Center of the receiver's lens from where the beam leaves, horizontally across the beam and up, in millimeters
    /// (assumed).
    #[serde(skip_serializing_if = "is_nothing")]
    #[schemars(inner(range(min = -1000.0, max = 1000.0)))]
    pub receiver_offset_mm: [f64; 2],
    /// Whether only that part of the lens counts from which the mirrors show the spot.
    #[serde(skip_serializing_if = "is_false")]
    pub vignetting: bool,
}

fn is_infrared(wavelength_nm: &f64) -> bool {
    *wavelength_nm == 905.0
}

fn is_nothing(offset: &[f64; 2]) -> bool {
    *offset == [0.0; 2]
}

impl Default for Light {
    fn default() -> Self {
        Self {
            power_w: 10.0,
            optics_transmission: 0.9,
            air_transmission: 1.0,
            receiver_diameter_mm: 20.0,
            target_dispersion_sr: std::f64::consts::PI,
            wavelength_nm: 905.0,
            polarization_deg: None,
            receiver_field_of_view_mrad: None,
            receiver_offset_mm: [0.0; 2],
            vignetting: false,
        }
    }
}
