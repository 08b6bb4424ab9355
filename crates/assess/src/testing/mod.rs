//! Property tests and gates for testing a calibrator in CI: random valid scenes that shrink toward simple ones, and
//! assertions with a known rate of false alarms. Requires the cargo feature `testing`.
//!
//! | to check that | call |
//! |---|---|
//! | without noise every deflected element is recovered | [`closure`], [`closure_of`] |
//! | the stated covariance matches the errors | [`Anees`], [`Coverage`] |
//! | the errors average out over experiments, θ_a and φ apart | [`Bias`] |
//! | the errors are as small as the data allow | [`Efficiency`] |
//! | the same data yield the same bytes on any number of threads | [`deterministic`] |
//!
//! Each check has one function that returns a [`Failure`] and one called `assert_…` (or `assert`) that panics with its
//! text. The gates use one element of each [`Trial`], since the elements of one experiment share errors: the trials are
//! independent, and the bounds exact. A [`Calibrator`](catoptric_calib::Calibrator) can be passed directly; a calibration
//! from a file is passed to [`closure_of`] and [`Trial::of`].
//!
//! ```
//! use catoptric_calib::Method;
//! use catoptric_assess::testing::{Anees, Coverage, Significance, trials};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene: catoptric_sim::Scene = toml::from_str(include_str!("../../../../scenes/reference-facet.toml"))?;
//! scene.experiment.scans_per_pose = 10;
//! let trials = trials(&scene, 1..=8, &Method::BeamGls)?;
//! // Two gates share one false alarm in a thousand jobs.
//! let significance = Significance::PER_MILLE.among(2);
//! Anees::over(&trials).gate(significance)?;
//! Coverage::over(&trials, 0.95).gate(significance)?;
//! # Ok(())
//! # }
//! ```

mod bias;
mod closure;
mod determinism;
mod failure;
mod gate;
mod random_scene;
mod significance;
mod strategies;
mod trial;

pub use bias::Bias;
pub use closure::{assert_closure, assert_closure_of, closure, closure_of};
pub use determinism::{assert_deterministic, deterministic, same_result};
pub use failure::Failure;
pub use gate::{Anees, Coverage, Efficiency};
pub use random_scene::RandomScene;
pub use significance::Significance;
pub use strategies::{board_designs, layouts, rooms, scanners, scenes, without_errors};
pub use trial::{Drawn, Trial, trials};
