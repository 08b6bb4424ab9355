//! Scene files: TOML for people, JSON for programs, both read into the same types.
//!
//! A scene is read in steps, and all problems of the first step that finds any are reported: the format
//! against the schema, then its semantics ([`catoptric_sim::check`]).

use super::diagnostic::{Diagnostic, Diagnostics, Lines, Place};
use super::door::schema_of;
use super::error::IoError;
#[cfg(feature = "recording")]
use super::file::sha256;
use super::format;
use super::mesh;
use super::parameters;
use super::paths::{parent, similar};
use super::tree::{self, Node, Source};
use super::waiting;
use catoptric_model::limits::FAR_M;
use catoptric_model::place::Problem;
use catoptric_sim::Scene;
use catoptric_sim::build::pattern::{self, Expanded};
use catoptric_sim::check;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

/// Why a scene could not be read.
#[derive(Debug, thiserror::Error)]
pub enum SceneErrors {
    /// The file could not be read.
    #[error("cannot read {}: {source}{}", path.display(), help.as_ref().map(|h| format!("\nhelp: {h}")).unwrap_or_default())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
        /// How to fix it.
        help: Option<String>,
    },
    /// The scene is not valid.
    #[error(transparent)]
    Invalid(Box<Diagnostics>),
    /// A mesh named by the scene is missing or damaged.
    #[error("`{key}`: {source}")]
    Mesh {
        /// The key that names it.
        key: String,
        /// What is wrong with it.
        source: Box<IoError>,
    },
}

catoptric_model::closed_set! {
    /// Built-in scenes to start from: published mirror layouts with their laboratory, and one mirror without any.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub enum Template {
        /// Eight facets around the scanner, after Cooper's Figure 5.
        Prototype,
        /// Two mirrors next to a 270° scanner.
        TwoMirror,
        /// Half a hexagonal pyramid in front of the scanner.
        Pyramid,
        /// A small mirror that folds eleven beams straight down.
        Altimeter,
        /// A scanner and one mirror, without a laboratory.
        Blank,
    }
}

impl Template {
    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Prototype => "prototype",
            Self::TwoMirror => "two-mirror",
            Self::Pyramid => "pyramid",
            Self::Altimeter => "altimeter",
            Self::Blank => "blank",
        }
    }

    /// A one-line description.
    pub fn about(self) -> &'static str {
        match self {
            Self::Prototype => "Eight facets around the scanner",
            Self::TwoMirror => "Two mirrors on either side of a 270° scanner",
            Self::Pyramid => "Half a hexagonal pyramid in front of the scanner",
            Self::Altimeter => "A small mirror that folds eleven beams straight down",
            Self::Blank => "A scanner and one mirror to look at, without a laboratory",
        }
    }

    /// The commented scene, as TOML.
    pub fn text(self) -> &'static str {
        match self {
            Self::Prototype => include_str!("../../../scenes/prototype.toml"),
            Self::TwoMirror => include_str!("../../../scenes/two-mirror.toml"),
            Self::Pyramid => include_str!("../../../scenes/gallery/pyramid.toml"),
            Self::Altimeter => include_str!("../../../scenes/gallery/altimeter.toml"),
            Self::Blank => include_str!("../../../scenes/blank.toml"),
        }
    }
}

/// Reads a scene and its meshes, and changes it by `KEY=VALUE` arguments.
///
/// # Errors
/// [`SceneErrors`]: a file that cannot be read, or all problems of the scene.
pub fn load(path: &Path, sets: &[String]) -> Result<Scene, SceneErrors> {
    Ok(load_text(path, sets)?.1)
}

/// As [`load`], but returns the text of the file as well.
///
/// # Errors
/// As [`load`].
pub fn load_text(path: &Path, sets: &[String]) -> Result<(String, Scene), SceneErrors> {
    let bytes = waiting::read(path).map_err(|source| SceneErrors::Read {
        help: similar(path, &source),
        path: path.to_owned(),
        source,
    })?;
    let name = path.display().to_string();
    match String::from_utf8(bytes) {
        Ok(text) => {
            let scene = parse_in(&text, &name, parent(path), sets)?;
            Ok((text, scene))
        }
        Err(error) => {
            let valid = error.utf8_error().valid_up_to();
            let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
            let (line, column) = Lines::of(&text).position(valid);
            Err(invalid(
                &name,
                &text,
                vec![Diagnostic {
                    place: Place::Position(line, column),
                    message: "the file is not UTF-8 text".to_owned(),
                    help: None,
                }],
            ))
        }
    }
}

/// Reads a scene from text, and its meshes from a folder.
///
/// # Errors
/// As [`load`].
pub fn parse_in(text: &str, file_name: &str, folder: &Path, sets: &[String]) -> Result<Scene, SceneErrors> {
    let mut scene = parse(text, file_name, sets)?;
    read_meshes(&mut scene, folder)?;
    if scene.meshes.0.is_empty() {
        return Ok(scene);
    }
    // A mesh body is not checked without its mesh.
    let keyed = check::problems(&scene).into_iter().map(|p| Diagnostic {
        place: Place::Key(p.path.to_string()),
        message: p.message,
        help: p.help,
    });
    let keyed: Vec<Diagnostic> = keyed.collect();
    if keyed.is_empty() {
        Ok(scene)
    } else {
        Err(invalid(file_name, text, keyed))
    }
}

/// Reads the meshes named by a scene; relative names start at a folder.
///
/// # Errors
/// [`SceneErrors::Mesh`] for the first that is missing or damaged, or has a vertex beyond 10 km.
pub fn read_meshes(scene: &mut Scene, folder: &Path) -> Result<(), SceneErrors> {
    let mut meshes = std::mem::take(&mut scene.meshes);
    for (key, shape) in scene.mesh_shapes() {
        let path = folder.join(&shape.file);
        let refused = |source| SceneErrors::Mesh {
            key: key.clone(),
            source: Box::new(source),
        };
        if !meshes.0.contains_key(&shape.file) {
            let read = mesh::read_mesh(&path).map_err(refused)?;
            meshes.0.insert(shape.file.clone(), Arc::new(read));
        }
        let unit = shape.units.in_meters();
        let vertices = meshes.0[&shape.file].vertices();
        if let Some(vertex) = vertices.iter().position(|v| v.coords.amax() * unit > FAR_M) {
            let coordinate = vertices[vertex].coords.amax() * unit;
            return Err(refused(IoError::content(
                &path,
                format!("vertex {vertex} has a coordinate of {coordinate:e} m; up to 1e4 m is allowed"),
            )));
        }
    }
    scene.meshes = meshes;
    Ok(())
}

/// The scene with its meshes renamed by content, in a subfolder, and those files: what a dataset stores to
/// be reproducible. A scene from a dataset keeps its names.
#[cfg(feature = "recording")]
pub fn kept(scene: &Scene) -> (Scene, Vec<(String, Vec<u8>)>) {
    let mut scene = scene.clone();
    let mut files: Vec<(String, Vec<u8>)> = Vec::new();
    let mut kept = catoptric_sim::Meshes::default();
    let meshes = std::mem::take(&mut scene.meshes);
    for shape in scene.mesh_shapes_mut() {
        let Ok(mesh) = meshes.get(&shape.file) else {
            continue;
        };
        let bytes = mesh::to_ply(mesh);
        // Half of a SHA-256 is enough to distinguish meshes.
        shape.file = format!("meshes/{}.ply", &sha256(&bytes)[..32]);
        if kept.0.insert(shape.file.clone(), Arc::clone(mesh)).is_none() {
            files.push((shape.file.clone(), bytes));
        }
    }
    scene.meshes = kept;
    (scene, files)
}

/// Reads a scene from its text, without its meshes; a file name that ends in .json means JSON.
///
/// ```
/// use catoptric_files::scene::{self, SceneErrors};
/// let text = "schema_version = 1\nnaem = \"mine\"\n";
/// let Err(SceneErrors::Invalid(problems)) = scene::parse(text, "mine.toml", &[]) else {
///     panic!("it lacks nearly everything");
/// };
/// let typo = problems.list.iter().find(|p| p.message.contains("`naem`")).expect("it is listed");
/// assert_eq!(problems.position(typo), Some((2, 1)));
/// assert_eq!(typo.help.as_deref(), Some("did you mean `name`?"));
/// ```
///
/// # Errors
/// [`SceneErrors::Invalid`] with all problems.
pub fn parse(text: &str, file_name: &str, sets: &[String]) -> Result<Scene, SceneErrors> {
    let (file, mut list) = if is_json(file_name) {
        match tree::from_json(text) {
            Ok(node) => (node, Vec::new()),
            Err(diagnostic) => return Err(invalid(file_name, text, vec![diagnostic])),
        }
    } else {
        tree::from_toml(text)
    };
    let mut root = file.clone();
    for (number, argument) in sets.iter().enumerate() {
        if let Err(message) = tree::apply_set(&mut root, argument, number) {
            list.push(Diagnostic {
                place: Place::Set(argument.clone()),
                message,
                help: None,
            });
        }
    }
    let schema = schema();
    let faults = parameters::resolve(&mut root, text, &parameters::text_keys(schema));
    let placed = faults
        .iter()
        .map(|f| f.whole.clone())
        .filter(|s| *s != Source::Unknown);
    let flawed: Vec<Source> = placed.collect();
    let departures = departures(&root, text, schema, &list);
    // An expression without a value is reported only once.
    let departures = departures.into_iter().filter(|f| !flawed.contains(&f.source));
    list.extend(departures.map(|f| Diagnostic {
        place: place(&f.source, &f.path.to_string(), sets),
        message: f.message,
        help: f.help,
    }));
    list.extend(faults.into_iter().map(|f| Diagnostic {
        place: place(&f.part, "parameters", sets),
        message: f.message,
        help: f.help,
    }));
    if !list.is_empty() {
        return Err(invalid(file_name, text, list));
    }
    let Expanded {
        scene,
        drawn,
        made_by,
    } = match expanded(&root) {
        Ok(Ok(expanded)) => expanded,
        Ok(Err(problems)) => {
            let list = problems.into_iter().map(|p| locate(p, &root, sets, None));
            return Err(invalid(file_name, text, list.collect()));
        }
        // The schema is generated from the type, so this is a discrepancy between the two.
        Err(error) => {
            let diagnostic = Diagnostic {
                place: Place::Key(String::new()),
                message: error.to_string(),
                help: None,
            };
            return Err(invalid(file_name, text, vec![diagnostic]));
        }
    };
    let problems = check::problems(&scene);
    if problems.is_empty() {
        return Ok(scene);
    }
    let of_file = problems_without_sets(&file, text, sets, schema);
    let made = Expanded {
        scene,
        drawn,
        made_by,
    };
    let diagnostics = problems
        .into_iter()
        .map(|p| locate_copy(p, &made, &root, sets, of_file.as_ref()))
        .collect();
    Err(invalid(file_name, text, diagnostics))
}

/// Whether a file is JSON, by its name.
pub(super) fn is_json(file_name: &str) -> bool {
    let extension = Path::new(file_name).extension();
    extension.is_some_and(|e| e.eq_ignore_ascii_case("json"))
}

/// The scene of a tree, with its patterns evaluated.
fn expanded(root: &Node) -> Result<Result<Expanded, Vec<Problem>>, serde_json::Error> {
    let scene: Scene = serde_json::from_value(root.to_json())?;
    Ok(pattern::expand(&scene))
}

/// The scene as TOML, with all defaults written out; it reads back as the same scene.
///
/// # Errors
/// A number that TOML cannot represent.
pub fn to_toml(scene: &Scene) -> Result<String, toml::ser::Error> {
    toml::to_string(scene)
}

/// JSON Schema of a scene whose expressions have been evaluated.
pub fn json_schema() -> serde_json::Value {
    schema().clone()
}

/// The same, made once.
fn schema() -> &'static serde_json::Value {
    static SCHEMA: OnceLock<serde_json::Value> = OnceLock::new();
    SCHEMA.get_or_init(schema_of::<Scene>)
}

/// JSON Schema of a scene file, for editors: numbers may be expressions.
pub fn file_schema() -> serde_json::Value {
    parameters::with_expressions(json_schema())
}

/// Violations of the schema that a syntax error does not explain.
fn departures(
    root: &Node,
    text: &str,
    schema: &serde_json::Value,
    syntax: &[Diagnostic],
) -> Vec<format::Finding> {
    let lines = Lines::of(text);
    let broken_lines: BTreeSet<usize> = syntax
        .iter()
        .filter_map(|d| match &d.place {
            Place::Span(span) => Some(lines.line(span.start).0),
            _ => None,
        })
        .collect();
    let explained = |finding: &format::Finding| match &finding.source {
        Source::File(span) => {
            !broken_lines.is_empty() && (finding.missing || broken_lines.contains(&lines.line(span.start).0))
        }
        _ => false,
    };
    let findings = format::check(root, schema);
    findings.into_iter().filter(|f| !explained(f)).collect()
}

/// Messages about the file without any `--set`, each of which names its key; `None` if it cannot be interpreted on its own.
fn problems_without_sets(
    file: &Node,
    text: &str,
    sets: &[String],
    schema: &serde_json::Value,
) -> Option<BTreeSet<String>> {
    if sets.is_empty() {
        return None;
    }
    let mut file = file.clone();
    if !parameters::resolve(&mut file, text, &parameters::text_keys(schema)).is_empty() {
        return None;
    }
    let made = expanded(&file).ok()?.ok()?;
    Some(
        check::problems(&made.scene)
            .into_iter()
            .map(|p| p.message)
            .collect(),
    )
}

/// The location of a problem; problems with a copy are reported at the pattern that made it.
fn locate_copy(
    problem: Problem,
    made: &Expanded,
    root: &Node,
    sets: &[String],
    of_file: Option<&BTreeSet<String>>,
) -> Diagnostic {
    let Some((path, name)) = made.origin(&problem.path) else {
        return locate(problem, root, sets, of_file);
    };
    let copy = format!("in the copy {name:?}: ");
    let mut found = locate(problem.clone(), root, sets, of_file);
    if !matches!(found.place, Place::Set(_)) {
        found.place = place(&root.nearest(&path).source, &path.to_string(), sets);
    }
    found.message.insert_str(0, &copy);
    found
}

/// The location of a problem: the `--set` that caused it, otherwise the position of the value.
fn locate(problem: Problem, root: &Node, sets: &[String], of_file: Option<&BTreeSet<String>>) -> Diagnostic {
    let node = root.nearest(&problem.path);
    let in_file = of_file.is_some_and(|messages| messages.contains(&problem.message));
    let set = match (node.set_within(), sets) {
        _ if in_file => None,
        (Some(number), _) => Some(number),
        // The file does not have this problem, so the only argument caused it.
        (None, [_]) if of_file.is_some() => Some(0),
        (None, _) => None,
    };
    let source = set.map_or(node.source.clone(), Source::Set);
    Diagnostic {
        place: place(&source, &problem.path.to_string(), sets),
        message: problem.message,
        help: problem.help,
    }
}

fn place(source: &Source, key: &str, sets: &[String]) -> Place {
    match source {
        Source::File(span) => Place::Span(span.clone()),
        Source::Set(number) => Place::Set(sets[*number].clone()),
        Source::Unknown => Place::Key(key.to_owned()),
    }
}

fn invalid(file: &str, text: &str, mut list: Vec<Diagnostic>) -> SceneErrors {
    list.sort_by_key(|d| match &d.place {
        Place::Span(span) => (0, span.start),
        Place::Position(line, _) => (0, *line),
        Place::Key(_) => (1, 0),
        Place::Set(_) => (2, 0),
    });
    SceneErrors::Invalid(Box::new(Diagnostics {
        file: file.to_owned(),
        text: text.to_owned(),
        list,
    }))
}
