//! The program `catoptric`: see `catoptric --help`.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(catoptric_cli::run(std::env::args_os()))
}
