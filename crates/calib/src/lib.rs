//! The estimator: where each mirrored beam of a 2D scanner goes, and how well that is known.
//!
//! A board of plane (c, n) gives one equation per element (Cooper, Raquet, Patton 2018, Eqs. (3) and (6)–(8)):
//!
//! ```text
//! z = r_raw − E_a − E_c − E_r = d + n·(c − P_L1)/(n·v(θ_a, φ)) + noise
//! Δx = (HᵀH)⁻¹Hᵀ(z − r(x̂)),  H = [∂r/∂θ_a  ∂r/∂φ]
//! ```
//!
//! [`calibrate`] runs the paper's steps 4–6 and 11–13. The modules follow the data: what went wrong in a recording
//! ([`tracking`]); what beams read ([`locate`], [`observations`]); where the sensor sits in the rig ([`pose`]); which
//! elements a mirror deflects; one element alone on the boards that it hits ([`solve`], [`recursive`]), and all
//! elements at once ([`limit`](fn@limit) gives the best possible accuracy). Below these: what boards leave open
//! ([`observability`], [`gauge`]) and how far off a result can be ([`covariance`]). [`lsq`] solves problems with many
//! parameters, for the estimators built on it; [`plan`] proposes the board poses to record next.
//!
//! The crate knows the model, not the simulator: it cannot see the truth. It reads no file, prints nothing and draws no
//! random numbers.

mod calibrate;
mod calibrator;
mod characterize;
mod element;
mod error;
mod joint;
mod judge;
pub mod lsq;
mod method;
mod mount;
mod options;
pub mod plan;
mod prepare;
mod readings;
mod screen;
pub mod tracking;

pub use calibrate::{calibrate, calibrate_until};
pub use calibrator::Calibrator;
pub use characterize::characterize;
pub use element::attempt::MIN_BOARDS;
pub use element::{initial, recursive, solve};
pub use error::CalibError;
pub use joint::{TrueDirection, limit};
pub use judge::common::CommonErrors;
pub use judge::covariance::{Budget, MountUncertainty};
pub use judge::{covariance, gauge, observability};
pub use method::Method;
pub use mount::pose;
pub use options::{JacobianForm, Options};
pub use readings::{jacobian, locate, observations};
