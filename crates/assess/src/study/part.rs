//! A part of a study, for running it on several machines in parallel.

use super::StudyError;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A part of a study by its number and the number of parts, written `1/4`.
///
/// ```
/// use catoptric_assess::study::Part;
/// assert_eq!("2/4".parse::<Part>().unwrap(), Part { part: 2, parts: 4 });
/// assert!("5/4".parse::<Part>().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "[usize; 2]", into = "[usize; 2]")]
pub struct Part {
    /// Number of the part, from 1.
    pub part: usize,
    /// Number of parts.
    pub parts: usize,
}

impl Part {
    /// The whole study.
    pub const WHOLE: Self = Self { part: 1, parts: 1 };
}

impl From<[usize; 2]> for Part {
    fn from([part, parts]: [usize; 2]) -> Self {
        Self { part, parts }
    }
}

impl From<Part> for [usize; 2] {
    fn from(Part { part, parts }: Part) -> Self {
        [part, parts]
    }
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.parts)
    }
}

impl FromStr for Part {
    type Err = StudyError;

    fn from_str(text: &str) -> Result<Self, StudyError> {
        text.split_once('/')
            .and_then(|(part, parts)| {
                Some(Self {
                    part: part.parse().ok()?,
                    parts: parts.parse().ok()?,
                })
            })
            .filter(|found| (1..=found.parts).contains(&found.part))
            .ok_or_else(|| {
                StudyError::invalid(
                    format!("shard {text}: expected i/N with i from 1 to N"),
                    "1/4 is the first of four",
                )
            })
    }
}
