//! What goes wrong unnoticed during a recording, and has to be detected by the calibration.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// One mishap with the board of one pose: exchanged labels, a misplaced label, or a movement.
///
/// The recording shows it as the instruments do; only the truth names it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mishap {
    /// Number of the pose, counted from 0 over the whole recording as in `/session/pose`; it must have a board.
    #[schemars(range(min = 0, max = 1000000))]
    pub pose: u32,
    /// Two markers of the board whose labels are exchanged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub swapped_markers: Option<[String; 2]>,
    /// A marker of the board whose label is misplaced.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mislabelled: Option<Mislabelled>,
    /// How far the board moves after half of the scans, along its own axes, in millimeters.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1000.0, max = 1000.0)))]
    pub moved_mm: Option<[f64; 3]>,
    /// How far the board turns after half of the scans, about its own axes, in degrees: a rotation vector.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -45.0, max = 45.0)))]
    pub moved_deg: Option<[f64; 3]>,
}

/// A label that is not on its marker.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mislabelled {
    /// The marker.
    pub marker: String,
    /// Position of the label relative to the marker, along the board's axes, in millimeters.
    #[schemars(inner(range(min = -10000.0, max = 10000.0)))]
    pub off_mm: [f64; 3],
}

impl Mishap {
    /// Whether the board moves.
    pub fn moves(&self) -> bool {
        self.moved_mm.is_some() || self.moved_deg.is_some()
    }
}
