//! Tests of the whole calibration on data from its own forward model.
//!
//! This is the "inverse crime", committed on purpose: it proves that the estimator inverts its own model and that its
//! covariances are honest under its own beliefs. It does not prove that the beliefs describe a scanner.

mod basin;
mod closure;
mod consistency;
mod degenerate;
mod gauge;
mod invariance;
mod statuses;
mod synthetic;
