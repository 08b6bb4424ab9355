//! Randomness: every draw is a pure function of (seed, purpose, row, column, index).
//!
//! One ChaCha8 key represents (seed, purpose, row); the columns of a row (the beams of a scan) take equal, consecutive
//! pieces of its stream. A scan computed alone, in another order or on another machine draws the same numbers, and no
//! two rows or purposes share any. Normal deviates use the Box–Muller transform because it always takes two words,
//! where faster methods take a varying number.

mod columns;
mod draws;

pub use columns::Columns;
pub use draws::{Draws, Purpose};

/// The rule in one line, for `manifest.json`.
pub const RULE: &str = "ChaCha8; key = (seed, purpose, row, \"catoptr1\"); 16 words per column; Box-Muller";
