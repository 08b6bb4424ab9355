//! Validation of a tree of values against the JSON Schema of its type: reports every violation, not only the first.

mod choice;
mod number;
mod table;
mod units;

use super::tree::{Node, Source, Value};
use catoptric_model::place::{KeyPath, Segment};
use serde_json::Value as Json;

/// A violation of the schema.
#[derive(Debug)]
pub(super) struct Finding {
    pub(super) source: Source,
    pub(super) path: KeyPath,
    pub(super) message: String,
    pub(super) help: Option<String>,
    /// Whether something is missing, as much is after a syntax error.
    pub(super) missing: bool,
}

/// Returns every violation of a schema by a tree.
pub(super) fn check(root: &Node, schema: &Json) -> Vec<Finding> {
    let mut walk = Walk {
        schema,
        found: Vec::new(),
    };
    walk.value(root, schema, &KeyPath::default());
    walk.found
}

struct Walk<'a> {
    schema: &'a Json,
    found: Vec<Finding>,
}

impl<'a> Walk<'a> {
    fn add(&mut self, source: &Source, path: &KeyPath, message: String, help: Option<String>) {
        self.found.push(Finding {
            source: source.clone(),
            path: path.clone(),
            message,
            help,
            missing: false,
        });
    }

    fn resolve(&self, schema: &'a Json) -> Option<&'a Json> {
        let pointer = schema.get("$ref")?.as_str()?.strip_prefix('#')?;
        self.schema.pointer(pointer)
    }

    fn value(&mut self, node: &Node, schema: &'a Json, path: &KeyPath) {
        if let Some(target) = self.resolve(schema) {
            self.value(node, target, path);
        }
        if let Some(alternatives) = schema.get("anyOf").and_then(Json::as_array) {
            // An optional value: its own schema, or null.
            let is_null = |s: &Json| s.get("type").is_some_and(|t| t == "null");
            let own = alternatives.iter().find(|s| !is_null(s));
            if let (Some(own), false) = (own, matches!(node.value, Value::Null)) {
                self.value(node, own, path);
            }
        }
        if let Some(variants) = schema.get("oneOf").and_then(Json::as_array) {
            self.variant(node, variants, path);
        }
        if let Some(words) = schema.get("enum").and_then(Json::as_array) {
            let words: Vec<&str> = words.iter().filter_map(Json::as_str).collect();
            self.word(node, &words, path);
        }
        match schema.get("type") {
            Some(Json::String(kind)) => self.typed(node, kind, schema, path),
            Some(Json::Array(kinds)) => {
                let own = kinds.iter().filter_map(Json::as_str).find(|k| *k != "null");
                if let (Some(own), false) = (own, matches!(node.value, Value::Null)) {
                    self.typed(node, own, schema, path);
                }
            }
            _ => {}
        }
    }

    fn typed(&mut self, node: &Node, kind: &str, schema: &'a Json, path: &KeyPath) {
        match (kind, &node.value) {
            // The word itself is examined together with the list of words.
            ("string", Value::String(_)) | ("boolean", Value::Boolean(_)) => {}
            ("string", _) if schema.get("enum").is_some() => {}
            ("integer", Value::Integer(i)) => self.integer(node, *i, schema, path),
            ("number", Value::Integer(_) | Value::Float(_)) => self.number(node, schema, path),
            ("array", Value::Array(items)) => self.list(node, items, schema, path),
            ("object", Value::Table(_)) => self.table(node, schema, path),
            (_, Value::Float(f)) if !f.is_finite() => self.not_finite(node, path),
            _ => self.wrong_type(node, kind, schema, path),
        }
    }

    fn wrong_type(&mut self, node: &Node, kind: &str, schema: &Json, path: &KeyPath) {
        let needed = match kind {
            "string" => "a string",
            "boolean" => "true or false",
            "integer" => "a whole number",
            "number" => "a number",
            "array" => "a list",
            _ => "a table",
        };
        let help = match (kind, &node.value) {
            ("number" | "integer", Value::String(s)) => leading_number(s)
                .map(|number| format!("write {number} without quotes; the unit is in the name of the key")),
            ("string", Value::Integer(_) | Value::Float(_) | Value::Boolean(_)) => {
                Some("write it in quotes".to_owned())
            }
            ("integer", Value::Float(f)) if f.fract() == 0.0 => Some(format!("write {f}")),
            ("array", Value::Table(_)) => Some(format!(
                "write [[{path}]] with two brackets: there may be several"
            ))
            .filter(|_| !path.0.iter().any(|s| matches!(s, Segment::Index(_)))),
            ("array", Value::Integer(_) | Value::Float(_)) => {
                let count = schema.get("minItems").and_then(Json::as_u64);
                count.map(|n| format!("write {n} numbers in brackets"))
            }
            ("object", Value::Array(_)) => {
                Some(format!("write [{path}] with one bracket: there is only one"))
                    .filter(|_| !path.0.iter().any(|s| matches!(s, Segment::Index(_))))
            }
            _ => None,
        };
        let message = format!("`{path}` is {}; {needed} is needed", node.value.describe());
        self.add(&node.source, path, message, help);
    }
}

/// The number at the beginning of "45 deg" or "45°".
fn leading_number(text: &str) -> Option<&str> {
    let text = text.trim();
    let end = text
        .find(|c: char| !(c.is_ascii_digit() || "+-.eE".contains(c)))
        .unwrap_or(text.len());
    let number = text[..end].trim_end_matches(['e', 'E']);
    number.parse::<f64>().ok().map(|_| number)
}
