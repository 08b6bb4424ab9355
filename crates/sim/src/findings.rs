//! The problems that the checks find, and how they are worded.

use catoptric_model::place::{Path, Problem, nearest};
use std::fmt;

/// The problems found so far.
pub(crate) struct Findings(pub(crate) Vec<Problem>);

impl Findings {
    /// Records a problem; the message continues from the name of the key.
    pub(crate) fn add(&mut self, path: &Path, message: impl fmt::Display, help: impl Into<Option<String>>) {
        self.0.push(Problem {
            path: path.clone(),
            message: format!("`{path}` {message}"),
            help: help.into(),
        });
    }
}

/// Asks "did you mean …?" for a close name, or lists the known ones.
pub(crate) fn suggestion<'a>(
    found: &str,
    what: &str,
    names: impl IntoIterator<Item = &'a str> + Clone,
) -> String {
    if let Some(name) = nearest(found, names.clone()) {
        return format!("did you mean `{name}`?");
    }
    let names: Vec<&str> = names.into_iter().collect();
    if names.is_empty() {
        format!("the scene has no {what}")
    } else {
        format!("known: {}", names.join(", "))
    }
}
