//! `catoptric man`: prints or writes the manual pages.

use super::error::CliError;
use super::output::print;
use super::outputs::Replacing;
use catoptric::files::{self, IoError};
use clap::{Args, Command};
use std::path::PathBuf;

/// Arguments of `man`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Write the pages of all verbs to this folder instead of printing the main one.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments, program: Command) -> Result<(), CliError> {
    let Some(folder) = &arguments.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(program)
            .render(&mut page)
            .map_err(CliError::Output)?;
        return print(&String::from_utf8_lossy(&page));
    };
    let outputs = arguments.replacing.outputs(&[] as &[PathBuf]);
    let mut program = program.disable_help_subcommand(true);
    program.build();
    let mut written = Vec::new();
    pages(program, &mut |name, page| {
        written.push((outputs.place(&folder.join(name))?, page));
        Ok(())
    })?;
    std::fs::create_dir_all(folder).map_err(|source| IoError::write(folder, source))?;
    files::write_files(&written)?;
    print(&format!("wrote the manual pages to {}\n", folder.display()))
}

/// The pages of a command and of its verbs, by the names of their files.
fn pages(
    command: Command,
    each: &mut dyn FnMut(String, Vec<u8>) -> Result<(), CliError>,
) -> Result<(), CliError> {
    for verb in command.get_subcommands().filter(|verb| !verb.is_hide_set()) {
        pages(verb.clone(), each)?;
    }
    let page = clap_mangen::Man::new(command);
    let mut bytes = Vec::new();
    page.render(&mut bytes).map_err(CliError::Output)?;
    each(page.get_filename(), bytes)
}
