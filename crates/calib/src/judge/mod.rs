//! Is an estimate credible? What boards determine at all, which directions they leave open, and how far an estimate can
//! be off under all believed errors.

pub(crate) mod common;
pub mod covariance;
pub mod gauge;
pub(crate) mod levers;
pub mod observability;
