//! What beams read, and what they should have read.
//!
//! Readings are averaged without outliers ([`locate`]); step 3's distances are compared with the plane of their facet.
//! Boards are placed in the sensor frame ([`observations`], step 6), and a ray's range to them is differentiated
//! ([`jacobian`], Eq. (7)).

pub(crate) mod ahead;
pub(crate) mod bare;
pub(crate) mod columns;
pub mod jacobian;
pub mod locate;
pub mod observations;
pub(crate) mod spread;
