//! The experimenter's knowledge: everything a calibration may use besides the recorded readings.
//!
//! This is `session.toml`. It holds the nominal design, not the structure as built, and the assumed noise and biases,
//! not the actual ones. The truth is never here.

use crate::beam::Deflection;
use crate::bias::{DistanceBias, RangeBias};
use crate::board::{BoardPlane, Rectangle};
use crate::characterization::{Characterization, NoiseRow};
use crate::curve::Curve;
use crate::frame::{Pose, PoseData};
use crate::glass::GlassSheet;
use crate::limits;
use crate::mirror::MirrorPlane;
use crate::noise::Noise;
use crate::scan::{ScanAngles, ScanDirection, ScanError, ScanGeometry};
use nalgebra::{Point3, Translation3, Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of `session.toml`.
pub const SCHEMA_VERSION: u32 = 2;

/// Everything known before the first reading is analyzed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Session {
    /// Version of this file's format.
    #[schemars(range(min = 1, max = SCHEMA_VERSION))]
    pub schema_version: u32,
    /// Name of the experiment.
    pub name: String,
    /// The scanner's data sheet.
    pub scanner: ScannerSheet,
    /// Nominal pose of the sensor in the rig.
    pub nominal_rig_from_sensor: PoseData,
    /// Tolerance of that pose.
    pub mount_tolerance: MountTolerance,
    /// The room of the experiment; `None` if no walls were surveyed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<RoomSurvey>,
    /// The assumed errors.
    pub believed: Beliefs,
    /// Step 3: the bare structure, measured before the mirrors were attached.
    pub bare_structure: BareStructure,
    /// Glass in front of the mirrors' reflecting faces; `None` for front-surface mirrors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub glass: Option<GlassSheet>,
    /// Markers of the rig, in the rig frame.
    pub rig_markers: Vec<Marker>,
    /// The mirrors as drawn, in the sensor frame of the drawing.
    #[serde(default)]
    pub facets: Vec<NominalFacet>,
    /// The target boards.
    #[serde(default)]
    pub boards: Vec<BoardSheet>,
}

/// The scanner's data sheet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "FlatSheet", into = "FlatSheet")]
pub struct ScannerSheet {
    /// Name of the preset.
    pub preset: String,
    /// Scan geometry.
    pub scan: ScanGeometry,
    /// Shortest range, in meters.
    pub range_min_m: f64,
    /// Longest range, in meters.
    pub range_max_m: f64,
    /// Full 1/e² divergence of a beam along the longer axis of its spot, in milliradians.
    pub divergence_full_mrad: f64,
}

/// The same as stored in `session.toml`. Entries missing in version 1 default to what all scanners had then: beams
/// placed symmetrically about the x axis, counter-clockwise, spread evenly over the turn.
#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct FlatSheet {
    /// Name of the preset.
    preset: String,
    /// Number of beams of a scan.
    #[schemars(range(min = 1, max = limits::MOST_BEAMS))]
    beams: usize,
    /// Angle between neighboring beams, in degrees.
    #[schemars(range(min = limits::STEP_DEG, max = limits::TURN_DEG))]
    step_deg: f64,
    /// Azimuth of beam 0, in degrees.
    #[serde(default)]
    #[schemars(range(min = -limits::TURN_DEG, max = limits::TURN_DEG))]
    first_deg: Option<f64>,
    /// The direction of rotation.
    #[serde(default)]
    direction: ScanDirection,
    /// Scans per second.
    #[schemars(range(min = limits::SLOWEST_HZ, max = limits::FASTEST_HZ))]
    scan_rate_hz: f64,
    /// Time from one beam to the next, in microseconds.
    #[serde(default)]
    #[schemars(range(min = limits::BEAM_TIME_US[0], max = limits::BEAM_TIME_US[1]))]
    beam_time_us: Option<f64>,
    /// Shortest range, in meters.
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    range_min_m: f64,
    /// Longest range, in meters.
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    range_max_m: f64,
    /// Full 1/e² divergence of a beam along the longer axis of its spot, in milliradians.
    #[schemars(range(min = 0.0, max = limits::DIVERGENCE_MRAD))]
    divergence_full_mrad: f64,
}

/// Tolerance of the optical frame's nominal pose, 1σ for each axis; 0 if the pose in the rig is known
/// exactly.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountTolerance {
    /// Rotation about x, y and z, in degrees.
    #[schemars(inner(range(min = 0.0, max = limits::TURN_DEG)))]
    pub rotation_sd_deg: [f64; 3],
    /// Shift along x, y and z, in millimeters.
    #[schemars(inner(range(min = 0.0, max = limits::ERROR_MM)))]
    pub translation_sd_mm: [f64; 3],
}

/// A box-shaped room, in the room frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomSurvey {
    /// Corner with the smallest coordinates, in meters.
    #[schemars(inner(range(min = -limits::FAR_M, max = limits::FAR_M)))]
    pub min_m: [f64; 3],
    /// Corner with the largest coordinates, in meters.
    #[schemars(inner(range(min = -limits::FAR_M, max = limits::FAR_M)))]
    pub max_m: [f64; 3],
    /// Color of walls, floor and ceiling.
    pub color: String,
}

/// The assumed errors, from step 1 and from data sheets. Standard deviations are 1σ.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beliefs {
    /// White noise of one reading, in millimeters: typical, and where there is no table.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub range_noise_sd_mm: f64,
    /// White noise of one reading over distance; `None` if it is the same everywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise: Option<Noise>,
    /// The same on targets of some colors.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub noise_of: BTreeMap<String, Noise>,
    /// Drift, constant over one pose, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub drift_sd_mm: f64,
    /// Error of one beam, constant over one pose, in millimeters: not reduced by averaging readings.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub element_sd_mm: f64,
    /// Error of one marker coordinate, constant over time, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub marker_sd_mm: f64,
    /// The biases as characterized in step 1.
    pub bias: RangeBias,
    /// Uncertainty of E_r at each node of its table, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub distance_bias_sd_mm: f64,
    /// Uncertainty of A_a, in millimeters, with B_a + A_a (the error at normal incidence) held fixed.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub angle_gain_sd_mm: f64,
    /// Uncertainty of E_c, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub color_bias_sd_mm: f64,
}

/// Zero uncertainties are omitted from files.
fn is_zero(sd: &f64) -> bool {
    *sd == 0.0
}

impl Beliefs {
    /// White noise of one reading of a target of some color at a distance, 1σ, both in meters.
    pub fn noise_sd(&self, range: f64, color: &str) -> f64 {
        let table = self.noise_of.get(color).or(self.noise.as_ref());
        table.map_or(self.range_noise_sd_mm * 1e-3, |table| table.sd(range))
    }

    /// The assumed errors after the bare sensor has been characterized.
    ///
    /// The bias is the characterization's; each uncertainty is the root mean square over the parameters it covers.
    /// Noise is that of the color in which the distance was tested. Unobserved values keep their prior.
    #[must_use]
    pub fn after(&self, found: &Characterization) -> Self {
        let mut believed = Self {
            bias: found.bias.clone(),
            ..self.clone()
        };
        if found.parameter("A_a", None).is_some() {
            believed.angle_gain_sd_mm = found.typical_sd("A_a");
        } else {
            believed.bias.angle = self.bias.angle.clone();
        }
        if found.parameters.iter().any(|p| p.symbol == "E_r") {
            believed.distance_bias_sd_mm = found.typical_sd("E_r");
        } else {
            // B_a holds the constant: a table of one node carries its uncertainty.
            believed.bias.distance = DistanceBias {
                range_m: vec![1.0],
                error_mm: vec![0.0],
            };
            believed.distance_bias_sd_mm = found.typical_sd("B_a");
        }
        if found.parameters.iter().any(|p| p.symbol == "B_c") {
            believed.color_bias_sd_mm = found.typical_sd("B_c");
        }
        let reference = |color: &str| !found.bias.color.contains_key(color);
        let of_reference = found.noise.iter().filter(|n| reference(&n.color));
        let (sum, count) = of_reference.fold((0.0, 0.0), |(sum, count), n| (sum + n.sd_mm, count + 1.0));
        if count > 0.0 {
            believed.range_noise_sd_mm = sum / count;
            believed.noise = Some(Noise::of(found.noise.iter().filter(|n| reference(&n.color))));
            for color in found.bias.color.keys() {
                let of_color: Vec<&NoiseRow> = found.noise.iter().filter(|n| n.color == *color).collect();
                if !of_color.is_empty() {
                    believed.noise_of.insert(color.clone(), Noise::of(of_color));
                }
            }
        }
        believed
    }
}

/// Step 3: ranges to the structure before the mirrors were attached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BareStructure {
    /// Thickness of the mirrors along their normals, in millimeters.
    #[schemars(range(min = 0.0, max = limits::THICKNESS_MM))]
    pub mirror_thickness_mm: f64,
    /// Uncertainty of a bare distance, in millimeters.
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub distance_sd_mm: f64,
    /// Error of a bare distance that no other beam shares, in millimeters; `distance_sd_mm` is shared by all beams of a
    /// facet.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = limits::ERROR_MM))]
    pub noise_sd_mm: f64,
    /// Whether the scanner itself measured them, in one recording: then they share its drift there and the uncertainty
    /// of the assumed biases that correct them. Both are part of the uncertainty.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub scanned: bool,
    /// First beam of `distance_m`.
    #[schemars(range(max = limits::LAST_BEAM))]
    pub first_beam: usize,
    /// Mean bias-corrected range of each beam to the bare structure, in meters; 0 if there is none.
    #[schemars(inner(range(min = 0.0, max = limits::FAR_M)))]
    pub distance_m: Vec<f64>,
}

/// A labeled marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Marker {
    /// Label.
    pub name: String,
    /// Position in its body's frame, in millimeters.
    #[schemars(inner(range(min = -limits::FAR_MM, max = limits::FAR_MM)))]
    pub position_mm: [f64; 3],
}

/// A mirror as drawn.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NominalFacet {
    /// Name.
    pub name: String,
    /// Corners in the nominal sensor frame, in millimeters, counter-clockwise seen from the reflecting side.
    #[schemars(length(min = 3), inner(inner(range(min = -limits::FAR_MM, max = limits::FAR_MM))))]
    pub corners_mm: Vec<[f64; 3]>,
    /// What it is instead of flat.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
    /// First and last beam that hit this facet, according to the drawing.
    #[schemars(inner(range(max = limits::LAST_BEAM)))]
    pub beams: [usize; 2],
}

/// A target board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoardSheet {
    /// Name, which is also the motion-capture subject.
    pub name: String,
    /// Extent along the board's x axis, in millimeters.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(min = 0.0, max = limits::FAR_MM))]
    pub width_mm: f64,
    /// Extent along the board's y axis, in millimeters.
    #[schemars(extend("exclusiveMinimum" = 0.0), range(min = 0.0, max = limits::FAR_MM))]
    pub height_mm: f64,
    /// How far the face is in front of the plane that the markers span, along the board's z axis, in millimeters.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub thickness_mm: f64,
    /// Color.
    pub color: String,
    /// Markers on the face, in the board frame; the first three are P_p1…P_p3.
    pub markers: Vec<Marker>,
}

impl TryFrom<FlatSheet> for ScannerSheet {
    type Error = ScanError;

    fn try_from(flat: FlatSheet) -> Result<Self, ScanError> {
        let centered = ScanAngles::centered(flat.step_deg, flat.beams);
        let angles = ScanAngles {
            first_deg: flat.first_deg.unwrap_or(centered.first_deg),
            direction: flat.direction,
            ..centered
        };
        Ok(Self {
            preset: flat.preset,
            scan: ScanGeometry::new(angles, flat.scan_rate_hz, flat.beam_time_us)?,
            range_min_m: flat.range_min_m,
            range_max_m: flat.range_max_m,
            divergence_full_mrad: flat.divergence_full_mrad,
        })
    }
}

impl From<ScannerSheet> for FlatSheet {
    fn from(sheet: ScannerSheet) -> Self {
        let angles = *sheet.scan.angles();
        Self {
            preset: sheet.preset,
            beams: angles.beams,
            step_deg: angles.step_deg,
            first_deg: Some(angles.first_deg),
            direction: angles.direction,
            scan_rate_hz: sheet.scan.scan_rate_hz(),
            beam_time_us: Some(sheet.scan.beam_time_s() * 1e6),
            range_min_m: sheet.range_min_m,
            range_max_m: sheet.range_max_m,
            divergence_full_mrad: sheet.divergence_full_mrad,
        }
    }
}

impl Marker {
    /// Position in its body's frame, in meters.
    pub fn position(&self) -> Point3<f64> {
        Point3::from(Vector3::from(self.position_mm) * 1e-3)
    }
}

impl NominalFacet {
    /// Corners in the nominal sensor frame, in meters.
    pub fn corners(&self) -> Vec<Point3<f64>> {
        self.corners_mm
            .iter()
            .map(|c| Point3::from(Vector3::from(*c) * 1e-3))
            .collect()
    }

    /// Normal on the reflecting side and center of the corners; `None` for fewer than three corners or a line.
    pub fn plane(&self) -> Option<BoardPlane> {
        let corners = self.corners();
        // Newell's sum: exact for a plane polygon, and the best-fit normal for a nearly plane one.
        let mut normal = Vector3::zeros();
        for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            normal += a.coords.cross(&b.coords);
        }
        let center = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len() as f64;
        Some(BoardPlane::new(
            Point3::from(center),
            Unit::try_new(normal, f64::MIN_POSITIVE)?,
        ))
    }
}

impl NominalFacet {
    /// The plane that touches a mirror that is not flat where a beam from the origin hits it; `None` for a flat mirror, or
    /// where the beam misses its reflecting side.
    pub fn touched(&self, u: &Unit<Vector3<f64>>) -> Option<MirrorPlane> {
        let normal = self.plane()?.normal;
        self.curve?.over(&self.corners(), &normal, 0.0)?.plane_along(u)
    }
}

impl BoardSheet {
    /// The board's outline, in meters.
    pub fn outline(&self) -> Rectangle {
        Rectangle {
            width: self.width_mm * 1e-3,
            height: self.height_mm * 1e-3,
        }
    }

    /// Pose of the face, given that of the markers' plane: both have the board's axes.
    pub fn face(&self, a_from_board: &Pose) -> Pose {
        a_from_board * Translation3::new(0.0, 0.0, 1e-3 * self.thickness_mm)
    }
}

impl RoomSurvey {
    /// Distance along a ray from inside the room to its walls, and the normal there; `None` from outside.
    pub fn cast(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<(f64, BoardPlane)> {
        let mut nearest: Option<(f64, BoardPlane)> = None;
        for axis in 0..3 {
            let wall = if direction[axis] > 0.0 {
                self.max_m[axis]
            } else {
                self.min_m[axis]
            };
            let s = (wall - origin[axis]) / direction[axis];
            if direction[axis] != 0.0 && s > 0.0 && nearest.as_ref().is_none_or(|(best, _)| s < *best) {
                let mut normal = Vector3::zeros();
                normal[axis] = -direction[axis].signum();
                let point = origin + direction.into_inner() * s;
                nearest = Some((s, BoardPlane::new(point, Unit::new_unchecked(normal))));
            }
        }
        nearest
    }
}

impl BareStructure {
    /// Bare distance of a beam, in meters; `None` if the structure was not hit.
    pub fn distance(&self, beam: usize) -> Option<f64> {
        let d = *self.distance_m.get(beam.checked_sub(self.first_beam)?)?;
        (d > 0.0).then_some(d)
    }
}

impl Session {
    /// The board of that name.
    pub fn board(&self, name: &str) -> Option<&BoardSheet> {
        self.boards.iter().find(|b| b.name == name)
    }

    /// [`GlassSheet::as_bare`] for the glass in front of the mirrors, if there is any.
    pub fn without_glass(&self, beam_azimuth: f64, deflection: &Deflection) -> (Deflection, f64) {
        match &self.glass {
            Some(glass) => glass.as_bare(beam_azimuth, deflection),
            None => (*deflection, 0.0),
        }
    }
}
