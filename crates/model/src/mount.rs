//! The mounting as estimated: where the sensor is in the rig (step 5).

use crate::frame::{Pose, PoseData};
use crate::limits;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Pose of the sensor in the rig.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MountEstimate {
    /// Origin of the sensor in the rig frame, in meters.
    #[schemars(inner(range(min = -limits::FAR_M, max = limits::FAR_M)))]
    pub translation_m: [f64; 3],
    /// Rotation from sensor to rig (x, y, z, w).
    #[schemars(inner(range(min = -limits::ANY, max = limits::ANY)))]
    pub rotation_xyzw: [f64; 4],
    /// Covariance of a small motion of the sensor frame: three shifts in meters and three rotations in radians, about
    /// the sensor's own axes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(inner(range(min = -limits::ANY, max = limits::ANY))))]
    pub covariance: Option<[[f64; 6]; 6]>,
}

impl MountEstimate {
    /// The pose `rig_from_sensor`.
    pub fn pose(&self) -> Pose {
        (&PoseData {
            translation_m: self.translation_m,
            rotation_xyzw: self.rotation_xyzw,
        })
            .into()
    }
}
