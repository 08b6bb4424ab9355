//! The experimenter's notes on a stretch of scans: its purpose, and what was set up or tested.

use crate::limits;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The purpose of a stretch of scans.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PoseKind {
    /// Step 3: the structure before its mirrors were attached.
    Bare,
    /// Step 4: the known room, without a board.
    Room,
    /// Steps 1 and 5: a board in front of undeflected beams.
    Direct,
    /// Steps 7–10: a board in the fan of a facet.
    Facet,
    /// The rig moves through the room while it scans: data that a calibration is applied to, not made from.
    Flight,
}

/// The test of the bare sensor (step 1).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TestKind {
    /// Spot size over distance: Figures 2 and 3, Table 1.
    Spot,
    /// Mean error and spread over distance: Table 2.
    Distance,
    /// Error over incidence: Figure 4, Table 3.
    Angle,
    /// Error and spread over color and distance: Table 4.
    Color,
}

/// What was tested during a stretch.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TestNote {
    /// The test.
    pub kind: TestKind,
    /// Number of the setting; stretches with the same setting are repeated trials.
    pub setting: usize,
    /// Number of the trial, from 1.
    pub trial: usize,
    /// The spot as seen on the board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub spot: Option<SpotNote>,
}

/// A spot on a board as seen through an infrared camera.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpotNote {
    /// Number of neighboring beams that form it.
    #[schemars(range(max = limits::COUNT))]
    pub beams: usize,
    /// Extent along the scan, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub width_mm: f64,
    /// Extent across the scan, in millimeters.
    #[schemars(range(min = 0.0, max = limits::FAR_MM))]
    pub height_mm: f64,
}

/// The experimenter's notes on a stretch of scans: one message on `/session/pose`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseLabel {
    /// Number of the pose, from 0.
    pub pose: usize,
    /// Its purpose.
    pub kind: PoseKind,
    /// Number of scans in the stretch.
    pub scans: usize,
    /// Board that was set up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub board: Option<String>,
    /// Color of that board.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<String>,
    /// Facet in whose fan the board is placed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub facet: Option<String>,
    /// First and last beam for which the board was set up.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub beams: Option<[usize; 2]>,
    /// What was tested of the bare sensor.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub test: Option<TestNote>,
    /// Name of the flight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flight: Option<String>,
}

impl PoseKind {
    /// Whether it has information about the mirrors: they are attached, and nothing moves.
    pub fn is_evidence(self) -> bool {
        match self {
            Self::Room | Self::Direct | Self::Facet => true,
            Self::Bare | Self::Flight => false,
        }
    }
}

impl PoseLabel {
    /// A label with no optional entries.
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
