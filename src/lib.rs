//! Catoptric: a simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.
//!
//! A scene becomes a dataset as a laboratory would record it, with the truth beside it; an estimator that never sees
//! the truth turns the dataset into a calibration; a score says how well it did.
//!
//! ```
//! use catoptric::{calib, score, sim};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut scene: sim::Scene = toml::from_str(include_str!("../scenes/prototype.toml"))?;
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
//! The words are the same everywhere: [`model`] is the vocabulary, [`sim`] the world, [`calib`] the estimator; [`io`]
//! holds every file format. The [`guide`] tells it chapter by chapter.

pub mod apply;
pub mod compare;
pub mod export;
pub mod guide;
pub mod io;
pub mod layout;
pub mod optimize;
pub mod plan;
pub mod report;
pub mod score;
pub mod study;
pub mod tables;
#[cfg(feature = "testing")]
pub mod testing;
pub mod tolerance;
pub mod validate;

pub use apply::{CloudFrame, PointCloud, apply};
pub use catoptric_calib as calib;
pub use catoptric_cast as cast;
pub use catoptric_model as model;
pub use catoptric_sim as sim;
pub use compare::{Comparison, Contestant, compare};
pub use report::report;
pub use score::{Score, Verdict, score};
pub use validate::{Problem, validate};

#[cfg(test)]
mod sample;
