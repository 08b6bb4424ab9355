//! `catoptric man`: prints or writes the manual pages.

use super::error::CliError;
use super::output::print;
use catoptric::files::IoError;
use clap::{Args, Command};
use std::path::PathBuf;

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Write the pages of all verbs to this folder instead of printing the main one.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, program: Command) -> Result<(), CliError> {
    let Some(folder) = &arguments.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(program)
            .render(&mut page)
            .map_err(CliError::Output)?;
        return print(&String::from_utf8_lossy(&page));
    };
    let write_error = |source| IoError::write(folder, source);
    std::fs::create_dir_all(folder).map_err(write_error)?;
    clap_mangen::generate_to(program, folder).map_err(write_error)?;
    print(&format!("wrote the manual pages to {}\n", folder.display()))
}
