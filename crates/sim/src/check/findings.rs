//! What the checks have found, and how they say it.

use catoptric_model::place::{Path, Problem, nearest};
use std::fmt;

/// What the checks have found so far.
pub(super) struct Findings(pub(super) Vec<Problem>);

impl Findings {
    /// Notes a problem; the message reads on from the key's name.
    pub(super) fn add(&mut self, path: &Path, message: impl fmt::Display, help: impl Into<Option<String>>) {
        self.0.push(Problem {
            path: path.clone(),
            message: format!("`{path}` {message}"),
            help: help.into(),
        });
    }
}

/// "did you mean …", or the list of what there is.
pub(super) fn suggestion<'a>(
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
