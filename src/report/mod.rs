//! report
/// x
pub fn report() {}
