//! Whether a scene makes sense: everything that takes more than one value, or some geometry, to see.
//!
//! The format itself (types, ranges of single values, unknown keys) is the schema's affair. All problems are found
//! in one pass, each with the path of the key that it is about. Geometry is that of the drawing: errors of the
//! structure as built are small against everything that is refused here.

mod experiment;
mod flight;
mod mishap;
mod outline;
mod stage;
mod structure;
mod values;

pub use outline::{Outline, ServedFacet, outline};

use crate::scene::Scene;
use std::fmt;

/// One step into a scene.
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

/// Something that makes a scene impossible to simulate.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Which value it is about.
    pub path: Path,
    /// What was found and what is allowed.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

/// Everything that is wrong with a scene.
pub fn problems(scene: &Scene) -> Vec<Problem> {
    let mut found = Findings(Vec::new());
    values::check(scene, &mut found);
    stage::check(scene, &mut found);
    // Where there is no laboratory, structure and procedure have nothing to be checked against.
    if !scene.has_no_laboratory() {
        structure::check(scene, &mut found);
        if scene.room.has_walls() {
            experiment::check(scene, &mut found);
            mishap::check(scene, &mut found);
        }
        flight::check(scene, &mut found);
    }
    found.0
}

/// The name that was probably meant, if one is near enough.
///
/// ```
/// use catoptric_sim::check::nearest;
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

/// What the checks have found so far.
struct Findings(Vec<Problem>);

impl Findings {
    /// Notes a problem; the message reads on from the key's name.
    fn add(&mut self, path: &Path, message: impl fmt::Display, help: impl Into<Option<String>>) {
        self.0.push(Problem {
            path: path.clone(),
            message: format!("`{path}` {message}"),
            help: help.into(),
        });
    }
}

/// "did you mean …", or the list of what there is.
fn suggestion<'a>(found: &str, what: &str, names: impl IntoIterator<Item = &'a str> + Clone) -> String {
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
