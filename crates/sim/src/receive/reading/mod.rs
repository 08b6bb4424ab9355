//! One beam in one setting: the paths of its sub-rays, the echo they produce, and the range taken from it.
//!
//! Everything except `report` is without random effects, and the same for every scan of a stretch.

mod class;
mod observe;
mod over;
mod part;
mod receive;
mod report;
mod returned;
mod sensor;
mod smooth;
mod sub_ray;

pub use class::{BeamClass, class};
pub use observe::Share;
pub use part::Parts;
pub use report::RandomEffects;
pub use returned::{MAX_ECHOES, Return};
pub use sensor::Sensor;
pub use sub_ray::{Light as SubRayLight, SubRayEnd, SubRayStop};
