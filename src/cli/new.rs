//! `catoptric new`: writes a commented scene to start from.

use super::error::CliError;
use super::one_of::one_of;
use super::output::{print, quoted};
use catoptric::Template;
use catoptric::files::IoError;
use clap::Args;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};
use std::path::PathBuf;

/// Arguments of `new`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The file to write; it must not exist.
    #[arg(value_name = "NAME.toml")]
    name: PathBuf,
    /// The mirrors to start from.
    #[arg(
        long,
        value_parser = one_of(&Template::ALL, Template::name, Template::about),
        default_value = Template::Prototype.name()
    )]
    layout: Template,
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
    // `create_new` is atomic: a file that another program creates meanwhile cannot be overwritten.
    let file = OpenOptions::new().write(true).create_new(true).open(path);
    let mut file = file.map_err(|source| match source.kind() {
        ErrorKind::AlreadyExists => CliError::invalid(
            format!("{} exists already and was not changed", path.display()),
            "choose another name, or remove the file first".to_owned(),
        ),
        _ => IoError::write(path, source).into(),
    })?;
    let written = file
        .write_all(arguments.layout.text().as_bytes())
        .and_then(|()| file.sync_all());
    if let Err(source) = written {
        // An incomplete scene is worse than none.
        let _ = std::fs::remove_file(path);
        return Err(IoError::write(path, source).into());
    }
    print(&format!(
        "wrote {}\nnext: catoptric check {}\n",
        path.display(),
        quoted(path)
    ))
}
