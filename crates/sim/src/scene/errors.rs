//! Errors of the sensor, and how well they are known.

use super::omit::is_zero;
use catoptric_model::bias::{AngleBias, ColorBias, DistanceBias, interpolate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Which errors the sensor has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorModel {
    /// A perfect sensor: no bias, drift, noise, rounding or dropout.
    None,
    /// Eqs. (3)–(5) and the tables; the detector has an effect only where surfaces mix.
    #[default]
    Empirical,
    /// The effect of pulse and threshold on the range, without Eqs. (3)–(5).
    Physical,
    /// Both added.
    Both,
}

/// Errors of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Errors {
    /// Which errors are simulated.
    pub model: ErrorModel,
    /// E_r; Table 2 by default.
    pub distance: DistanceBias,
    /// E_a; by default the slope of Table 3 with no error at normal incidence, which E_r already contains.
    pub angle: AngleBias,
    /// E_c per color; none by default.
    pub color: BTreeMap<String, ColorBias>,
    /// White noise of a reading; Table 2 by default.
    pub noise: NoiseTable,
    /// Constant error of all readings of a pose, 1σ, in millimeters (trial scatter in Table 2).
    #[schemars(range(min = 0.0, max = 100.0))]
    pub drift_sd_mm: f64,
    /// Constant error of each beam in each pose, 1σ, in millimeters: what more scans do not average out, such as
    /// speckle or an irregular board; none by default.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "is_zero")]
    pub element_sd_mm: f64,
    /// Error of a scanner that is still warming up; none by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub warm_up: Option<WarmUp>,
    /// Noise correlated between successive readings of a beam; none by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlated: Option<Correlated>,
    /// Noise that all beams of a scan share and that changes slowly from scan to scan; none by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub common: Option<Correlated>,
    /// How much larger the noise is where the light meets a surface at an angle; not at all by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub incidence: Option<IncidenceNoise>,
    /// Rare steps of single readings; none by default.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interference: Option<Interference>,
    /// Step of the reported ranges, in millimeters; 0 for none.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub quantization_mm: f64,
    /// Probability that a reading is lost.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub dropout: f64,
}

impl Default for Errors {
    fn default() -> Self {
        Self {
            model: ErrorModel::Empirical,
            distance: DistanceBias {
                range_m: vec![0.5, 2.0, 4.0],
                error_mm: vec![-2.8, 6.1, -0.1],
            },
            angle: AngleBias {
                gain_mm: -70.3,
                offset_mm: 70.3,
                table: None,
            },
            color: BTreeMap::new(),
            noise: NoiseTable {
                range_m: vec![0.5, 2.0, 4.0],
                sd_mm: vec![4.1, 3.9, 4.6],
            },
            drift_sd_mm: 0.88,
            element_sd_mm: 0.0,
            warm_up: None,
            correlated: None,
            common: None,
            incidence: None,
            interference: None,
            quantization_mm: 1.0,
            dropout: 0.0,
        }
    }
}

/// An error that decays while the scanner warms up: a·exp(−t/τ), t since the recording began.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WarmUp {
    /// Initial error a, in millimeters.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub amplitude_mm: f64,
    /// Time constant τ, in seconds.
    #[schemars(range(min = 0.1, max = 1e6))]
    pub time_constant_s: f64,
}

/// Noise that changes slowly, an AR(1) process: x₀ = ε₀, xₖ = φ·xₖ₋₁ + √(1 − φ²)·εₖ.
///
/// φ = exp(−T/τ) for scans T apart. It starts anew, in its stationary distribution, with every stretch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Correlated {
    /// Standard deviation, in millimeters.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub sd_mm: f64,
    /// Correlation time τ, in seconds.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub time_constant_s: f64,
}

/// Steps of single readings, as caused by another scanner's pulses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Interference {
    /// Size of a step, in millimeters; forward and backward are equally likely.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub step_mm: f64,
    /// Probability of a step in a reading.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probability: f64,
}

/// Standard deviation of a reading as a function of distance, interpolated linearly and constant outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseTable {
    /// Distances in meters, strictly increasing.
    #[schemars(length(min = 1))]
    #[schemars(inner(range(min = 0.0, max = 10000.0)))]
    pub range_m: Vec<f64>,
    /// Standard deviations in millimeters at those distances.
    #[schemars(inner(range(min = 0.0, max = 1000.0)))]
    pub sd_mm: Vec<f64>,
}

/// Factor on the noise of a reading as a function of the incidence on the surface, interpolated linearly and constant
/// outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IncidenceNoise {
    /// Angles of incidence, strictly increasing, in degrees.
    #[schemars(length(min = 1))]
    #[schemars(inner(range(min = 0.0, max = 90.0)))]
    pub incidence_deg: Vec<f64>,
    /// Factors at those angles.
    #[schemars(inner(range(min = 0.0, max = 100.0)))]
    pub factor: Vec<f64>,
}

impl IncidenceNoise {
    /// The factor at a cosine of the incidence.
    pub fn factor(&self, cos_incidence: f64) -> f64 {
        let incidence = libm::acos(cos_incidence.clamp(-1.0, 1.0)).to_degrees();
        interpolate(&self.incidence_deg, &self.factor, incidence)
    }
}

/// How well step 1 knows the errors: the beliefs differ from the truth by these standard deviations (assumed).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Characterization {
    /// E_r at each node of its table, in millimeters (0.88 mm of drift, averaged over three trials).
    #[schemars(range(min = 0.0, max = 100.0))]
    pub distance_sd_mm: f64,
    /// A_a, in millimeters, with the error at normal incidence held.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub angle_gain_sd_mm: f64,
    /// E_c, in millimeters.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub color_sd_mm: f64,
}

impl Default for Characterization {
    fn default() -> Self {
        Self {
            distance_sd_mm: 0.5,
            angle_gain_sd_mm: 3.0,
            color_sd_mm: 0.0,
        }
    }
}

impl NoiseTable {
    /// Standard deviation at a range, in meters.
    pub fn sd(&self, range: f64) -> f64 {
        interpolate(&self.range_m, &self.sd_mm, range) * 1e-3
    }
}
