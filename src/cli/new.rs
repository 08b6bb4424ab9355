//! `catoptric new`: writes a commented scene to start from.

use super::error::CliError;
use super::one_of::one_of;
use super::output::{print, quoted};
use super::outputs::Replacing;
use catoptric::{Template, files};
use clap::Args;
use std::path::PathBuf;

/// Arguments of `new`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The file to write; without --replace it must not exist.
    #[arg(value_name = "NAME.toml")]
    name: PathBuf,
    /// The mirrors to start from.
    #[arg(
        long,
        value_parser = one_of(&Template::ALL, Template::name, Template::about),
        default_value = Template::Prototype.name()
    )]
    layout: Template,
    #[command(flatten)]
    replacing: Replacing,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    let path = &arguments.name;
    if path.extension().is_none_or(|e| e != "toml") {
        return Err(CliError::invalid(
            format!(
                "{} does not end in .toml, the format of new scenes",
                path.display()
            ),
            format!("catoptric new {}", quoted(&path.with_extension("toml"))),
        ));
    }
    let out = arguments.replacing.outputs(&[] as &[PathBuf]).place(path)?;
    files::write_file(out, arguments.layout.text().as_bytes())?;
    print(&format!(
        "wrote {}\nnext: catoptric check {}\n",
        path.display(),
        quoted(path)
    ))
}
