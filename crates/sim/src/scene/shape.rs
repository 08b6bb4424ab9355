//! Shapes of bodies: meshes from files, and rods.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The unit of a mesh file's numbers, which few formats specify.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MeshUnits {
    /// Meters.
    M,
    /// Millimeters.
    #[default]
    Mm,
    /// Inches.
    Inch,
}

impl MeshUnits {
    /// One unit, in meters.
    pub fn in_meters(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Mm => 1e-3,
            Self::Inch => 25.4e-3,
        }
    }
}

/// A triangle mesh from a file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshShape {
    /// An STL, OBJ or PLY file; a relative path starts at the folder of the scene.
    #[schemars(length(min = 1))]
    pub file: String,
    /// Unit of the file's numbers.
    #[serde(default)]
    pub units: MeshUnits,
}

/// Shape of a post that is not a box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PostShape {
    /// A round rod along its own z axis.
    Cylinder(PostCylinder),
    /// A mesh.
    Mesh(MeshShape),
}

/// A round rod.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PostCylinder {
    /// Diameter, in millimeters.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub diameter_mm: f64,
    /// Extent along its own z, in millimeters.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub height_mm: f64,
}
