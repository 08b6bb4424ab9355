//! From returning light to a reading: pulses, echoes, ranges.

pub mod detect;
pub mod echo;
pub mod phase;
pub(crate) mod reading;
mod spot;

pub use reading::{
    BeamClass, MAX_ECHOES, Parts, RandomEffects, Return, Sensor, Share, SubRayEnd, SubRayLight, SubRayStop,
    class,
};
