//! What goes wrong during a recording without anybody noticing: a calibration has to find it by itself.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One mishap with the board of one pose: an exchange, a label that sits on something else, or a movement.
///
/// The recording shows it as the instruments do, and only the truth tells of it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mishap {
    /// Number of the pose, counted from 0 over the whole recording as on `/session/pose`; it has a board.
    #[schemars(range(min = 0, max = 1000000))]
    pub pose: u32,
    /// Two markers of the board whose labels are exchanged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swapped_markers: Option<[String; 2]>,
    /// A marker of the board whose label sits on something else.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mislabelled: Option<Mislabelled>,
    /// How far the board moves once half of the scans are taken, along its own axes, in millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1000.0, max = 1000.0)))]
    pub moved_mm: Option<[f64; 3]>,
    /// How far the board turns once half of the scans are taken, about its own axes, in degrees: a rotation vector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -45.0, max = 45.0)))]
    pub moved_deg: Option<[f64; 3]>,
}

/// A label that sits on something else than its marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mislabelled {
    /// The marker.
    pub marker: String,
    /// Where the label sits, from the marker and along the board's axes, in millimetres.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub off_mm: [f64; 3],
}

impl Mishap {
    /// Whether the board moves.
    pub fn moves(&self) -> bool {
        self.moved_mm.is_some() || self.moved_deg.is_some()
    }
}
