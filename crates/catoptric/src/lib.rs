//! Catoptric: a simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.
//!
//! A scene is simulated into a dataset as a laboratory would record it, along with the truth; an estimator that never
//! sees the truth turns the dataset into a calibration; a score reports how good the calibration is:
//!
//! ```
//! # fn main() -> Result<(), catoptric::Error> {
//! # let folder = tempfile::tempdir().expect("a folder");
//! # std::fs::write(folder.path().join("mine.toml"), catoptric::Template::TwoMirror.text()).expect("a file");
//! # std::env::set_current_dir(folder.path()).expect("it is there");
//! let scene = catoptric::Scene::load("mine.toml")?;
//! let (dataset, truth) = catoptric::simulate(&scene)?;
//! let calibration = catoptric::calibrate(&dataset)?;
//! let score = catoptric::score(&dataset, &calibration, &truth)?;
//! println!("{}: {:.4}° per axis, at best {:.4}°",
//!     score.verdict.word(), score.per_axis_rms_deg, score.crlb_per_axis_deg);
//! # assert!(score.per_axis_rms_deg < 0.1);
//! # Ok(())
//! # }
//! ```
//!
//! # The nouns
//!
//! - [`Scene`]: an experiment as a person writes it; [`Template`] has four to start from
//! - [`Dataset`]: what a laboratory recorded, simulated or real ([`read_dataset`], [`simulate_into`])
//! - [`Truth`]: what was simulated; a dataset without it is blind
//! - [`Characterization`]: the range errors of the bare sensor (step 1)
//! - [`Calibration`]: for every element (θ, φ) and d with covariance, or a [`Status`](model::Status) and a reason
//! - [`PointCloud`]: the readings of a stretch as points, given a calibration
//! - [`Score`]: the errors of a calibration, their bounds, and whether its covariance is honest
//!
//! # The verbs
//!
//! | from | verb | to |
//! |---|---|---|
//! | [`Scene`] | [`simulate`], [`simulate_into`] | [`Dataset`] and [`Truth`] |
//! | [`Scene`], rays | [`trace`](fn@trace) | paths |
//! | [`Dataset`] | [`characterize`] | [`Characterization`] |
//! | [`Dataset`] | [`calibrate`], [`calibrate_with`] | [`Calibration`] |
//! | [`Dataset`], [`Calibration`] | [`apply`](fn@apply), [`apply_into`] | [`PointCloud`] |
//! | [`Dataset`], [`Calibration`], [`Truth`] | [`score`](fn@score), [`compare`](fn@compare), [`validate`](fn@validate) | [`Score`], [`Comparison`] |
//! | [`Scene`] | [`study`](fn@study), [`study_into`], [`merge_studies`] | [`Summary`](study::Summary) |
//! | [`Scene`] or [`Dataset`] | [`plan`](fn@plan) | [`Plan`](calib::plan::Plan) |
//! | [`Scene`] | [`layout`](fn@layout), [`optimize`](fn@optimize), [`tolerance`](fn@tolerance), [`export`](fn@export) | figures, better scenes, files |
//! | any of these | [`report`](fn@report) | a page |
//!
//! Long verbs take a [`Control`]: stop, progress, threads. All verbs share one [`Error`].
//!
//! # The crates
//!
//! [`model`] is the vocabulary, [`cast`] intersects rays with surfaces, [`sim`] is the simulator, [`calib`] the
//! estimator, [`files`] every file format; [`testing`] (feature `testing`) has property tests and gates for CI. The
//! [`guide`] explains everything chapter by chapter.
#![cfg_attr(not(feature = "testing"), doc = "\n[`testing`]: https://docs.rs/catoptric")]

mod control;
mod error;
pub mod guide;
mod scene;
mod verbs;

#[cfg(feature = "testing")]
pub use catoptric_assess::testing;
pub use catoptric_assess::{
    Comparison, Contestant, Problem, Rules, Score, Verdict, apply, compare, junit, palette, requirement,
    score, study, tables, validate,
};
pub use catoptric_calib as calib;
pub use catoptric_calib::Method;
pub use catoptric_cast as cast;
#[cfg(feature = "design")]
pub use catoptric_design::{export, layout, optimize, plan, tolerance};
pub use catoptric_files as files;
pub use catoptric_files::scene::Template;
#[cfg(feature = "recording")]
pub use catoptric_files::{Damage, Output, read_dataset, read_reference, read_truth, write_json};
pub use catoptric_files::{read_calibration, read_calibration_for, read_characterization};
pub use catoptric_model as model;
pub use catoptric_model::{Calibration, Characterization, CloudFrame, Dataset, PointCloud, Stop, Stopped};
#[cfg(feature = "report")]
pub use catoptric_report as report;
#[cfg(feature = "report")]
pub use catoptric_report::report;
pub use catoptric_sim as sim;
pub use catoptric_sim::Truth;
pub use control::{Control, Progress};
pub use error::Error;
pub use scene::Scene;
pub use verbs::*;
