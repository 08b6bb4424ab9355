//! What is built around the scanner: mirrors, posts, markers, and their deviations from the drawing.

use super::coating::{Coating, Dust};
use super::facet::Facet;
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

/// An opaque body: a box with `size_mm`, or another `shape`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Post {
    /// Name.
    pub name: String,
    /// Origin of its own frame, in millimeters; the center of a box or cylinder.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
    pub center_mm: [f64; 3],
    /// Extents of a box along its own x, y and z, in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = 0.01, max = 10000.0))))]
    #[schemars(inner(range(min = 0.0, max = 100000.0)))]
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
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
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
    /// What reflects, instead of `reflectivity`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coating: Option<Coating>,
    /// Dust on the mirrors.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub dust: Option<Dust>,
}

impl Mirror {
    /// Share of the light that a plain mirror and the dust on it reflect.
    pub fn reflected(&self) -> f64 {
        self.dust
            .map_or(self.reflectivity, |dust| self.reflectivity * dust.passed())
    }

    /// Share of the light that a mirror and the dust on it scatter.
    pub fn scattered(&self) -> f64 {
        let by_dust = self.dust.map_or(0.0, |dust| dust.cover * dust.reflectivity);
        self.diffuse_reflectivity + by_dust
    }
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
            coating: None,
            dust: None,
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
