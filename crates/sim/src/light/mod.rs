//! Paths of light: the footprint of a beam, its path via mirrors and through glass, and the power that returns.

pub mod edges;
pub mod footprint;
pub mod glass;
pub(crate) mod optics;
pub mod power;
pub(crate) mod view;

pub use optics::{
    Bounce, Course, Edit, End, MAX_BOUNCES, Meeting, Mirrors, RayPath, Rig, Role, Setting, Spread, Target,
    Trail,
};
