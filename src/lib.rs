//! The program `catoptric` as a library: its arguments in, its exit code out.

mod cli;

pub use cli::run;
