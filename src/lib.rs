//! The program `catoptric` as a library function: arguments in, exit code out.

mod cli;

pub use cli::run;
