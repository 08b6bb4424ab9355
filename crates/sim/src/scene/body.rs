//! Mirrors and surfaces fixed in the room.

use super::omit::{is_false, is_zero};
use super::shape::MeshShape;
use super::superstructure::Glass;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A mirror fixed in the room, in any orientation. It is exactly at its stated pose.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomMirror {
    /// Name.
    pub name: String,
    /// Its outline, in its own frame.
    pub shape: PlaneShape,
    /// Origin of its own frame in the room, in meters.
    #[serde(default)]
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub position_m: [f64; 3],
    /// Yaw of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Whether its back reflects too.
    #[serde(default, skip_serializing_if = "is_false")]
    pub two_sided: bool,
    /// Thickness of its body, in millimeters: the distance between the face and the back.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub thickness_mm: f64,
    /// Glass in front of the reflecting surface.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub glass: Option<Glass>,
}

/// A surface fixed in the room that scatters light.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomSurface {
    /// Name.
    pub name: String,
    /// Its shape, in its own frame.
    pub shape: SurfaceShape,
    /// Origin of its own frame in the room, in meters.
    #[serde(default)]
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub position_m: [f64; 3],
    /// Yaw of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll of its own frame, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Color.
    #[serde(default = "white")]
    pub color: String,
}

fn white() -> String {
    "white".to_owned()
}

/// A plane outline, in meters.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum PlaneShape {
    /// A rectangle with a given center and normal.
    Rectangle(PlaneRectangle),
    /// Given corners.
    Polygon(PlanePolygon),
}

/// A rectangle with two sides parallel to the x–y plane of its frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlaneRectangle {
    /// Center, in meters.
    #[serde(default)]
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub center_m: [f64; 3],
    /// Normal of its face; any length.
    #[serde(default = "up")]
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub normal: [f64; 3],
    /// Extent parallel to the x–y plane, along x if the normal is ±z, in meters.
    #[schemars(range(min = 0.0001, max = 1000.0))]
    pub width_m: f64,
    /// Extent along the other side, in meters.
    #[schemars(range(min = 0.0001, max = 1000.0))]
    pub height_m: f64,
}

fn up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

/// Given corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanePolygon {
    /// Corners of a convex plane polygon, in meters, counter-clockwise seen from the face.
    #[schemars(length(min = 3))]
    #[schemars(inner(inner(range(min = -10000.0, max = 10000.0))))]
    pub corners_m: Vec<[f64; 3]>,
}

/// Shape of a surface in the room, in its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum SurfaceShape {
    /// A rectangle with a given center and normal.
    Rectangle(PlaneRectangle),
    /// Given corners.
    Polygon(PlanePolygon),
    /// A box, centered on its frame.
    Box(RoomBox),
    /// A cylinder along z, centered on its frame.
    Cylinder(RoomCylinder),
    /// A mesh.
    Mesh(MeshShape),
}

/// A box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomBox {
    /// Extents along x, y and z, in meters.
    #[schemars(inner(range(min = 0.0001, max = 1000.0)))]
    pub size_m: [f64; 3],
}

/// A cylinder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomCylinder {
    /// Diameter, in meters.
    #[schemars(range(min = 0.0001, max = 1000.0))]
    pub diameter_m: f64,
    /// Extent along z, in meters.
    #[schemars(range(min = 0.0001, max = 1000.0))]
    pub height_m: f64,
}
