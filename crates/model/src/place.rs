//! Locations in files: the path of a value, a problem with it, and the name that was probably meant.
//!
//! Readers of scenes and of sessions use these types to report in the same form where something is wrong.

use std::fmt;

/// One step of a path into a file.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Segment {
    /// Into a table.
    Key(String),
    /// Into an array, from 0.
    Index(usize),
}

/// The path of a value, written `superstructure.facet[2].name`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct KeyPath(pub Vec<Segment>);

/// A problem with a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// The value's path.
    pub path: KeyPath,
    /// What was found and what is allowed.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

/// The name that was probably meant, if one is near enough.
///
/// ```
/// use catoptric_model::place::nearest;
/// assert_eq!(nearest("whte", ["white", "jet_black"]), Some("white"));
/// assert_eq!(nearest("azure", ["white", "jet_black"]), None);
/// ```
pub fn nearest<'a>(found: &str, names: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let found = found.to_lowercase();
    let letters = found.chars().count();
    let distance = |name: &str| strsim::damerau_levenshtein(&found, &name.to_lowercase());
    // Up to a third of the letters wrong is a typo; more is a different word.
    let wrong = |name: &str| (name.chars().count().max(letters) / 3).max(1);
    names
        .into_iter()
        // As many letters as one has more than the other are wrong for sure: a name of a million is not compared.
        .filter(|name| name.chars().count().abs_diff(letters) <= wrong(name))
        .map(|name| (distance(name), name))
        .filter(|(d, name)| *d <= wrong(name))
        .min_by_key(|(d, _)| *d)
        .map(|(_, name)| name)
}

impl KeyPath {
    /// The path of a key of the outermost table.
    pub fn of(key: &str) -> Self {
        Self::default().key(key)
    }

    /// Extends the path into a table.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.step(Segment::Key(key.to_owned()))
    }

    /// Extends the path into an array.
    #[must_use]
    pub fn index(&self, index: usize) -> Self {
        self.step(Segment::Index(index))
    }

    fn step(&self, segment: Segment) -> Self {
        let mut segments = self.0.clone();
        segments.push(segment);
        Self(segments)
    }
}

impl fmt::Display for KeyPath {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, segment) in self.0.iter().enumerate() {
            match segment {
                Segment::Key(key) if i == 0 => write!(f, "{key}")?,
                Segment::Key(key) => write!(f, ".{key}")?,
                Segment::Index(index) => write!(f, "[{index}]")?,
            }
        }
        Ok(())
    }
}
