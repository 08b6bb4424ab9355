//! What the experimenter notes about a stretch of scans: what it was recorded for, and what was set up or tested.

use serde::{Deserialize, Serialize};

/// What a stretch of scans was recorded for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseKind {
    /// Step 3: the structure before its mirrors were attached.
    Bare,
    /// Step 4: the known room, no board in it.
    Room,
    /// Steps 1 and 5: a board before beams that no mirror deflects.
    Direct,
    /// Steps 7–10: a board in the fan of a facet.
    Facet,
    /// The rig moves through the room while it scans: nothing a calibration is made from, something it is applied to.
    Flight,
}

/// What is tested of the bare sensor (step 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TestKind {
    /// Size of the spot over the distance: Figures 2 and 3, Table 1.
    Spot,
    /// Mean error and spread over the distance: Table 2.
    Distance,
    /// Error over the incidence: Figure 4, Table 3.
    Angle,
    /// Error and spread over color and distance: Table 4.
    Color,
}

/// What was tested during a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestNote {
    /// What it was for.
    pub kind: TestKind,
    /// Number of the setting: stretches of one setting are trials of the same.
    pub setting: usize,
    /// Number of the trial, from 1.
    pub trial: usize,
    /// The spot as it was seen on the board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spot: Option<SpotNote>,
}

/// A spot on a board as seen through an infrared camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SpotNote {
    /// Neighbouring beams that make it.
    pub beams: usize,
    /// Extent along the scan, in millimetres.
    pub width_mm: f64,
    /// Extent across the scan, in millimetres.
    pub height_mm: f64,
}

/// What the experimenter noted about a stretch of scans: one message of `/session/pose`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseLabel {
    /// Number of the pose, from 0.
    pub pose: usize,
    /// What it was recorded for.
    pub kind: PoseKind,
    /// Scans in the stretch.
    pub scans: usize,
    /// Board that was set up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<String>,
    /// Color of that board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// Facet whose fan the board stands in.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// First and last beam that the board was set up for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beams: Option<[usize; 2]>,
    /// What was tested of the bare sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<TestNote>,
    /// Flight that was flown.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<String>,
}

impl PoseKind {
    /// Whether it says what the mirrors do: they are attached, and nothing moves.
    pub fn is_evidence(self) -> bool {
        match self {
            Self::Room | Self::Direct | Self::Facet => true,
            Self::Bare | Self::Flight => false,
        }
    }
}

impl PoseLabel {
    /// The note of a stretch of which nothing more is to be noted.
    pub fn of(pose: usize, kind: PoseKind, scans: usize) -> Self {
        Self {
            pose,
            kind,
            scans,
            board: None,
            color: None,
            facet: None,
            beams: None,
            test: None,
            flight: None,
        }
    }
}
