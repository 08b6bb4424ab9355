//! Flights: the rig moves through the room while the scanner scans.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the attitude is interpolated between waypoints.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Attitude {
    /// At a constant rate along the shorter arc; the rate changes at every waypoint.
    #[default]
    Slerp,
    /// On a spherical cubic whose rate is continuous (Shoemake 1987).
    Squad,
}

/// A flight of the rig through the room, with the scanner scanning. The first scan starts at the first waypoint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flight {
    /// Name.
    pub name: String,
    /// How the attitude is interpolated between waypoints; the position follows a cubic spline.
    #[serde(default, skip_serializing_if = "is_slerp")]
    pub attitude: Attitude,
    /// Number of scans; by default, as many whole ones as fit before the last waypoint.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1, max = 1000000))]
    pub scans: Option<u32>,
    /// Timed poses of the rig, in order of time.
    #[schemars(length(min = 2))]
    pub waypoint: Vec<Waypoint>,
}

fn is_slerp(attitude: &Attitude) -> bool {
    *attitude == Attitude::Slerp
}

/// A pose of the rig in the room at a given time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// Time, in seconds; only differences count.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub time_s: f64,
    /// Origin of the rig in the room, in meters.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub position_m: [f64; 3],
    /// Yaw of the rig in the room, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub yaw_deg: f64,
    /// Pitch of the rig in the room, in degrees; positive lowers its x axis.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub pitch_deg: f64,
    /// Roll of the rig in the room, in degrees.
    #[serde(default)]
    #[schemars(range(min = -360.0, max = 360.0))]
    pub roll_deg: f64,
}

/// Fraction of a scan by which a flight may be too short for it and still contain it: times are written in decimals.
const SCAN_SLACK: f64 = 1e-6;

impl Flight {
    /// Time from the first waypoint to the last, in seconds.
    pub fn duration_s(&self) -> f64 {
        match (self.waypoint.first(), self.waypoint.last()) {
            (Some(first), Some(last)) => last.time_s - first.time_s,
            _ => 0.0,
        }
    }

    /// Number of whole scans that fit between the first waypoint and the last.
    pub fn whole_scans(&self, scan_period_s: f64) -> usize {
        let scans = (self.duration_s() / scan_period_s + SCAN_SLACK).floor();
        // Negative only for waypoints out of order, which a check rejects.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let scans = scans.max(0.0) as usize;
        scans
    }

    /// Number of scans of the flight.
    pub fn scans(&self, scan_period_s: f64) -> usize {
        self.scans
            .map_or_else(|| self.whole_scans(scan_period_s), |scans| scans as usize)
    }
}
