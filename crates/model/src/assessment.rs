//! How far a calibration can be trusted, as determined from its own data: part of `calibration.json`.

use crate::limits;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The self-assessment of a method that estimates everything at once.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Assessment {
    /// Remarks for the reader, in a sentence or two.
    pub verdict: String,
    /// Whether the residuals are as large as the assumed errors predict.
    pub global_test: ChiSquaredTest,
    /// Slope error of the facets.
    pub planeness: Planeness,
    /// The assumed errors, and their size as estimated from the readings.
    pub variance_components: Vec<VarianceComponent>,
    /// Parameters shared by all elements: mounting and biases.
    pub parameters: Vec<SharedParameter>,
    /// Correlations of the shared parameters, in row-major order.
    #[schemars(inner(inner(range(min = -limits::WHOLE, max = limits::WHOLE))))]
    pub correlations: Vec<Vec<f64>>,
    /// Test of each kind of error: whether the readings contradict what is assumed of it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<ComponentTest>,
    /// The assumptions that the readings contradict, the clearest first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub doubts: Vec<Doubt>,
    /// Facets whose planes the boards do not determine, and why.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub open: Vec<String>,
    /// Largest studentized residual.
    pub largest_residual: LargestResidual,
    /// Errors on boards that were left out of the calibration.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub held_out: Option<HeldOut>,
}

/// A sum of squared residuals in units of their standard deviations.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChiSquaredTest {
    /// χ².
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub chi_squared: f64,
    /// Number of residuals minus number of estimated parameters; priors count as residuals.
    #[schemars(range(max = limits::COUNT))]
    pub degrees_of_freedom: usize,
    /// Probability of a χ² at least as large if all assumptions hold.
    #[schemars(range(min = 0.0, max = limits::WHOLE))]
    pub p_value: f64,
}

/// What may be wrong with the assumptions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Cause {
    /// The drift of a pose is larger.
    Drift,
    /// The error of a board's markers is larger.
    Markers,
    /// The ranges drift in the course of the recording.
    WarmUp,
    /// Noise is correlated from scan to scan.
    CorrelatedNoise,
    /// Noise is correlated from beam to beam.
    NeighborNoise,
    /// Single beams are off from pose to pose.
    Noise,
    /// The faces of all boards are nearer or farther than their markers.
    BoardThickness,
    /// One board was not where it was tracked.
    Board,
    /// The path in the mirrors is longer or shorter.
    Glass,
    /// The distances to the bare structure are off, or the thickness of the mirrors.
    BareDistances,
    /// E_r has another shape.
    DistanceBias,
    /// E_a has another shape.
    AngleBias,
    /// The errors found in step 1 are farther off than their uncertainty.
    Characterization,
    /// The sensor is farther from its drawn pose than its tolerance.
    Mounting,
}

/// The test of one kind of error, as if nothing else were wrong.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ComponentTest {
    /// What would be wrong.
    pub cause: Cause,
    /// χ².
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub statistic: f64,
    /// Its degrees of freedom: how many numbers of this kind the readings determine, not always a whole number.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub degrees_of_freedom: f64,
    /// Probability of a χ² at least as large if all assumptions hold; of the largest of several, for boards.
    #[schemars(range(min = 0.0, max = limits::WHOLE))]
    pub p_value: f64,
}

/// An assumption that the readings contradict.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Doubt {
    /// What is wrong; of several causes the readings do not determine which one.
    pub causes: Vec<Cause>,
    /// Numbers of the poses concerned, if it is not all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(inner(range(max = limits::COUNT)))]
    pub poses: Vec<usize>,
    /// χ².
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub statistic: f64,
    /// Its degrees of freedom.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub degrees_of_freedom: f64,
    /// The doubt as a sentence.
    pub message: String,
}

/// Slope error of the facets, 1σ, and the test of the hypothesis that they are flat.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Planeness {
    /// Tilt of a facet's normal along its fan about its mean, about each axis, in degrees.
    #[schemars(range(min = 0.0, max = limits::TURN_DEG))]
    pub figure_deg: f64,
    /// Deviation τ of a beam's direction from the one its facet's plane gives, along each axis, in degrees.
    #[schemars(range(min = 0.0, max = limits::TURN_DEG))]
    pub departure_deg: f64,
    /// Likelihood ratio against perfectly flat facets.
    #[schemars(range(min = -limits::ANY, max = limits::ANY))]
    pub statistic: f64,
    /// Probability of a ratio at least as large if the facets are flat.
    #[schemars(range(min = 0.0, max = limits::WHOLE))]
    pub p_value: f64,
}

/// A kind of error.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VarianceComponent {
    /// Name of the error.
    pub name: String,
    /// 1σ as assumed, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub believed_mm: f64,
    /// 1σ as estimated, in millimeters; absent if the readings do not constrain it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub found_mm: Option<f64>,
    /// Standard error of that estimate, in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub found_sd_mm: Option<f64>,
}

/// A parameter shared by all elements.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SharedParameter {
    /// Name and unit of the parameter, which is a change from its prior value.
    pub name: String,
    /// Change from the prior value.
    #[schemars(range(min = -limits::ANY, max = limits::ANY))]
    pub change: f64,
    /// 1σ of the prior.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub believed_sd: f64,
    /// 1σ of the estimate.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub sd: f64,
}

/// The reading that fits worst.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LargestResidual {
    /// Residual over its standard deviation.
    #[schemars(range(min = -limits::ANY, max = limits::ANY))]
    pub studentized: f64,
    /// Beam.
    #[schemars(range(max = limits::LAST_BEAM))]
    pub beam: usize,
    /// Number of the pose.
    #[schemars(range(max = limits::COUNT))]
    pub pose: usize,
}

/// Cross-validation: every board is predicted by a calibration that has not seen it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HeldOut {
    /// Number of boards left out, one at a time.
    #[schemars(range(max = limits::COUNT))]
    pub boards: usize,
    /// Number of element means on those boards.
    #[schemars(range(max = limits::COUNT))]
    pub means: usize,
    /// Root mean square difference from the prediction, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub rms_mm: f64,
    /// Its expected value, given the stated covariance and the assumed errors, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ANY))]
    pub expected_mm: f64,
    /// Mean difference, in millimeters.
    #[schemars(range(min = -limits::ANY, max = limits::ANY))]
    pub mean_mm: f64,
}
