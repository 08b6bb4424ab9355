//! The plots of the report, each with its caption and its table.

mod angles;
mod azimuth;
mod cloud;
mod elements;
mod fans;
mod residuals;
mod statuses;

pub(super) use angles::{errors, estimates};
pub use cloud::MAX_POINTS;
pub(super) use cloud::cloud;
pub(super) use fans::{fan, fans};
pub(super) use residuals::residuals;
pub(super) use statuses::statuses;
