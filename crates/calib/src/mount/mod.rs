//! Where the sensor sits in the rig (step 5): which readings tell, and what they come to.

pub(crate) mod mount_data;
pub mod pose;
