//! The estimator: where each mirrored beam of a 2D scanner goes, and how well that is known.
//!
//! A board of plane (c, n) gives one equation per element (Cooper, Raquet, Patton 2018, Eqs. 3, 6–8):
//!
//! ```text
//! z = r_raw − E_a − E_c − E_r = d + n·(c − P_L1)/(n·v(θ_a, φ)) + noise
//! Δx = (HᵀH)⁻¹Hᵀ(z − r(x̂)),  H = [∂r/∂θ_a  ∂r/∂φ]
//! ```
//!
//! [`calibrate`] runs the paper's steps 4–6 and 11–13: it places the sensor in the rig ([`pose`]), sorts the elements
//! ([`screen`]), solves each deflected one on the boards that it hits ([`solve`], [`recursive`]), says what the boards
//! leave open ([`observability`]) and how far the answer can be off ([`covariance`]). [`least_squares`] solves problems
//! of many parameters for estimators to be built on it. The crate knows the model, not the simulator: it cannot see the
//! truth. It reads no file, prints nothing and draws nothing at random.

mod ahead;
mod ambiguity;
mod bare;
mod calibrate;
mod calibrator;
mod characterize;
mod choose;
pub mod common;
pub mod covariance;
mod element;
pub mod error;
pub mod gauge;
mod gls;
pub mod initial;
pub mod jacobian;
mod joint;
mod judge;
pub mod least_squares;
pub mod locate;
mod mount_data;
pub mod observability;
pub mod observations;
pub mod options;
pub mod plan;
pub mod pose;
pub mod recursive;
pub mod screen;
pub mod solve;
pub mod spread;
pub mod tracking;

pub use calibrate::{calibrate, calibrate_until};
pub use calibrator::Calibrator;
pub use characterize::characterize;
pub use covariance::{Budget, MountUncertainty};
pub use element::LEAST_BOARDS;
pub use error::CalibError;
pub use joint::{TrueDirection, limit};
pub use options::{JacobianForm, Method, Options};
