//! The virtual laboratory: a 2D LiDAR with mirrors, target boards and motion capture, simulated ray by ray.

pub mod check;
pub mod layout;
pub mod scene;
pub mod truth;

pub use scene::Scene;
pub use truth::Truth;
