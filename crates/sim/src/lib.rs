//! The virtual laboratory: a 2D LiDAR with mirrors, target boards and motion capture, simulated ray by ray.

mod board;
pub mod check;
pub mod color;
pub mod detect;
pub mod echo;
pub mod error;
pub mod footprint;
pub mod glass;
pub mod laboratory;
mod lanes;
pub mod layout;
pub mod mocap;
pub mod noise;
pub mod optics;
pub mod pattern;
pub mod phase;
pub mod placement;
pub mod power;
pub mod reading;
pub mod room;
pub mod scanner;
pub mod scene;
pub mod spot;
pub mod stage;
pub mod structure;
pub mod trace;
pub mod trajectory;
pub mod truth;

pub use catoptric_cast::Mesh;
pub use error::SimError;
pub use laboratory::Laboratory;
pub use scene::{Meshes, Scene};
pub use truth::Truth;
