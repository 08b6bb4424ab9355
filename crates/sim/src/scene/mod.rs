//! The scene: everything that is simulated, as a person writes it in TOML.
//!
//! Every key carries its unit. Unpublished values are defaults marked *assumed*. The checks that need more than one
//! value are in [`crate::check`].

mod body;
mod coating;
mod detection;
mod errors;
pub(crate) mod facet;
mod flight;
mod meshes;
mod mishap;
pub(crate) mod omit;
mod parameter;
mod pattern;
mod preset;
mod room;
mod scanner;
mod session;
mod shape;
mod sheet;
mod superstructure;
mod test;

pub use body::{
    PlanePolygon, PlaneRectangle, PlaneShape, RoomBox, RoomCylinder, RoomMirror, RoomSurface, SurfaceShape,
};
pub use coating::{Coating, CoatingTable, Dust, Film, Stack};
pub use detection::{Detection, Detector, EchoChoice, Intensity, Principle};
pub use errors::{
    Characterization, Correlated, ErrorModel, Errors, IncidenceNoise, Interference, NoiseTable, WarmUp,
};
pub use facet::{Facet, FacetShape, Plate, PolygonShape, RectangleShape, Wedge};
pub use flight::{Attitude, Flight, Waypoint};
pub use meshes::Meshes;
pub use mishap::{Mishap, Mislabelled};
pub use parameter::Parameter;
pub use pattern::{CopyList, Exchange, FacetCopy, MirrorImage, Pattern, Ring};
pub use preset::Preset;
pub use room::{Board, BoardPose, Color, Design, Experiment, MarkerNoise, Mocap, MocapProfile, Room};
pub use scanner::{Light, Mount, Scanner};
pub use session::{
    AngleBiasOverlay, AngleTableOverlay, BareStructureOverlay, BeliefsOverlay, BoardOverlay,
    ColorBiasOverlay, DistanceBiasOverlay, FacetOverlay, GlassOverlay, MarkerOverlay, MountToleranceOverlay,
    NoiseOverlay, PoseOverlay, RangeBiasOverlay, RoomOverlay, ScannerOverlay, SessionOverlay,
};
pub use shape::{MeshShape, MeshUnits, PostCylinder, PostShape};
pub use sheet::{BeamShape, HousingBox, Limits};
pub use superstructure::{AsBuilt, Glass, Marker, Mirror, Post, Superstructure};
pub use test::SensorTest;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Version of the scene format.
pub const SCHEMA_VERSION: u32 = 1;

/// A complete experiment: sensor, mirrors, boards, room, procedure and errors.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Version of this format, 1.
    #[schemars(range(min = 1, max = 1))]
    pub schema_version: u32,
    /// Name of the experiment.
    pub name: String,
    /// Seed of every random draw; `--seed` overrides it.
    #[serde(default = "one")]
    pub seed: u64,
    /// Named numbers of the design with limits, for expressions and searches.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, Parameter>,
    /// The scanner.
    #[serde(default = "ust_20lx")]
    pub scanner: Scanner,
    /// Terms of Eq. (1).
    #[serde(default)]
    pub light: Light,
    /// From received light to a range.
    #[serde(default)]
    pub detection: Detection,
    /// Mirrors, posts and markers.
    #[serde(default)]
    pub superstructure: Superstructure,
    /// Surface colors in addition to the built-in ones.
    #[serde(default)]
    pub color: BTreeMap<String, Color>,
    /// The target boards, which poses use in turn.
    #[serde(default)]
    pub board: Vec<Board>,
    /// The room.
    #[serde(default)]
    pub room: Room,
    /// Motion capture.
    #[serde(default)]
    pub mocap: Mocap,
    /// The procedure.
    #[serde(default)]
    pub experiment: Experiment,
    /// Flights through the room, recorded after everything else.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub flight: Vec<Flight>,
    /// Errors of the sensor.
    #[serde(default)]
    pub errors: Errors,
    /// How well step 1 knows those errors.
    #[serde(default)]
    pub characterization: Characterization,
    /// What the written session says otherwise.
    #[serde(default, skip_serializing_if = "omit::is_default")]
    pub session: SessionOverlay,
    /// The meshes that the scene names, supplied by the caller who read them. Not part of the file.
    #[serde(skip)]
    pub meshes: Meshes,
}

fn one() -> u64 {
    1
}

/// A UST-20LX as given by its data sheet and the other defaults.
fn ust_20lx() -> Scanner {
    Scanner {
        preset: Preset::Ust20lx,
        sub_rays: 19,
        edge_rays: None,
        beam: None,
        custom: None,
        housing: true,
        housing_box: None,
        mount: Mount::default(),
    }
}

impl Scene {
    /// Whether the scene holds only what is fixed in the room, so that rays can be traced but nothing recorded.
    pub fn has_no_laboratory(&self) -> bool {
        let structure = &self.superstructure;
        let nothing_around =
            structure.facet.is_empty() && structure.post.is_empty() && structure.marker.is_empty();
        nothing_around && self.board.is_empty() && self.flight.is_empty() && !self.room.has_walls()
    }

    /// Whether the scene has mirrors or posts, and nothing to record them with: it can be analyzed by `layout`,
    /// traced and exported. Whoever gives markers and walls, but no board, wants a recording.
    pub fn only_shows_mirrors(&self) -> bool {
        let experiment = &self.experiment;
        let nothing_set_up = self.board.is_empty()
            && self.flight.is_empty()
            && experiment.pose.is_empty()
            && experiment.test.is_empty();
        let half_a_laboratory = self.room.has_walls() && !self.superstructure.marker.is_empty();
        nothing_set_up && !half_a_laboratory && !self.has_no_laboratory()
    }

    /// Whether only flights can be recorded, so that no walls are needed.
    pub fn only_flies(&self) -> bool {
        !self.flight.is_empty() && self.board.is_empty() && self.experiment.pose.is_empty()
    }

    /// Every mesh that the scene names, with the key that names it.
    pub fn mesh_shapes(&self) -> Vec<(String, &MeshShape)> {
        let posts = self.superstructure.post.iter().enumerate();
        let posts = posts.filter_map(|(i, post)| match &post.shape {
            Some(PostShape::Mesh(mesh)) => Some((format!("superstructure.post[{i}].shape.mesh.file"), mesh)),
            _ => None,
        });
        let surfaces = self.room.surface.iter().enumerate();
        let surfaces = surfaces.filter_map(|(i, surface)| match &surface.shape {
            SurfaceShape::Mesh(mesh) => Some((format!("room.surface[{i}].shape.mesh.file"), mesh)),
            _ => None,
        });
        posts.chain(surfaces).collect()
    }

    /// The same meshes, mutable, so that their files can be replaced.
    pub fn mesh_shapes_mut(&mut self) -> impl Iterator<Item = &mut MeshShape> {
        let posts = self.superstructure.post.iter_mut();
        let posts = posts.filter_map(|post| match &mut post.shape {
            Some(PostShape::Mesh(mesh)) => Some(mesh),
            _ => None,
        });
        let surfaces = self.room.surface.iter_mut();
        posts.chain(surfaces.filter_map(|surface| match &mut surface.shape {
            SurfaceShape::Mesh(mesh) => Some(mesh),
            _ => None,
        }))
    }
}
