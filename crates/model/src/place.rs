//! Places in files: the path of a value, what is wrong with it, and the name that was probably meant.
//!
//! Whoever reads a file, a scene or a session, says the same way where in it something is wrong.

use std::fmt;

/// One step into a file.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub enum Segment {
    /// Into a table.
    Key(String),
    /// Into an array, from 0.
    Index(usize),
}

/// The way to a value, written `superstructure.facet[2].name`.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Default)]
pub struct Path(pub Vec<Segment>);

/// Something that is wrong with a value.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Which value it is about.
    pub path: Path,
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
    let distance = |name: &str| strsim::damerau_levenshtein(&found, &name.to_lowercase());
    names
        .into_iter()
        .map(|name| (distance(name), name))
        // A third of the letters wrong is still a slip of the pen; more is another word.
        .filter(|(d, name)| *d <= (name.chars().count().max(found.chars().count()) / 3).max(1))
        .min_by_key(|(d, _)| *d)
        .map(|(_, name)| name)
}

impl Path {
    /// The way to a key of the outermost table.
    pub fn of(key: &str) -> Self {
        Self::default().key(key)
    }

    /// One step further, into a table.
    #[must_use]
    pub fn key(&self, key: &str) -> Self {
        self.step(Segment::Key(key.to_owned()))
    }

    /// One step further, into an array.
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

impl fmt::Display for Path {
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
