//! The truth: what was simulated, kept apart from what was observed.

pub use crate::receive::reading::BeamClass;

use crate::scene::Mishap;
use crate::scene::omit::is_false;
use catoptric_model::beam::{self, Deflection};
use catoptric_model::limits;
use catoptric_model::{Curve, PoseData, PoseKind, RangeBias};
use nalgebra::{Unit, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of `truth.json`.
pub const SCHEMA_VERSION: u32 = 1;

/// Everything that a score is computed from on the side of the truth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Truth {
    /// Version of this file's format.
    #[schemars(range(min = 1, max = SCHEMA_VERSION))]
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the run.
    pub seed: u64,
    /// Pose of the rig, except in flights.
    pub room_from_rig: PoseData,
    /// Pose of the sensor in the rig.
    pub rig_from_sensor: PoseData,
    /// Biases of the sensor.
    pub bias: RangeBias,
    /// Whether the detector has errors of its own, which follow from the received power and are not part of `bias`.
    #[serde(default, skip_serializing_if = "is_false")]
    pub detector_errors: bool,
    /// The mirrors as built.
    pub facets: Vec<TrueFacet>,
    /// What the structure does to the light of every beam, boards aside.
    pub beams: Vec<TrueBeam>,
    /// True values of every stretch.
    pub poses: Vec<TruePose>,
}

/// A mirror as built, in the true sensor frame; of one that is not flat, the plane that it touches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrueFacet {
    /// Name.
    pub name: String,
    /// Unit normal m of its plane, on the reflecting side.
    #[schemars(inner(range(min = -limits::UNIT, max = limits::UNIT)))]
    pub normal: [f64; 3],
    /// h of the plane m·x = h, in meters.
    #[schemars(range(min = -limits::FAR_M, max = limits::FAR_M))]
    pub offset_m: f64,
    /// Corners, in meters.
    #[schemars(inner(inner(range(min = -limits::FAR_M, max = limits::FAR_M))))]
    pub corners_m: Vec<[f64; 3]>,
    /// How a mirror that is not flat bends away from that plane: as drawn, or the cylinder of its bow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
}

/// What the structure does to the light of a beam. Angles are those of the chief ray.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TrueBeam {
    /// Index of the beam.
    #[schemars(range(max = limits::LAST_BEAM))]
    pub beam: usize,
    /// Class of the beam.
    pub status: BeamClass,
    /// Facets that the chief ray hits, in order.
    pub facets: Vec<String>,
    /// Where it hits them, in the sensor frame, in meters.
    #[schemars(inner(inner(range(min = -limits::FAR_M, max = limits::FAR_M))))]
    pub points_m: Vec<[f64; 3]>,
    /// θ_a, in radians; absent if the chief ray does not leave.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::TURN_RAD, max = limits::TURN_RAD))]
    pub azimuth_rad: Option<f64>,
    /// φ, in radians.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = -limits::TURN_RAD, max = limits::TURN_RAD))]
    pub elevation_rad: Option<f64>,
    /// d: distance to the first facet, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = limits::FAR_M))]
    pub distance_m: Option<f64>,
    /// Share of the beam's energy that takes the same path as the chief ray.
    #[schemars(range(min = 0.0, max = limits::WHOLE))]
    pub chief_energy: f64,
}

/// True values of a stretch.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TruePose {
    /// Number of the pose.
    #[schemars(range(max = limits::COUNT))]
    pub pose: usize,
    /// Kind of the stretch.
    pub kind: PoseKind,
    /// Pose of the board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room_from_board: Option<PoseData>,
    /// Pose of the board after it moved during the stretch.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room_from_board_after: Option<PoseData>,
    /// What went wrong.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mishap: Option<Mishap>,
    /// Pose of the sensor at the start of every scan of a flight; empty for other stretches, in which the sensor rests.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub room_from_sensor: Vec<PoseData>,
    /// Drift of all its readings, in meters.
    #[schemars(range(min = -limits::FAR_M, max = limits::FAR_M))]
    pub drift_m: f64,
    /// Warm-up error of the scanner at its first and its last scan, in meters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -limits::FAR_M, max = limits::FAR_M)))]
    pub warm_up_m: Option<[f64; 2]>,
}

impl TrueBeam {
    /// θ_a, φ and d of a beam whose chief ray is deflected once.
    pub fn deflection(&self) -> Option<Deflection> {
        (self.facets.len() == 1).then_some(())?;
        Some(Deflection {
            azimuth: self.azimuth_rad?,
            elevation: self.elevation_rad?,
            distance: self.distance_m?,
        })
    }

    /// Direction in which the chief ray of a beam leaves, in the sensor frame.
    pub fn exit_direction(&self, beam_azimuth: f64) -> Option<Unit<Vector3<f64>>> {
        Some(beam::spherical(
            beam_azimuth + self.azimuth_rad?,
            self.elevation_rad?,
        ))
    }
}
