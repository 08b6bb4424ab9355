//! facade
pub use catoptric_calib as calib;
pub use catoptric_model as model;
pub use catoptric_sim as sim;
