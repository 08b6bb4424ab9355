//! The estimator.

pub mod common;
pub mod covariance;
pub mod error;
pub mod initial;
pub mod jacobian;
mod mount_data;
pub mod observations;
pub mod options;
pub mod pose;
pub mod recursive;
pub mod screen;
pub mod solve;
pub mod spread;

pub use error::CalibError;
pub use options::{JacobianForm, Method, Options};
