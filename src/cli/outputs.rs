//! Where a verb writes, and what it may write over. What is refused is refused before any work is done.

use super::error::CliError;
use catoptric::Output;
use catoptric::files::folder::FolderKind;
use catoptric::files::{Content, IoError};
use clap::Args;
use std::cell::RefCell;
use std::io;
use std::path::{Path, PathBuf};

/// What may be written over, for every verb that writes.
#[derive(Debug, Clone, Copy, Default, Args)]
pub(crate) struct Replacing {
    /// Write over whatever is there. Otherwise only a result of the same kind is written over, and never an input.
    #[arg(long)]
    pub(crate) replace: bool,
}

impl Replacing {
    /// The outputs of a run with these inputs.
    pub(crate) fn outputs(self, inputs: impl IntoIterator<Item = impl AsRef<Path>>) -> Outputs {
        Outputs {
            replace: self.replace,
            inputs: inputs.into_iter().map(|path| path.as_ref().to_owned()).collect(),
            taken: RefCell::default(),
        }
    }
}

/// The outputs of a run, each of which has a place of its own.
pub(crate) struct Outputs {
    replace: bool,
    inputs: Vec<PathBuf>,
    taken: RefCell<Vec<PathBuf>>,
}

impl Outputs {
    /// The place of a file of this content.
    pub(crate) fn file(&self, path: &Path, content: &Content) -> Result<Output, CliError> {
        let out = self.place(path)?;
        out.admit(content)?;
        let folder = path.parent().filter(|p| !p.as_os_str().is_empty());
        if folder.is_some_and(|folder| !folder.exists()) {
            return Err(IoError::write(path, io::ErrorKind::NotFound.into()).into());
        }
        Ok(out)
    }

    /// The place of a folder that is written as a whole.
    pub(crate) fn folder(&self, path: &Path, kind: &FolderKind) -> Result<Output, CliError> {
        let out = self.place(path)?;
        kind.admit(&out)?;
        Ok(out)
    }

    /// The place of something; what is there is examined when it is written.
    pub(crate) fn place(&self, path: &Path) -> Result<Output, CliError> {
        let real = real(path);
        let mut taken = self.taken.borrow_mut();
        let is_device = real.exists() && !real.is_file() && !real.is_dir();
        if !is_device && taken.iter().any(|t| t.starts_with(&real) || real.starts_with(t)) {
            return Err(CliError::invalid(
                format!("{}: another output of this run is written there", path.display()),
                "choose another name for one of them".to_owned(),
            ));
        }
        taken.push(real);
        Ok(Output::new(path).replacing(self.replace).sparing(&self.inputs))
    }
}

/// The path without links, as far as it exists.
fn real(path: &Path) -> PathBuf {
    if let Ok(real) = path.canonicalize() {
        return real;
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    match (absolute.parent(), absolute.file_name()) {
        (Some(folder), Some(name)) => real_folder(folder).join(name),
        _ => absolute,
    }
}

fn real_folder(folder: &Path) -> PathBuf {
    folder.canonicalize().unwrap_or_else(|_| folder.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_output_has_a_place_of_its_own() {
        let place = std::env::temp_dir();
        let outputs = Replacing::default().outputs(&[] as &[&Path]);
        let at = |name: &str| place.join(name);
        assert!(outputs.place(&at("catoptric-a")).is_ok());
        for name in ["catoptric-a", "catoptric-a/b", "./catoptric-a"] {
            assert!(outputs.place(&at(name)).is_err(), "{name}");
        }
        assert!(outputs.place(&at("catoptric-b")).is_ok());
    }
}
