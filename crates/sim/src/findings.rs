//! The problems that the checks find, and how they are worded.

use catoptric_model::place::{KeyPath, Problem, nearest};
use std::fmt;

/// Maximum number of names that are compared and listed: more would make many problems slow to report.
const MOST_LISTED: usize = 100;

/// The problems found so far.
pub(crate) struct Findings(pub(crate) Vec<Problem>);

impl Findings {
    /// Records a problem; the message continues from the name of the key.
    pub(crate) fn add(
        &mut self,
        path: &KeyPath,
        message: impl fmt::Display,
        help: impl Into<Option<String>>,
    ) {
        self.0.push(Problem {
            path: path.clone(),
            message: format!("`{path}` {message}"),
            help: help.into(),
        });
    }
}

/// Asks "did you mean …?" for a close name, or lists the known ones.
pub(crate) fn suggestion<'a>(found: &str, what: &str, names: impl IntoIterator<Item = &'a str>) -> String {
    let mut names = names.into_iter();
    let first: Vec<&str> = names.by_ref().take(MOST_LISTED).collect();
    let is_more = names.next().is_some();
    match nearest(found, first.iter().copied()) {
        Some(name) => format!("did you mean `{name}`?"),
        None if first.is_empty() => format!("the scene has no {what}"),
        None => format!("known: {}{}", first.join(", "), if is_more { ", …" } else { "" }),
    }
}
