//! The room with its boards and colors, motion capture, and the procedure.

use super::Marker;
use super::body::{RoomMirror, RoomSurface};
use super::errors::NoiseTable;
use super::mishap::Mishap;
use super::omit::is_zero;
use super::test::SensorTest;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A surface color at the wavelength of the scanner.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Color {
    /// Share of the light that is scattered back, ρ_t.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: f64,
    /// Noise of readings of this color, instead of `errors.noise`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<NoiseTable>,
}

/// A target board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Board {
    /// Name, also its motion-capture subject.
    pub name: String,
    /// Extent along its x axis, in millimeters.
    #[schemars(range(min = 10.0, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along its y axis, in millimeters.
    #[schemars(range(min = 10.0, max = 10000.0))]
    pub height_mm: f64,
    /// How far its face is in front of the plane that its markers span, along its z axis, in millimeters.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub thickness_mm: f64,
    /// Color.
    #[serde(default = "white")]
    pub color: String,
    /// Markers on its face; the first three are P_p1…P_p3. Without any, five are placed near the edges.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub marker: Vec<Marker>,
}

fn white() -> String {
    "white".to_owned()
}

/// A box-shaped room and its contents; the origin of the room frame is the center of the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Room {
    /// Extents along x, y and z, in meters. If omitted, which `trace` and flights allow, there are no walls.
    #[serde(skip_serializing_if = "has_no_walls")]
    #[schemars(inner(range(min = 0.5, max = 100.0)))]
    pub size_m: [f64; 3],
    /// Color of walls, floor and ceiling.
    pub color: String,
    /// Origin of the rig in the room, in meters.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub rig_position_m: [f64; 3],
    /// Yaw of the rig in the room, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub rig_yaw_deg: f64,
    /// Mirrors fixed in the room.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mirror: Vec<RoomMirror>,
    /// Surfaces fixed in the room.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub surface: Vec<RoomSurface>,
}

/// A room without size has no walls.
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

/// How accurate motion capture is.
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
    /// User-supplied: `mocap.marker`.
    Custom,
}

/// Errors of a marker along each axis, 1σ.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MarkerNoise {
    /// Constant while its body does not move, in millimeters.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub constant_sd_mm: f64,
    /// Drawn anew in every motion-capture frame, in millimeters.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 100.0))]
    pub jitter_sd_mm: f64,
}

/// Motion capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mocap {
    /// How accurate it is.
    pub profile: MocapProfile,
    /// Errors of a marker, for the profile "custom".
    #[serde(skip_serializing_if = "Option::is_none")]
    pub marker: Option<MarkerNoise>,
    /// Whether the rig's markers are seen without any error, as if its pose had been surveyed by better means.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub rig_exact: bool,
    /// Frames per second.
    #[schemars(range(min = 1.0, max = 1000.0))]
    pub frame_rate_hz: f64,
    /// Probability that a marker is not seen in a frame.
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
    /// Number of board poses for every group of beams.
    #[schemars(range(min = 1, max = 1000))]
    pub poses_per_group: u32,
    /// Number of scans at every pose.
    #[schemars(range(min = 1, max = 1000000))]
    pub scans_per_pose: u32,
    /// Widest group of beams for which one board is set up, in degrees of base azimuth.
    #[schemars(range(min = 0.25, max = 270.0))]
    pub group_span_deg: f64,
    /// Minimum and maximum tilt of a board against the beam for which it is set up, in degrees.
    #[schemars(inner(range(min = 0.0, max = 80.0)))]
    pub tilt_deg: [f64; 2],
    /// Minimum and maximum distance of a board from the mirror, in meters, as far as the room allows.
    #[schemars(inner(range(min = 0.05, max = 100.0)))]
    pub range_m: [f64; 2],
    /// Number of board poses in front of beams that no mirror deflects.
    #[schemars(range(min = 0, max = 1000))]
    pub direct_poses: u32,
    /// How board poses in front of facets are chosen.
    #[serde(skip_serializing_if = "Design::is_even")]
    pub design: Design,
    /// How well the distances to the bare structure are known, 1σ, in millimeters, if they are measured by means other
    /// than the scanner: one error for all beams of a facet. The bare structure is then not scanned.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bare_distance_sd_mm: Option<f64>,
    /// Error of such a distance that no other beam shares, 1σ, in millimeters; as large as `bare_distance_sd_mm` if it
    /// is omitted.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bare_noise_sd_mm: Option<f64>,
    /// Error of all distances to the bare structure that nobody knows of, in millimeters.
    #[schemars(range(min = -100.0, max = 100.0))]
    #[serde(skip_serializing_if = "is_zero")]
    pub bare_distance_error_mm: f64,
    /// Number of scans of the empty room.
    #[schemars(range(min = 1, max = 1000000))]
    pub room_scans: u32,
    /// Number of scans of the bare structure.
    #[schemars(range(min = 1, max = 1000000))]
    pub bare_scans: u32,
    /// Error of a person in positioning a board, per axis, 1σ, in millimeters.
    #[schemars(range(min = 0.0, max = 500.0))]
    pub placement_sd_mm: f64,
    /// Error of a person in orienting a board, per axis, 1σ, in degrees.
    #[schemars(range(min = 0.0, max = 30.0))]
    pub placement_sd_deg: f64,
    /// Time between two stretches, in seconds.
    #[schemars(range(min = 0.0, max = 3600.0))]
    pub pause_s: f64,
    /// Board poses given individually. If there are any, none are chosen by the rules above.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub pose: Vec<BoardPose>,
    /// What goes wrong during the recording, which a calibration has to detect.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub mishap: Vec<Mishap>,
    /// Tests of the bare sensor: Cooper, step 1.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub test: Vec<SensorTest>,
    /// Error of a person in reading the edge of a spot on a board, 1σ, in millimeters (assumed); noted in whole tenths.
    #[schemars(range(min = 0.0, max = 100.0))]
    #[serde(skip_serializing_if = "is_default_spot_reading")]
    pub spot_sd_mm: f64,
}

/// How board poses in front of facets are chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Design {
    /// As a careful person does: the direction of tilt rotates evenly, and every board catches its whole group.
    #[default]
    Even,
    /// At random: a board is aimed at any beam of its group, with any direction of tilt, and any tilt and distance
    /// within their bounds; it catches whatever beams hit it.
    Random,
}

impl Design {
    fn is_even(&self) -> bool {
        *self == Self::Even
    }
}

/// The default is omitted from files: a scene without tests does not need it.
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
    /// Facet in whose fan it is; none for a board in front of undeflected beams.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// Center of its face, in meters.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub center_m: [f64; 3],
    /// Normal of its face; any length.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub normal: [f64; 3],
    /// Rotation about the normal, in degrees; at 0 the board's x axis is horizontal.
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
            bare_noise_sd_mm: None,
            bare_distance_error_mm: 0.0,
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
