//! Simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.

pub mod io;
