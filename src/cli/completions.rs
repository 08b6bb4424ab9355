//! `catoptric completions`: prints a shell's completion script.

use super::error::CliError;
use super::output::print;
use clap::{Args, Command};
use clap_complete::Shell;

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The shell.
    shell: Shell,
}

pub(crate) fn run(arguments: &Arguments, mut program: Command) -> Result<(), CliError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "catoptric", &mut script);
    print(&String::from_utf8_lossy(&script))
}
