//! What is built around the scanner: mirrors, posts, markers, and their deviations from the drawing.

use super::omit::{is_false, is_zero};
use super::pattern::Pattern;
use super::shape::PostShape;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Mirrors, posts and markers around the scanner, in the sensor frame of the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Superstructure {
    /// The mirrors.
    #[serde(default)]
    pub facet: Vec<Facet>,
    /// Mirrors that are copies of others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pattern: Vec<Pattern>,
    /// Opaque bodies.
    #[serde(default)]
    pub post: Vec<Post>,
    /// Markers of the rig body, in the rig frame.
    #[serde(default)]
    pub marker: Vec<Marker>,
    /// The mirror material.
    #[serde(default)]
    pub mirror: Mirror,
    /// Deviations of the structure as built from the drawing.
    #[serde(default)]
    pub as_built: AsBuilt,
    /// Maximum number of mirrors that a beam may hit in succession.
    #[serde(default = "four")]
    #[schemars(range(min = 1, max = 8))]
    pub max_bounces: u32,
}

fn four() -> u32 {
    4
}

impl Default for Superstructure {
    fn default() -> Self {
        Self {
            facet: Vec::new(),
            pattern: Vec::new(),
            post: Vec::new(),
            marker: Vec::new(),
            mirror: Mirror::default(),
            as_built: AsBuilt::default(),
            max_bounces: four(),
        }
    }
}

/// A plane mirror.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facet {
    /// Name.
    pub name: String,
    /// Its outline.
    pub shape: FacetShape,
    /// Whether the back of its body, `mirror.thickness_mm` behind the face, reflects too.
    #[serde(default, skip_serializing_if = "is_false")]
    pub two_sided: bool,
}

/// Outline of a facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FacetShape {
    /// Bounded by two azimuths and two heights, and oriented so that its middle beam leaves in a given direction.
    Wedge(Wedge),
    /// A rectangle around one beam, oriented so that the beam leaves in a given direction, or with a given normal.
    Plate(Plate),
    /// A rectangle with a given center and normal.
    Rectangle(RectangleShape),
    /// Given corners.
    Polygon(PolygonShape),
}

/// A facet between two azimuths.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Wedge {
    /// First and last azimuth, in degrees, the smaller first.
    #[schemars(inner(range(min = -360.0, max = 360.0)))]
    pub azimuth_deg: [f64; 2],
    /// Distance from the sensor origin along the middle azimuth, in millimeters.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub distance_mm: f64,
    /// Azimuth in which the middle beam leaves, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub exit_azimuth_deg: f64,
    /// Elevation in which the middle beam leaves, in degrees.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub exit_elevation_deg: f64,
    /// Height of the facet, centered on the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

/// A rectangle around one beam: `azimuth_deg` or `beam`, and either both `exit_` or both `normal_` angles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plate {
    /// Azimuth of the beam that hits its center, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub azimuth_deg: Option<f64>,
    /// The same beam by its index.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 35999))]
    pub beam: Option<u32>,
    /// Distance from the sensor origin to its center, in millimeters.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub distance_mm: f64,
    /// Azimuth in which that beam leaves, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub exit_azimuth_deg: Option<f64>,
    /// Elevation in which that beam leaves, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -90.0, max = 90.0))]
    pub exit_elevation_deg: Option<f64>,
    /// Yaw: azimuth of the normal of the reflecting side, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub normal_azimuth_deg: Option<f64>,
    /// Pitch: elevation of that normal, in degrees.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -90.0, max = 90.0))]
    pub normal_elevation_deg: Option<f64>,
    /// Extent parallel to the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along the other side, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

/// A rectangular facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleShape {
    /// Center, in millimeters.
    pub center_mm: [f64; 3],
    /// Normal of the reflecting side; any length.
    pub normal: [f64; 3],
    /// Extent parallel to the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along the other side, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

/// A facet with given corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonShape {
    /// Corners of a convex plane polygon, in millimeters, counter-clockwise seen from the reflecting side.
    #[schemars(length(min = 3))]
    pub corners_mm: Vec<[f64; 3]>,
}

/// An opaque body: a box with `size_mm`, or another `shape`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Post {
    /// Name.
    pub name: String,
    /// Origin of its own frame, in millimeters; the center of a box or cylinder.
    pub center_mm: [f64; 3],
    /// Extents of a box along its own x, y and z, in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = 0.01, max = 10000.0))))]
    pub size_mm: Option<[f64; 3]>,
    /// Its shape, if it is not a box.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<PostShape>,
    /// Rotation about z, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch, in degrees: yaw, pitch and roll are applied in succession about the body's own z, y and x.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll, in degrees.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
    /// Surface color.
    #[serde(default = "structure")]
    pub color: String,
}

fn structure() -> String {
    "structure".to_owned()
}

/// A labeled marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Label.
    pub name: String,
    /// Position in the frame of its body, in millimeters.
    pub position_mm: [f64; 3],
}

/// The mirror material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mirror {
    /// Share of the light that is reflected; it applies to the outgoing and again to the returning light.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: f64,
    /// Thickness between the bare structure and the reflecting face, in millimeters.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub thickness_mm: f64,
    /// Glass in front of the reflecting surface; without it, the mirrors are front-surface mirrors. The drawing then
    /// shows the front of the glass.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub glass: Option<Glass>,
    /// Share of the light that dust and scratches on a mirror scatter, as a Lambertian surface in its place would.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub diffuse_reflectivity: f64,
}

/// Glass in front of the reflecting surface of a mirror.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Glass {
    /// Refractive index (float glass at 905 nm: 1.51).
    #[serde(default = "float_glass")]
    #[schemars(range(min = 1.0, max = 4.0))]
    pub index: f64,
    /// Thickness, in millimeters.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub thickness_mm: f64,
    /// Whether the front of the glass reflects too: the Fresnel share, along a second, weaker path.
    #[serde(default, skip_serializing_if = "is_false")]
    pub ghost: bool,
}

fn float_glass() -> f64 {
    1.51
}

impl Default for Mirror {
    fn default() -> Self {
        Self {
            reflectivity: 0.9,
            thickness_mm: 1.0,
            glass: None,
            diffuse_reflectivity: 0.0,
        }
    }
}

/// Deviations of the structure as built from the drawing, 1σ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AsBuilt {
    /// Rotation of a facet about each axis, in degrees.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub tilt_sd_deg: f64,
    /// Shift of a facet along each axis, in millimeters.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub shift_sd_mm: f64,
    /// Root mean square of the slope of a facet's surface relative to its plane, in milliradians (assumed).
    #[schemars(range(min = 0.0, max = 50.0))]
    pub slope_rms_mrad: f64,
    /// Deviation of a mirror's thickness from `mirror.thickness_mm`, in millimeters: its face is then that much farther
    /// from the bare structure.
    #[serde(skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 20.0))]
    pub thickness_sd_mm: f64,
}

impl Default for AsBuilt {
    fn default() -> Self {
        Self {
            tilt_sd_deg: 1.0,
            shift_sd_mm: 0.5,
            slope_rms_mrad: 0.2,
            thickness_sd_mm: 0.0,
        }
    }
}
