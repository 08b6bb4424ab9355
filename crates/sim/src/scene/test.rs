//! Tests of the bare sensor: Cooper, step 1, with the scenes of Figures 2 to 4 and the gray-level test.

use catoptric_model::TestKind;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Boards in front of one undeflected beam: every board at every distance and every incidence, several times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorTest {
    /// Purpose of the test.
    pub kind: TestKind,
    /// The boards, one after another.
    #[schemars(length(min = 1))]
    pub board: Vec<String>,
    /// Distances from the sensor as drawn to the center of the board, in meters.
    #[schemars(length(min = 1), inner(range(min = 0.05, max = 100.0)))]
    pub range_m: Vec<f64>,
    /// Angles between the board's normal and the beam, in degrees; negative ones turn it in the opposite direction.
    #[serde(default = "face_on")]
    #[schemars(length(min = 1), inner(range(min = -80.0, max = 80.0)))]
    pub incidence_deg: Vec<f64>,
    /// Direction in which a positive incidence turns the normal, seen along the beam: 0 toward increasing azimuth, 90
    /// up.
    #[serde(default)]
    #[schemars(range(min = -180.0, max = 180.0))]
    pub direction_deg: f64,
    /// Azimuth of the beam, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub azimuth_deg: f64,
    /// Number of times that each setting is set up and recorded.
    #[serde(default = "once")]
    #[schemars(range(min = 1, max = 1000))]
    pub trials: u32,
}

fn face_on() -> Vec<f64> {
    vec![0.0]
}

fn once() -> u32 {
    1
}
