//! Can it be believed? What boards determine at all, which directions they leave open, and how far an estimate can be off
//! under every error believed in.

pub(crate) mod common;
pub mod covariance;
pub mod gauge;
pub(crate) mod levers;
pub mod observability;
