//! Simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.

pub mod apply;
pub mod io;
pub mod report;
pub mod score;
pub mod validate;

pub use apply::{CloudFrame, PointCloud, apply};
pub use catoptric_calib as calib;
pub use catoptric_model as model;
pub use catoptric_sim as sim;
pub use report::report;
pub use score::{Score, Verdict, score};
pub use validate::{Problem, validate};

#[cfg(test)]
mod sample;
