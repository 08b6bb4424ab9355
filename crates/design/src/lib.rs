//! What a mirror layout is worth: what it sees, loses and allows ([`layout`]), better ones ([`optimize`]), what
//! manufacturing errors do to it ([`tolerance`]), where its boards should stand ([`plan`]), and files for making it
//! ([`export`]).

pub mod export;
pub mod layout;
pub mod optimize;
pub mod plan;
pub mod tolerance;
