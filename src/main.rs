//! The program `catoptric`: see `catoptric --help`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::main()
}
