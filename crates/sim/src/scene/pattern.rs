//! Facets that are copies of others.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Copies of facets. Each becomes an ordinary facet before the scene is used ([`crate::build::pattern::expand`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Pattern {
    /// One facet, repeated around the scanner's axis.
    Ring(Ring),
    /// Mirror images of facets.
    MirrorImage(MirrorImage),
    /// Copies of one facet, given one by one.
    List(CopyList),
}

/// A facet and its copies around the scanner's axis, each rotated by one more step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ring {
    /// The facet that is copied; it is the first of the ring. The others are named NAME-2, NAME-3 …
    pub of: String,
    /// Number of facets in the ring, including the first.
    #[schemars(range(min = 2, max = 360))]
    pub count: u32,
    /// Angle from one to the next, in degrees, counter-clockwise; 360°/count by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub step_deg: Option<f64>,
}

/// Mirror images of facets.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MirrorImage {
    /// The facets.
    #[schemars(length(min = 1))]
    pub of: Vec<String>,
    /// What is exchanged; both in succession are half a turn about x.
    #[schemars(length(min = 1, max = 2))]
    pub across: Vec<Exchange>,
    /// Names of the images in the same order; NAME-image by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub names: Option<Vec<String>>,
}

/// What a mirror image exchanges.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Exchange {
    /// y becomes −y.
    LeftRight,
    /// z becomes −z.
    UpDown,
}

/// Copies of one facet, each with its own name and pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CopyList {
    /// The facet that is copied.
    pub of: String,
    /// The copies.
    #[schemars(length(min = 1))]
    pub copy: Vec<FacetCopy>,
}

/// A copy of a facet: first mirrored, then rotated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FacetCopy {
    /// Its name.
    pub name: String,
    /// Rotation about the scanner's axis, in degrees, counter-clockwise.
    #[serde(default, skip_serializing_if = "super::omit::is_zero")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub turn_deg: f64,
    /// What is exchanged before the rotation.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub across: Vec<Exchange>,
}
