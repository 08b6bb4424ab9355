//! Catoptric: a simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.
//!
//! A scene becomes a dataset as a laboratory would record it, with the truth beside it; an estimator that never sees
//! the truth turns the dataset into a calibration; a score says how well it did.
//!
//! ```
//! use catoptric::{calib, score, sim};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene: sim::Scene = toml::from_str(include_str!("../../../scenes/prototype.toml"))?;
//! scene.experiment.scans_per_pose = 20;
//! let laboratory = sim::Laboratory::new(&scene, scene.seed)?;
//! let (dataset, truth) = (laboratory.dataset()?, laboratory.truth()?);
//! let calibration = calib::calibrate(&dataset, calib::Method::Beam, &calib::Options::default())?;
//! let score = score(&dataset, &calibration, Some(&truth));
//! assert!(score.beams.solved > 400);
//! # Ok(())
//! # }
//! ```
//!
//! The words are the same everywhere: [`model`] is the vocabulary, [`sim`] the world, [`calib`] the estimator; [`files`]
//! holds every file format. The [`guide`] tells it chapter by chapter.

pub mod guide;

#[cfg(feature = "testing")]
pub use catoptric_assess::testing;
pub use catoptric_assess::{
    Comparison, Contestant, Problem, Score, Verdict, apply, compare, palette, score, study, tables, validate,
};
pub use catoptric_calib as calib;
#[cfg(feature = "design")]
pub use catoptric_design::{export, layout, optimize, plan, tolerance};
pub use catoptric_files as files;
pub use catoptric_model as model;
pub use catoptric_model::{CloudFrame, PointCloud};
#[cfg(feature = "report")]
pub use catoptric_report as report;
pub use catoptric_sim as sim;
