//! The virtual laboratory: a 2D LiDAR with mirrors, target boards and motion capture, simulated ray by ray.
//!
//! The modules are listed here in the order in which a scene becomes data: what a person writes ([`scene`], [`check`]),
//! surfaces ([`build`]), paths of light ([`light`]), the resulting readings ([`receive`]), the experiment
//! ([`laboratory`]). Each uses the ones before it, and none that comes later.

pub mod build;
pub mod check;
mod error;
mod findings;
pub mod laboratory;
mod lanes;
pub mod light;
pub mod noise;
pub mod receive;
pub mod scene;
pub mod trace;

pub use catoptric_cast::Mesh;
pub use error::SimError;
pub use laboratory::Laboratory;
pub use laboratory::truth::{self, Truth};
pub use scene::{Meshes, Scene};
