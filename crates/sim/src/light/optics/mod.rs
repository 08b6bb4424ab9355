//! The path of a ray: from the scanner via mirrors to whatever stops it.

mod clearance;
mod edit;
mod follow;
mod path;
mod rig;
mod setting;
mod spread;
mod together;

pub use edit::{Edit, Trail};
pub use path::{Bounce, Course, End, MAX_BOUNCES, Meeting, RayPath};
pub use rig::Rig;
pub(crate) use rig::{BeamPaths, Run, Then};
pub(crate) use setting::Beyond;
pub use setting::{Mirrors, Role, Setting, Target};
pub use spread::Spread;
