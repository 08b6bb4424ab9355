//! Simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.

pub mod io;

pub use catoptric_model as model;
pub use catoptric_sim as sim;
