//! The room with its boards and colors, motion capture, and the procedure.

use super::Marker;
use super::body::{RoomMirror, RoomSurface};
use super::errors::NoiseTable;
use super::mishap::Mishap;
use super::test::SensorTest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A surface color as the scanner's light sees it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Color {
    /// Share of the light that is scattered back, ρ_t.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: f64,
    /// Noise of readings from it, instead of `errors.noise`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseTable>,
}

/// A target board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Name, also its motion-capture subject.
    pub name: String,
    /// Extent along its x axis, in millimetres.
    #[schemars(range(min = 10.0, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along its y axis, in millimetres.
    #[schemars(range(min = 10.0, max = 10000.0))]
    pub height_mm: f64,
    /// Color.
    #[serde(default = "white")]
    pub color: String,
    /// Markers on its face; the first three are P_p1…P_p3. Without any, five are put near the edges.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
}

fn white() -> String {
    "white".to_owned()
}

/// A box-shaped room and what stands in it; the room frame stands on the middle of the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Room {
    /// Extents along x, y and z, in metres. Left out, as `trace` and flights allow, there are no walls.
    #[serde(skip_serializing_if = "has_no_walls")]
    #[schemars(inner(range(min = 0.5, max = 100.0)))]
    pub size_m: [f64; 3],
    /// Color of walls, floor and ceiling.
    pub color: String,
    /// Origin of the rig in the room, in metres.
    pub rig_position_m: [f64; 3],
    /// Yaw of the rig in the room, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub rig_yaw_deg: f64,
    /// Mirrors that stand in the room by themselves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mirror: Vec<RoomMirror>,
    /// Surfaces that stand in the room by themselves.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub surface: Vec<RoomSurface>,
}

/// A room of no size has no walls.
fn has_no_walls(size_m: &[f64; 3]) -> bool {
    *size_m == [0.0; 3]
}

impl Room {
    /// Whether there are walls.
    pub fn has_walls(&self) -> bool {
        !has_no_walls(&self.size_m)
    }
}

impl Default for Room {
    fn default() -> Self {
        Self {
            size_m: [0.0; 3],
            color: white(),
            rig_position_m: [0.0; 3],
            rig_yaw_deg: 0.0,
            mirror: Vec::new(),
            surface: Vec::new(),
        }
    }
}

/// How good motion capture is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum MocapProfile {
    /// 0.15 mm constant error and 0.025 mm jitter per marker (Merriaux et al., Sensors 2017).
    #[default]
    Modern,
    /// 3.4, 1.6 and 6 mm constant error along x, y and z.
    Cooper,
    /// Exact.
    Ideal,
    /// One's own: `mocap.marker`.
    Custom,
}

/// Errors of a marker along each axis, 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkerNoise {
    /// Constant while its body stays where it is, in millimetres.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub constant_sd_mm: f64,
    /// New in every frame, in millimetres.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub jitter_sd_mm: f64,
}

/// Motion capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mocap {
    /// How good it is.
    pub profile: MocapProfile,
    /// Errors of a marker, with the profile "custom".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker: Option<MarkerNoise>,
    /// Whether the rig's markers are seen without any error: its place was surveyed by better means.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub rig_exact: bool,
    /// Frames per second.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub frame_rate_hz: f64,
    /// Chance that a marker is not seen in a frame.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub dropout: f64,
}

impl Default for Mocap {
    fn default() -> Self {
        Self {
            profile: MocapProfile::Modern,
            marker: None,
            rig_exact: false,
            frame_rate_hz: 100.0,
            dropout: 0.01,
        }
    }
}

/// The procedure: Cooper, steps 1 to 10.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Experiment {
    /// Board poses for every group of beams.
    #[schemars(range(min = 1, max = 1000))]
    pub poses_per_group: u32,
    /// Scans at every pose.
    #[schemars(range(min = 1, max = 1000000))]
    pub scans_per_pose: u32,
    /// Widest group of beams that one board is set up for, in degrees of base azimuth.
    #[schemars(range(min = 0.25, max = 270.0))]
    pub group_span_deg: f64,
    /// Least and greatest tilt of a board against the beam it is set up for, in degrees.
    #[schemars(inner(range(min = 0.0, max = 80.0)))]
    pub tilt_deg: [f64; 2],
    /// Least and greatest distance of a board from the mirror, in metres; what the room allows.
    #[schemars(inner(range(min = 0.05, max = 100.0)))]
    pub range_m: [f64; 2],
    /// Board poses before beams that no mirror deflects.
    #[schemars(range(min = 0, max = 1000))]
    pub direct_poses: u32,
    /// How board poses before facets are chosen.
    #[serde(skip_serializing_if = "Design::is_even")]
    pub design: Design,
    /// How well the distances to the bare structure are known, 1σ, in millimetres, if they are measured by other means
    /// than the scanner: one error for all beams of a facet. The bare structure is then not scanned.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bare_distance_sd_mm: Option<f64>,
    /// Scans of the empty room.
    #[schemars(range(min = 1, max = 1000000))]
    pub room_scans: u32,
    /// Scans of the bare structure.
    #[schemars(range(min = 1, max = 1000000))]
    pub bare_scans: u32,
    /// How far a person misses the place meant for a board, per axis, 1σ, in millimetres.
    #[schemars(range(min = 0.0, max = 500.0))]
    pub placement_sd_mm: f64,
    /// How far a person misses the attitude meant for a board, per axis, 1σ, in degrees.
    #[schemars(range(min = 0.0, max = 30.0))]
    pub placement_sd_deg: f64,
    /// Time between two stretches, in seconds.
    #[schemars(range(min = 0.0, max = 3600.0))]
    pub pause_s: f64,
    /// Board poses given one by one. With any, none are chosen by the rules above.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pose: Vec<BoardPose>,
    /// What goes wrong during the recording, which a calibration has to find out.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mishap: Vec<Mishap>,
    /// Tests of the bare sensor: Cooper, step 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub test: Vec<SensorTest>,
    /// How far a person misreads the edge of a spot on a board, 1σ, in millimetres (assumed); he notes whole tenths.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "is_default_spot_reading")]
    pub spot_sd_mm: f64,
}

/// How board poses before facets are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// As a careful person does: the direction of tilt goes round evenly, every board catches its whole group.
    #[default]
    Even,
    /// By chance: a board is aimed at any beam of its group, with any direction of tilt, and any tilt and distance
    /// within their bounds; it catches what it catches.
    Random,
}

impl Design {
    fn is_even(&self) -> bool {
        *self == Self::Even
    }
}

/// The default keeps out of files: a scene without tests has no use for it.
fn is_default_spot_reading(sd: &f64) -> bool {
    *sd == SPOT_SD_MM
}

/// A ruler on the board, read to half its divisions.
const SPOT_SD_MM: f64 = 0.25;

/// One pose of a board, in the room frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoardPose {
    /// The board.
    pub board: String,
    /// Facet in whose fan it stands; none for a board before undeflected beams.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// Center of its face, in metres.
    pub center_m: [f64; 3],
    /// Normal of its face; any length.
    pub normal: [f64; 3],
    /// Turn about the normal, in degrees; at 0 the board's x axis is horizontal.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub turn_deg: f64,
}

impl Default for Experiment {
    fn default() -> Self {
        Self {
            poses_per_group: 6,
            scans_per_pose: 100,
            group_span_deg: 16.0,
            tilt_deg: [30.0, 50.0],
            range_m: [0.9, 1.5],
            direct_poses: 9,
            design: Design::Even,
            bare_distance_sd_mm: None,
            room_scans: 100,
            bare_scans: 100,
            placement_sd_mm: 10.0,
            placement_sd_deg: 2.0,
            pause_s: 5.0,
            pose: Vec::new(),
            mishap: Vec::new(),
            test: Vec::new(),
            spot_sd_mm: SPOT_SD_MM,
        }
    }
}
