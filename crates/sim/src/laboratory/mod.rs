//! The virtual laboratory: a scene and a seed become stretches of scans, the session, and the truth.
//!
//! Every stretch is a pure function of (scene, seed, number), so stretches can be computed in any order.

mod belief;
mod effects;
mod excerpt;
mod knowledge;
mod label;
mod mishap;
pub mod mocap;
pub mod placement;
mod record;
mod recorder;
mod setup;
mod sight;
mod targets;
mod tracks;
mod true_values;
pub mod truth;

pub use effects::{Memory, StretchEffects};
pub use excerpt::{Drawn, ExcerptRecorder};
pub use recorder::Recorder;
pub use setup::Laboratory;
pub use sight::{Returns, Sight};
pub(crate) use targets::wall_targets;
