//! `catoptric schema`: prints the JSON Schema of a kind of file, for editors and for those who write such files.

use super::error::CliError;
use super::one_of::one_of;
use super::output::print;
use catoptric::files::schema::FileKind;
use clap::Args;

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// The kind of file.
    #[arg(
        value_parser = one_of(&FileKind::ALL, FileKind::name, FileKind::about),
        default_value = FileKind::Scene.name()
    )]
    kind: FileKind,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), CliError> {
    print(&format!("{:#}\n", arguments.kind.json_schema()))
}
