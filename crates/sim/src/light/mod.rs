//! Light on its way: the footprint of a beam, its path over mirrors and through glass, and what power comes back.

pub mod footprint;
pub mod glass;
pub(crate) mod optics;
pub mod power;

pub use optics::{
    Bounce, Course, Edit, End, MAX_BOUNCES, Meeting, Mirrors, Path, Rig, Role, Setting, Target, Trail,
};
