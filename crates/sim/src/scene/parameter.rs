//! Named numbers of a design, with limits.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A named number from which other values of the scene are computed, and the limits within which it may be chosen. Its
/// name carries its unit: `reach_mm`. In a file, `reach_mm = 64` is short for `reach_mm = { value = 64 }`, and any
/// number of the scene may be an expression: `"= reach_mm + 5"`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Parameter {
    /// The number.
    #[schemars(range(min = -1e12, max = 1e12))]
    pub value: f64,
    /// Its minimum; only a parameter with both limits is searched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub low: Option<f64>,
    /// Its maximum.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -1e12, max = 1e12))]
    pub high: Option<f64>,
}
