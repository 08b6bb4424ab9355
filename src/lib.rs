//! facade

pub mod io;

pub use catoptric_model as model;
pub use catoptric_sim as sim;
