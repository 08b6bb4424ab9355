//! `catoptric schema`: prints the JSON Schema of scenes, for editors.

use super::error::CliError;
use super::output::print;
use catoptric::files::scene;

pub(crate) fn run() -> Result<(), CliError> {
    print(&format!("{:#}\n", scene::file_schema()))
}
