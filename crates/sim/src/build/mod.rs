//! From the drawing to surfaces: mirrors, bodies, boards, walls; and the trajectory of a flight.

pub(crate) mod board;
pub(crate) mod coating;
pub mod color;
pub mod pattern;
pub(crate) mod room;
pub(crate) mod stage;
pub(crate) mod structure;
pub(crate) mod trajectory;

pub use room::room_from_rig;
pub use stage::Stage;
pub use structure::{Back, Bent, BuiltFacet, OpaquePart, Structure, nominal_mount};
pub use trajectory::Trajectory;
