//! What the written session says otherwise than the laboratory knows: the scene's table `[session]`.
//!
//! Every key of a `session.toml` may be given and is laid over the session that the laboratory writes, so that what the
//! experimenter believes may differ from what is simulated. Tables are laid over key by key. Entries of lists that have
//! names (`boards`, `facets`, `rig_markers`, `markers`) are laid over the entry of the same name; all other lists are
//! replaced as a whole.

mod beliefs;
mod objects;
mod over;

pub use beliefs::{
    AngleBiasOverlay, AngleTableOverlay, BeliefsOverlay, ColorBiasOverlay, DistanceBiasOverlay, NoiseOverlay,
    RangeBiasOverlay,
};
pub use objects::{
    BareStructureOverlay, BoardOverlay, FacetOverlay, GlassOverlay, MarkerOverlay, MountToleranceOverlay,
    PoseOverlay, RoomOverlay, ScannerOverlay,
};

use super::omit::is_default;
use catoptric_model::{ScanError, Session};
use over::LieOver;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the written session says otherwise.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SessionOverlay {
    /// Version of the session's format, 2.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 2))]
    pub schema_version: Option<u32>,
    /// Name of the experiment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The scanner's data sheet.
    #[serde(skip_serializing_if = "is_default")]
    pub scanner: ScannerOverlay,
    /// Nominal pose of the sensor in the rig.
    #[serde(skip_serializing_if = "is_default")]
    pub nominal_rig_from_sensor: PoseOverlay,
    /// Tolerance of that pose.
    #[serde(skip_serializing_if = "is_default")]
    pub mount_tolerance: MountToleranceOverlay,
    /// The room as surveyed.
    #[serde(skip_serializing_if = "is_default")]
    pub room: RoomOverlay,
    /// The assumed errors.
    #[serde(skip_serializing_if = "is_default")]
    pub believed: BeliefsOverlay,
    /// The bare structure.
    #[serde(skip_serializing_if = "is_default")]
    pub bare_structure: BareStructureOverlay,
    /// Glass in front of the mirrors; a thickness of 0 states that there is none.
    #[serde(skip_serializing_if = "is_default")]
    pub glass: GlassOverlay,
    /// Markers of the rig, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rig_markers: Vec<MarkerOverlay>,
    /// The mirrors as drawn, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub facets: Vec<FacetOverlay>,
    /// The target boards, by name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub boards: Vec<BoardOverlay>,
}

impl SessionOverlay {
    /// Lays this over a session.
    ///
    /// # Errors
    /// [`ScanError`] if the scan geometry becomes impossible.
    pub(crate) fn lie_over(&self, session: &mut Session) -> Result<(), ScanError> {
        if let Some(name) = &self.name {
            session.name.clone_from(name);
        }
        self.scanner.lie_over_sheet(&mut session.scanner)?;
        self.nominal_rig_from_sensor
            .lie_over(&mut session.nominal_rig_from_sensor);
        self.mount_tolerance.lie_over(&mut session.mount_tolerance);
        if let Some(room) = &mut session.room {
            self.room.lie_over(room);
        }
        self.believed.lie_over(&mut session.believed);
        if self.believed.range_noise_sd_mm.is_some() {
            // One number replaces the tables, except those that are given with it.
            let believed = &mut session.believed;
            believed.noise = believed.noise.take().filter(|_| self.believed.noise.is_some());
            let given = |color: &String| {
                self.believed
                    .noise_of
                    .as_ref()
                    .is_some_and(|of| of.contains_key(color))
            };
            believed.noise_of.retain(|color, _| given(color));
        }
        self.bare_structure.lie_over(&mut session.bare_structure);
        if self.glass != GlassOverlay::default() {
            self.glass.lie_over(&mut session.glass);
        }
        self.rig_markers.lie_over(&mut session.rig_markers);
        self.facets.lie_over(&mut session.facets);
        self.boards.lie_over(&mut session.boards);
        Ok(())
    }
}
