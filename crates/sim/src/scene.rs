//! The scene: everything that is simulated, as a person writes it in TOML.
//!
//! Every key carries its unit. Values that nobody published are defaults marked *assumed*. The checks that need more
//! than one value are in [`crate::check`].

use catoptric_model::bias::{AngleBias, ColorBias, DistanceBias, interpolate};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the scene format.
pub const SCHEMA_VERSION: u32 = 1;

/// A complete experiment: sensor, mirrors, boards, room, procedure and errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of this format, 1.
    #[schemars(range(min = 1, max = 1))]
    pub schema_version: u32,
    /// Name of the experiment.
    pub name: String,
    /// Seed of every random draw; `--seed` overrides it.
    #[serde(default = "one")]
    pub seed: u64,
    /// The scanner.
    pub scanner: Scanner,
    /// Terms of Eq. 1.
    #[serde(default)]
    pub light: Light,
    /// From received light to a range.
    #[serde(default)]
    pub detection: Detection,
    /// Mirrors, posts and markers.
    pub superstructure: Superstructure,
    /// Surface colors beside the built-in ones.
    #[serde(default)]
    pub color: BTreeMap<String, Color>,
    /// The target boards; poses take them in turn.
    #[serde(default)]
    pub board: Vec<Board>,
    /// The room.
    pub room: Room,
    /// Motion capture.
    #[serde(default)]
    pub mocap: Mocap,
    /// The procedure.
    #[serde(default)]
    pub experiment: Experiment,
    /// Errors of the sensor.
    #[serde(default)]
    pub errors: Errors,
    /// How well step 1 knows those errors.
    #[serde(default)]
    pub characterization: Characterization,
}

fn one() -> u64 {
    1
}

/// Which scanner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Preset {
    /// Hokuyo UST-20LX with the spot of its manual: 160 × 25 mm at 10 m.
    #[serde(rename = "ust-20lx")]
    Ust20lx,
    /// The same with the spot of Cooper's Table 1 read as three neighbouring beams.
    #[serde(rename = "ust-20lx-cooper")]
    Ust20lxCooper,
}

/// The scanner and how it sits in the rig.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scanner {
    /// The preset.
    pub preset: Preset,
    /// Sub-rays per beam.
    #[serde(default = "Scanner::default_sub_rays")]
    #[schemars(range(min = 1, max = 4096))]
    pub sub_rays: u32,
    /// Shape of a beam, instead of the preset's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beam: Option<BeamShape>,
    /// Whether the scanner's own housing stands in the way of deflected beams.
    #[serde(default = "yes")]
    pub housing: bool,
    /// Where the sensor sits in the rig body.
    #[serde(default)]
    pub mount: Mount,
}

fn yes() -> bool {
    true
}

impl Scanner {
    fn default_sub_rays() -> u32 {
        19
    }
}

/// Shape of one beam: an ellipse whose long axis is horizontal at azimuth 0.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BeamShape {
    /// Full angle of the 1/e² contour along the long axis, in milliradians.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub wide_full_mrad: f64,
    /// Full angle of the 1/e² contour along the short axis, in milliradians.
    #[schemars(range(min = 0.0, max = 200.0))]
    pub narrow_full_mrad: f64,
    /// Full width of the beam along its long axis where it leaves, in millimetres.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub wide_aperture_mm: f64,
    /// Full width of the beam along its short axis where it leaves, in millimetres.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 50.0))]
    pub narrow_aperture_mm: f64,
    /// Whether the ellipse turns with the azimuth, as behind a spinning 45° mirror.
    #[serde(default = "yes")]
    pub turns: bool,
}

/// Where the sensor sits in the rig body: the drawing, and how far the real one may be from it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mount {
    /// Origin of the sensor in the rig frame, in millimetres.
    pub position_mm: [f64; 3],
    /// Yaw of the sensor in the rig frame, in degrees.
    #[schemars(range(min = -180.0, max = 180.0))]
    pub yaw_deg: f64,
    /// Largest error of the optical axis in yaw, in degrees (data sheet: 0.3).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub yaw_tolerance_deg: f64,
    /// Largest error of the optical axis in pitch and in roll, in degrees (data sheet: 1).
    #[schemars(range(min = 0.0, max = 10.0))]
    pub tilt_tolerance_deg: f64,
    /// Largest offset of the optical center along each axis, in millimetres (assumed).
    #[schemars(range(min = 0.0, max = 20.0))]
    pub shift_tolerance_mm: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self {
            position_mm: [0.0, 0.0, -40.0],
            yaw_deg: 0.0,
            yaw_tolerance_deg: 0.3,
            tilt_tolerance_deg: 1.0,
            shift_tolerance_mm: 1.0,
        }
    }
}

/// The terms of Eq. 1. Only their product over the threshold matters to a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Light {
    /// Transmitted peak power P_t, in watts (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub power_w: f64,
    /// Transmission of the optics τ_o (assumed).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub optics_transmission: f64,
    /// Transmission of the air τ_a, one way.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub air_transmission: f64,
    /// Diameter of the receiver D_R, in millimetres (assumed).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub receiver_diameter_mm: f64,
    /// Solid angle θ_R into which a target scatters, in steradians (π for a Lambertian surface).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub target_dispersion_sr: f64,
}

impl Default for Light {
    fn default() -> Self {
        Self {
            power_w: 10.0,
            optics_transmission: 0.9,
            air_transmission: 1.0,
            receiver_diameter_mm: 20.0,
            target_dispersion_sr: std::f64::consts::PI,
        }
    }
}

/// From received light to a range.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Detection {
    /// Full width at half maximum of the pulse, in nanoseconds (assumed; 3 to 5 are plausible).
    #[schemars(range(min = 0.1, max = 100.0))]
    pub pulse_fwhm_ns: f64,
    /// Reflectivity of a face-on target that is just detected at `threshold_range_m` (data sheet: 0.1).
    #[schemars(range(min = 0.0, max = 1.0))]
    pub threshold_reflectivity: f64,
    /// Range at which that target is just detected, in metres (data sheet: 8).
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub threshold_range_m: f64,
    /// Range of the face-on white target at which the walk of the leading edge is calibrated out, in metres.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub reference_range_m: f64,
}

impl Default for Detection {
    fn default() -> Self {
        Self {
            pulse_fwhm_ns: 4.0,
            threshold_reflectivity: 0.1,
            threshold_range_m: 8.0,
            reference_range_m: 2.0,
        }
    }
}

/// Mirrors, posts and markers around the scanner, in the sensor frame of the drawing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Superstructure {
    /// The mirrors.
    #[serde(default)]
    pub facet: Vec<Facet>,
    /// Opaque boxes.
    #[serde(default)]
    pub post: Vec<Post>,
    /// Markers of the rig body, in the rig frame.
    pub marker: Vec<Marker>,
    /// The mirror material.
    #[serde(default)]
    pub mirror: Mirror,
    /// How far the structure as built departs from the drawing.
    #[serde(default)]
    pub as_built: AsBuilt,
    /// Mirrors that a beam may meet in a row.
    #[serde(default = "four")]
    #[schemars(range(min = 1, max = 8))]
    pub max_bounces: u32,
}

fn four() -> u32 {
    4
}

/// A plane mirror.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facet {
    /// Name.
    pub name: String,
    /// Its outline.
    pub shape: FacetShape,
}

/// Outline of a facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FacetShape {
    /// Cut by two azimuths and two heights, and turned so that its middle beam leaves in a wanted direction.
    Wedge(Wedge),
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
    #[schemars(inner(range(min = -180.0, max = 180.0)))]
    pub azimuth_deg: [f64; 2],
    /// Distance from the sensor origin along the middle azimuth, in millimetres.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub distance_mm: f64,
    /// Azimuth in which the middle beam leaves, in degrees.
    #[schemars(range(min = -360.0, max = 360.0))]
    pub exit_azimuth_deg: f64,
    /// Elevation in which the middle beam leaves, in degrees.
    #[schemars(range(min = -90.0, max = 90.0))]
    pub exit_elevation_deg: f64,
    /// Height over which the facet reaches, centered on the scan plane, in millimetres.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

/// A rectangular facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleShape {
    /// Center, in millimetres.
    pub center_mm: [f64; 3],
    /// Normal of the reflecting side; any length.
    pub normal: [f64; 3],
    /// Extent parallel to the scan plane, in millimetres.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along the other side, in millimetres.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

/// A facet with given corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonShape {
    /// Corners of a convex plane polygon, in millimetres, counter-clockwise seen from the reflecting side.
    #[schemars(length(min = 3))]
    pub corners_mm: Vec<[f64; 3]>,
}

/// An opaque box.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Post {
    /// Name.
    pub name: String,
    /// Center, in millimetres.
    pub center_mm: [f64; 3],
    /// Extents along its own x, y and z, in millimetres.
    #[schemars(inner(range(min = 0.01, max = 10000.0)))]
    pub size_mm: [f64; 3],
    /// Turn about z, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Surface color.
    #[serde(default = "structure")]
    pub color: String,
}

fn structure() -> String {
    "structure".to_owned()
}

/// A labelled marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Label.
    pub name: String,
    /// Place in its body's frame, in millimetres.
    pub position_mm: [f64; 3],
}

/// The mirror material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mirror {
    /// Share of the light that is reflected, paid on the way out and on the way back.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub reflectivity: f64,
    /// Thickness between the bare structure and the reflecting face, in millimetres.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub thickness_mm: f64,
}

impl Default for Mirror {
    fn default() -> Self {
        Self {
            reflectivity: 0.9,
            thickness_mm: 1.0,
        }
    }
}

/// How far the structure as built departs from the drawing, 1σ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct AsBuilt {
    /// Turn of a facet about each axis, in degrees.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub tilt_sd_deg: f64,
    /// Shift of a facet along each axis, in millimetres.
    #[schemars(range(min = 0.0, max = 20.0))]
    pub shift_sd_mm: f64,
    /// Root mean square of the slope of a facet's surface about its plane, in milliradians (assumed).
    #[schemars(range(min = 0.0, max = 50.0))]
    pub slope_rms_mrad: f64,
}

impl Default for AsBuilt {
    fn default() -> Self {
        Self {
            tilt_sd_deg: 1.0,
            shift_sd_mm: 0.5,
            slope_rms_mrad: 0.2,
        }
    }
}

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

/// Standard deviation of a reading over distance, interpolated linearly and constant outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseTable {
    /// Distances in metres, strictly increasing.
    #[schemars(length(min = 1))]
    pub range_m: Vec<f64>,
    /// Standard deviations in millimetres at those distances.
    #[schemars(inner(range(min = 0.0, max = 1000.0)))]
    pub sd_mm: Vec<f64>,
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

/// A box-shaped room; the room frame stands on the middle of the floor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Room {
    /// Extents along x, y and z, in metres.
    #[schemars(inner(range(min = 0.5, max = 100.0)))]
    pub size_m: [f64; 3],
    /// Color of walls, floor and ceiling.
    #[serde(default = "white")]
    pub color: String,
    /// Origin of the rig in the room, in metres.
    pub rig_position_m: [f64; 3],
    /// Yaw of the rig in the room, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub rig_yaw_deg: f64,
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
}

/// Motion capture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Mocap {
    /// How good it is.
    pub profile: MocapProfile,
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
            frame_rate_hz: 100.0,
            dropout: 0.01,
        }
    }
}

/// The procedure: Cooper, steps 2 to 10.
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
}

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
            room_scans: 100,
            bare_scans: 100,
            placement_sd_mm: 10.0,
            placement_sd_deg: 2.0,
            pause_s: 5.0,
            pose: Vec::new(),
        }
    }
}

/// Which errors the sensor has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ErrorModel {
    /// A perfect sensor: no bias, drift, noise, rounding or dropout.
    None,
    /// Eqs. 3–5 and the tables; the detector shows itself only where surfaces mix.
    #[default]
    Empirical,
    /// What pulse and threshold do to the range; no Eqs. 3–5.
    Physical,
    /// Both, one on top of the other.
    Both,
}

/// Errors of the sensor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Errors {
    /// Which of them act.
    pub model: ErrorModel,
    /// E_r, default Table 2.
    #[schemars(with = "DistanceBiasSchema")]
    pub distance: DistanceBias,
    /// E_a, default Table 3's slope with no error at normal incidence, since E_r already holds that.
    #[schemars(with = "AngleBiasSchema")]
    pub angle: AngleBias,
    /// E_c per color, default none.
    #[schemars(with = "BTreeMap<String, ColorBiasSchema>")]
    pub color: BTreeMap<String, ColorBias>,
    /// White noise of a reading, default Table 2.
    pub noise: NoiseTable,
    /// Constant error of all readings of a pose, 1σ, in millimetres (trial scatter in Table 2).
    #[schemars(range(min = 0.0, max = 100.0))]
    pub drift_sd_mm: f64,
    /// Step of the reported ranges, in millimetres; 0 for none.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub quantization_mm: f64,
    /// Chance that a reading is lost.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub dropout: f64,
}

impl Default for Errors {
    fn default() -> Self {
        Self {
            model: ErrorModel::Empirical,
            distance: DistanceBias {
                range_m: vec![0.5, 2.0, 4.0],
                error_mm: vec![-2.8, 6.1, -0.1],
            },
            angle: AngleBias {
                gain_mm: -70.3,
                offset_mm: 70.3,
            },
            color: BTreeMap::new(),
            noise: NoiseTable {
                range_m: vec![0.5, 2.0, 4.0],
                sd_mm: vec![4.1, 3.9, 4.6],
            },
            drift_sd_mm: 0.88,
            quantization_mm: 1.0,
            dropout: 0.0,
        }
    }
}

/// How well step 1 knows the errors: what the experimenter believes differs from the truth by these, 1σ (assumed).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Characterization {
    /// E_r at each node of its table, in millimetres (0.88 mm of drift, averaged over three trials).
    #[schemars(range(min = 0.0, max = 100.0))]
    pub distance_sd_mm: f64,
    /// A_a, in millimetres, with the error at normal incidence held.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub angle_gain_sd_mm: f64,
    /// E_c, in millimetres.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub color_sd_mm: f64,
}

impl Default for Characterization {
    fn default() -> Self {
        Self {
            distance_sd_mm: 0.5,
            angle_gain_sd_mm: 3.0,
            color_sd_mm: 0.0,
        }
    }
}

/// Schema of [`DistanceBias`].
#[derive(JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "DistanceBias")]
#[allow(dead_code)] // Read by the schema generator alone.
struct DistanceBiasSchema {
    /// Distances in metres, strictly increasing.
    range_m: Vec<f64>,
    /// Errors in millimetres at those distances.
    error_mm: Vec<f64>,
}

/// Schema of [`AngleBias`].
#[derive(JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "AngleBias")]
#[allow(dead_code)]
struct AngleBiasSchema {
    /// A_a, in millimetres.
    gain_mm: f64,
    /// B_a, in millimetres.
    offset_mm: f64,
}

/// Schema of [`ColorBias`].
#[derive(JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "ColorBias")]
#[allow(dead_code)]
struct ColorBiasSchema {
    /// A_c, in millimetres per metre.
    slope_mm_per_m: f64,
    /// B_c, in millimetres.
    offset_mm: f64,
}

impl NoiseTable {
    /// Standard deviation at a range, in metres.
    pub fn sd(&self, range: f64) -> f64 {
        interpolate(&self.range_m, &self.sd_mm, range) * 1e-3
    }
}
