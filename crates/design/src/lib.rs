//! Design of mirror layouts: what a layout sees, loses and allows ([`layout`]), the search for better ones
//! ([`optimize`]), the effect of manufacturing errors ([`tolerance`]), where to place its boards ([`plan`]), and files
//! for making it ([`export`]).

pub mod export;
pub mod layout;
pub mod optimize;
pub mod plan;
pub mod tolerance;
