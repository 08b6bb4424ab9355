//! Assessment of calibrations: scoring against the truth or against boards and walls, comparison, application to a scan,
//! validation, and studies over many seeds.

pub mod apply;
pub mod compare;
pub mod junit;
pub mod palette;
pub mod requirement;
pub mod score;
pub mod study;
pub mod tables;
#[cfg(feature = "testing")]
pub mod testing;
pub mod validate;

pub use apply::apply;
pub use compare::{CompareError, Comparison, Contestant, Rules, compare, compare_by};
pub use requirement::{Requirement, RequirementError};
pub use score::{Score, Verdict, score};
pub use validate::{Problem, validate};
