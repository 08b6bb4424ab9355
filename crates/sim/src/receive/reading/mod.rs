//! One beam against one setting: its sub-rays' ways, the echo they make, and the range read off it.
//!
//! Everything but `report` is free of chance; it is the same for every scan of a stretch.

mod class;
mod observe;
mod over;
mod part;
mod receive;
mod report;
mod returned;
mod sensor;
mod sub_ray;

pub use class::{BeamClass, class};
pub use observe::Share;
pub use part::Parts;
pub use report::Chance;
pub use returned::{MAX_ECHOES, Return};
pub use sensor::Sensor;
pub use sub_ray::{Light as SubRayLight, Stop, SubRayEnd};
