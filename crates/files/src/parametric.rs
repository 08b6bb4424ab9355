//! A scene file with free parameters: one scene for each choice of them.
//!
//! The file is read once; a choice of parameters evaluates its expressions again, and everything is checked as if the
//! values were in the file.

use super::scene::{self, SceneErrors};
use super::tree::{self, Node, Source, Value};
use super::waiting;
use super::{format, parameters};
use catoptric_model::place::{Problem, Segment};
use catoptric_sim::build::pattern;
use catoptric_sim::scene::Parameter;
use catoptric_sim::{Scene, check};
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::Path;

/// A scene file with free parameters.
#[derive(Debug)]
pub struct ParametricScene {
    text: String,
    name: String,
    /// The tree as written, changed by `--set`.
    root: Node,
    /// Whether numbers can be replaced in the file's own text.
    is_text: bool,
    schema: serde_json::Value,
    texts: BTreeSet<String>,
    scene: Scene,
}

/// Parameters and the values chosen for them.
pub type Choice<'a> = &'a [(&'a str, f64)];

impl ParametricScene {
    /// Reads a scene file, and changes it by `KEY=VALUE` arguments.
    ///
    /// # Errors
    /// As [`scene::load`].
    pub fn load(path: &Path, sets: &[String]) -> Result<Self, SceneErrors> {
        let scene = scene::load(path, sets)?;
        let text = waiting::read_text(path).map_err(|source| SceneErrors::Read {
            path: path.to_owned(),
            source,
            help: None,
        })?;
        Self::new(text, &path.display().to_string(), sets, scene)
    }

    /// The same from the text of a file that names no meshes.
    ///
    /// ```
    /// use catoptric_files::parametric::ParametricScene;
    /// let text = include_str!("../../../scenes/prototype-parametric.toml");
    /// let template = ParametricScene::parse(text, "prototype-parametric.toml", &[])?;
    /// let narrower = template.with(&[("gap_deg", 1.0)]).expect("it is within its limits");
    /// assert_eq!(narrower.parameters["second_deg"].value, 78.0);
    /// assert!(template.with(&[("gap_deg", 9.0)]).is_err());
    /// # Ok::<(), catoptric_files::scene::SceneErrors>(())
    /// ```
    ///
    /// # Errors
    /// As [`scene::parse`].
    pub fn parse(text: &str, file_name: &str, sets: &[String]) -> Result<Self, SceneErrors> {
        let scene = scene::parse(text, file_name, sets)?;
        Self::new(text.to_owned(), file_name, sets, scene)
    }

    /// The same from a scene already read from this text with these settings.
    ///
    /// # Errors
    /// None, if the scene is the one the text gives.
    pub fn of(text: &str, name: &str, sets: &[String], scene: &Scene) -> Result<Self, SceneErrors> {
        Self::new(text.to_owned(), name, sets, scene.clone())
    }

    fn new(text: String, name: &str, sets: &[String], scene: Scene) -> Result<Self, SceneErrors> {
        let is_toml = !scene::is_json(name);
        // The scene was read from the same text, so this cannot fail.
        let mut root = if is_toml {
            tree::from_toml(&text).0
        } else {
            tree::from_json(&text).unwrap_or_else(|_| tree::from_toml("").0)
        };
        for (number, argument) in sets.iter().enumerate() {
            let applied = tree::apply_set(&mut root, argument, number);
            debug_assert!(applied.is_ok());
        }
        let schema = scene::json_schema();
        let texts = parameters::text_keys(&schema);
        let is_text = is_toml && sets.is_empty() && scene.meshes.0.is_empty();
        Ok(Self {
            text,
            name: name.to_owned(),
            root,
            is_text,
            schema,
            texts,
            scene,
        })
    }

    /// The scene as the file has it.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The file's name as given.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Parameters with both limits, in the order of their names.
    pub fn open(&self) -> Vec<(&str, Parameter, [f64; 2])> {
        let all = self.scene.parameters.iter();
        all.filter_map(|(name, p)| Some((name.as_str(), *p, [p.low?, p.high?])))
            .filter(|(name, ..)| self.number_span_or_set(name))
            .collect()
    }

    /// The scene with other values for some parameters.
    ///
    /// # Errors
    /// All problems of that scene.
    pub fn with(&self, choice: Choice<'_>) -> Result<Scene, Vec<String>> {
        let mut root = self.root.clone();
        for (name, number) in choice {
            let Some(value) = value_mut(&mut root, name) else {
                return Err(vec![format!("the scene has no parameter `{name}`")]);
            };
            value.value = Value::Float(*number);
        }
        let faults = parameters::resolve(&mut root, &self.text, &self.texts);
        if !faults.is_empty() {
            return Err(faults.into_iter().map(|f| f.message).collect());
        }
        let findings = format::check(&root, &self.schema);
        if !findings.is_empty() {
            return Err(findings.into_iter().map(|f| f.message).collect());
        }
        let written: Scene = serde_json::from_value(root.to_json()).map_err(|e| vec![e.to_string()])?;
        let mut scene = pattern::expand(&written).map_err(messages)?.scene;
        scene.meshes = self.scene.meshes.clone();
        let problems = check::problems(&scene);
        if problems.is_empty() {
            Ok(scene)
        } else {
            Err(messages(problems))
        }
    }

    /// A scene file with other values: the file itself with its comments and expressions, if nothing but those values
    /// differs; otherwise with everything evaluated. `None` if it cannot be written, or does not give this scene.
    pub fn text_with(&self, choice: Choice<'_>, scene: &Scene) -> Option<String> {
        let text = if self.is_text {
            self.substituted(choice)
        } else {
            None
        };
        let same = |text: &String| scene::parse(text, "scene.toml", &[]).is_ok_and(|read| read == *scene);
        text.filter(same).or_else(|| scene::to_toml(scene).ok())
    }

    fn substituted(&self, choice: Choice<'_>) -> Option<String> {
        let spans = choice
            .iter()
            .map(|(name, number)| Some((self.span(name)?, *number)));
        let mut spans = spans.collect::<Option<Vec<(Range<usize>, f64)>>>()?;
        // From the end, so that earlier positions remain valid.
        spans.sort_by_key(|(span, _)| std::cmp::Reverse(span.start));
        let mut text = self.text.clone();
        for (span, number) in spans {
            text.replace_range(span, &number.to_string());
        }
        Some(text)
    }

    fn span(&self, name: &str) -> Option<Range<usize>> {
        match &value_of(&self.root, name)?.source {
            Source::File(span) => Some(span.clone()),
            _ => None,
        }
    }

    /// Whether a parameter is independent: one that follows from others cannot be chosen.
    fn number_span_or_set(&self, name: &str) -> bool {
        value_of(&self.root, name).is_some_and(|n| n.value.number().is_some())
    }
}

fn messages(problems: Vec<Problem>) -> Vec<String> {
    problems.into_iter().map(|p| p.message).collect()
}

/// Position of the number of a parameter in the file.
fn value_of<'a>(root: &'a Node, name: &str) -> Option<&'a Node> {
    let key = |k: &str| Segment::Key(k.to_owned());
    let entry = root.child(&key("parameters"))?.child(&key(name))?;
    match &entry.value {
        Value::Table(_) => entry.child(&key("value")),
        _ => Some(entry),
    }
}

fn value_mut<'a>(root: &'a mut Node, name: &str) -> Option<&'a mut Node> {
    let entry = field_mut(field_mut(root, "parameters")?, name)?;
    if matches!(entry.value, Value::Table(_)) {
        field_mut(entry, "value")
    } else {
        Some(entry)
    }
}

fn field_mut<'a>(node: &'a mut Node, name: &str) -> Option<&'a mut Node> {
    match &mut node.value {
        Value::Table(entries) => entries.iter_mut().find(|(k, _)| k.name == name).map(|(_, n)| n),
        _ => None,
    }
}
