//! How far a calibration is to be believed, as its own data tell: part of `calibration.json`.

use serde::{Deserialize, Serialize};

/// What a method that estimates everything at once says about itself.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Assessment {
    /// What a person would say, in a sentence or two.
    pub verdict: String,
    /// Whether the residuals are as large as the errors believed in make them.
    pub global_test: ChiSquaredTest,
    /// How far the facets are from plane.
    pub planeness: Planeness,
    /// The errors believed in, and as large as the readings say they are.
    pub variance_components: Vec<VarianceComponent>,
    /// What all elements share: mounting and biases.
    pub parameters: Vec<SharedParameter>,
    /// Correlations of the shared parameters, row by row.
    pub correlations: Vec<Vec<f64>>,
    /// Facets whose planes the boards leave open, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub open: Vec<String>,
    /// Largest studentized residual.
    pub largest_residual: LargestResidual,
    /// What boards that were left out of the calibration say of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
}

/// A sum of squared residuals in units of their standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChiSquaredTest {
    /// χ².
    pub chi_squared: f64,
    /// Residuals less estimated parameters, priors counted as residuals.
    pub degrees_of_freedom: usize,
    /// Chance of a χ² at least as large, if all beliefs hold.
    pub p_value: f64,
}

/// How far facets are from plane, 1σ, and the test that they are plane.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Planeness {
    /// Tilt of a facet's normal along its fan about its mean, about each axis, in degrees.
    pub figure_deg: f64,
    /// Departure τ of a beam's direction from what its facet gives it, along each axis, in degrees.
    pub departure_deg: f64,
    /// Likelihood ratio against facets that are plane.
    pub statistic: f64,
    /// Chance of a ratio at least as large if they are.
    pub p_value: f64,
}

/// A kind of error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct VarianceComponent {
    /// What it is.
    pub name: String,
    /// 1σ as believed, in millimetres.
    pub believed_mm: f64,
    /// 1σ as found, in millimetres; absent where the readings say nothing of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found_mm: Option<f64>,
    /// 1σ of that, in millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub found_sd_mm: Option<f64>,
}

/// A number that all elements share.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SharedParameter {
    /// What it is, with its unit: its change from what was believed.
    pub name: String,
    /// Change from what was believed before.
    pub change: f64,
    /// 1σ before.
    pub believed_sd: f64,
    /// 1σ after.
    pub sd: f64,
}

/// The reading that fits worst.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LargestResidual {
    /// Residual over its standard deviation.
    pub studentized: f64,
    /// Beam.
    pub beam: usize,
    /// Number of the pose.
    pub pose: usize,
}

/// Cross-validation: every board is predicted by a calibration that has not seen it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Boards left out, each once.
    pub boards: usize,
    /// Means of an element's readings of them.
    pub means: usize,
    /// Root mean square of what they differ from the prediction, in millimetres.
    pub rms_mm: f64,
    /// What it should be by the stated covariance and the errors believed in, in millimetres.
    pub expected_mm: f64,
    /// Mean difference, in millimetres.
    pub mean_mm: f64,
}
