//! Where the sensor sits in the rig (step 5): which readings determine it, and the estimate from them.

pub(crate) mod mount_data;
pub mod pose;
