//! The result of step 1 about the bare sensor: `characterization.json`.
//!
//! Tables 1 to 4 of the paper as measured, and the fitted parameters of Eqs. (3)–(5). Errors are *measured − true*.

use crate::bias::RangeBias;
use crate::label::{SpotNote, TestKind};
use crate::limits;
use crate::mount::MountEstimate;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of `characterization.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// A characterized sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Characterization {
    /// Version of this file's format.
    #[schemars(range(min = 1, max = SCHEMA_VERSION))]
    pub schema_version: u32,
    /// Name of the experiment.
    pub name: String,
    /// Table 1: the spots that were measured.
    pub spots: Vec<SpotRow>,
    /// How the spot grows with the distance; absent without spots at two distances.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spot_law: Option<SpotLaw>,
    /// Tables 2 to 4: every stretch with a board in front of undeflected beams, in the order of recording.
    pub stretches: Vec<StretchRow>,
    /// The biases that Eq. (3) subtracts. E_a is the law of Eq. (4), plus a table if the law is rejected.
    pub bias: RangeBias,
    /// The fitted parameters.
    pub parameters: Vec<Parameter>,
    /// Their covariance, in the units of the parameters, in row-major order.
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub covariance: Vec<Vec<f64>>,
    /// Parameters that the boards do not determine.
    #[serde(default)]
    pub not_observed: Vec<NotObserved>,
    /// Eq. (5) as a line through E_r over distance; absent with fewer than three distances.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distance_line: Option<Law>,
    /// Residuals of the cosine law at each incidence tested.
    #[serde(default)]
    pub angle_misfit: Vec<MisfitRow>,
    /// Goodness of fit of the law of Eq. (4); absent with fewer than three incidences.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_law: Option<Fit>,
    /// Table 4: white noise of one reading, by color and distance.
    pub noise: Vec<NoiseRow>,
    /// Scatter of the means over repeated trials of one setting; absent without repetition.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub trial_scatter: Option<Scatter>,
    /// Goodness of fit of the model to all means together.
    pub fit: Fit,
    /// Mounting of the sensor in the rig, estimated together with the errors.
    pub rig_from_sensor: MountEstimate,
}

/// The spot of neighboring beams on a board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotRow {
    /// Number of the pose.
    #[schemars(range(max = limits::COUNT))]
    pub pose: usize,
    /// Distance to the board, in meters.
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_m: f64,
    /// The spot.
    pub spot: SpotNote,
}

/// Lines fitted to the extents of the spot: extent = offset + slope·distance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotLaw {
    /// Growth of the width, in millimeters per meter (full angle in milliradians).
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub width_slope_mrad: f64,
    /// Width at distance 0, in millimeters.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub width_offset_mm: f64,
    /// Growth of the height, in millimeters per meter.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub height_slope_mrad: f64,
    /// Height at distance 0, in millimeters.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub height_offset_mm: f64,
}

/// Readings of one board by one beam, the one nearest to the board's center.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StretchRow {
    /// Number of the pose.
    #[schemars(range(max = limits::COUNT))]
    pub pose: usize,
    /// What was tested; absent for a board that was set up to determine the mounting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<TestKind>,
    /// Number of the setting.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = limits::COUNT))]
    pub setting: Option<usize>,
    /// Number of the trial.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(max = limits::COUNT))]
    pub trial: Option<usize>,
    /// The board.
    pub board: String,
    /// Its color.
    pub color: String,
    /// The beam.
    #[schemars(range(max = limits::LAST_BEAM))]
    pub beam: usize,
    /// Distance along the beam to the board as tracked, in meters.
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_m: f64,
    /// Angle between the board's normal and the beam, in degrees; negative if the normal points to smaller azimuths.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub incidence_deg: f64,
    /// Number of readings that are ranges.
    #[schemars(range(max = limits::COUNT))]
    pub readings: usize,
    /// Their mean minus the distance, in millimeters.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub mean_error_mm: f64,
    /// Their standard deviation, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub sd_mm: f64,
}

/// A parameter of Eqs. (3)–(5).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// Its symbol: `E_r`, `A_a`, `B_a`, `A_c` or `B_c`.
    pub symbol: String,
    /// The color it belongs to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// The distance it belongs to, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_m: Option<f64>,
    /// `mm` or `mm/m`.
    pub unit: String,
    /// Its value.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub value: f64,
    /// Its standard deviation.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub sd: f64,
}

/// A parameter that the boards do not determine.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NotObserved {
    /// Its symbol, as in [`Parameter`].
    pub symbol: String,
    /// The color it belongs to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// Why, and what would help.
    pub reason: String,
}

/// A line with its uncertainty: value = slope·distance + offset.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Law {
    /// A_c, in millimeters per meter.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub slope_mm_per_m: f64,
    /// B_c, in millimeters.
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub offset_mm: f64,
    /// Covariance of slope and offset.
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub covariance: [[f64; 2]; 2],
    /// How well the line fits.
    pub fit: Fit,
}

/// A sum of squared residuals in units of their standard deviations, with its degrees of freedom.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fit {
    /// χ².
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub chi_squared: f64,
    /// Its degrees of freedom.
    #[schemars(range(max = limits::COUNT))]
    pub degrees_of_freedom: usize,
}

/// Residual of the cosine law at one incidence.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MisfitRow {
    /// Incidence θ_N, in degrees, regardless of the direction in which the board was turned.
    #[schemars(range(min = 0.0, max = 180.0))]
    pub incidence_deg: f64,
    /// Number of stretches.
    #[schemars(range(max = limits::COUNT))]
    pub stretches: usize,
    /// E_a by the law, in millimeters.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub law_mm: f64,
    /// Measured E_a minus the law, in millimeters.
    #[schemars(range(min = -limits::FAR_MM, max = limits::FAR_MM))]
    pub misfit_mm: f64,
    /// Standard deviation of the misfit, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub sd_mm: f64,
}

/// White noise for one color and distance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseRow {
    /// Color.
    pub color: String,
    /// Distance, in meters.
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_m: f64,
    /// Standard deviation of one reading, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub sd_mm: f64,
    /// Number of readings minus number of means.
    #[schemars(range(max = limits::COUNT))]
    pub degrees_of_freedom: usize,
}

/// Scatter of repeated means.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Standard deviation, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub sd_mm: f64,
    /// Number of repetitions minus number of settings.
    #[schemars(range(max = limits::COUNT))]
    pub degrees_of_freedom: usize,
}

impl Fit {
    /// χ² over its degrees of freedom; NaN without any.
    pub fn reduced(&self) -> f64 {
        self.chi_squared / self.degrees_of_freedom as f64
    }

    /// Whether χ² exceeds its 0.999 quantile.
    pub fn is_rejected(&self) -> bool {
        self.degrees_of_freedom > 0 && self.chi_squared > upper_quantile(self.degrees_of_freedom)
    }
}

/// The 0.999 quantile of χ² (Wilson and Hilferty 1931: 3 % high for one degree of freedom, and increasingly accurate
/// for more).
fn upper_quantile(degrees_of_freedom: usize) -> f64 {
    /// Standard normal deviate of that probability.
    const Z: f64 = 3.090_232_306_167_813;
    let n = degrees_of_freedom as f64;
    let root = 1.0 - 2.0 / (9.0 * n) + Z * (2.0 / (9.0 * n)).sqrt();
    n * root * root * root
}

impl Characterization {
    /// The fitted parameter with a symbol, of a color if it belongs to one.
    pub fn parameter(&self, symbol: &str, color: Option<&str>) -> Option<&Parameter> {
        self.parameters
            .iter()
            .find(|p| p.symbol == symbol && p.color.as_deref() == color)
    }

    /// Root mean square of the standard deviations of all parameters with a symbol, in their unit; 0 if there are none.
    pub fn typical_sd(&self, symbol: &str) -> f64 {
        let squares = self
            .parameters
            .iter()
            .filter(|p| p.symbol == symbol)
            .map(|p| p.sd * p.sd);
        let (sum, count) = squares.fold((0.0, 0.0), |(sum, count), s| (sum + s, count + 1.0));
        if count > 0.0 { f64::sqrt(sum / count) } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quantile_matches_the_tables() {
        // χ² at 0.999: 10.828, 29.588, 149.449 for 1, 10, 100 degrees of freedom; the formula is slightly high for few.
        for (n, table, high) in [(1, 10.828, 0.031), (10, 29.588, 0.006), (100, 149.449, 0.0006)] {
            let off = upper_quantile(n) / table - 1.0;
            assert!((0.0..high).contains(&off), "{n}: {off}");
        }
        let fit = |chi_squared| Fit {
            chi_squared,
            degrees_of_freedom: 10,
        };
        assert!(fit(30.0).is_rejected() && !fit(29.0).is_rejected());
        assert!((fit(15.0).reduced() - 1.5).abs() < 1e-15);
    }
}
