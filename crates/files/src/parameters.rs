//! Parameters and expressions of a scene, evaluated before any other check.
//!
//! Text that begins with `=` in place of a number is an expression over the names in `[parameters]`; parameters may
//! depend on one another.

use super::diagnostic::MOST_SHOWN;
use super::expression::{Flaw, NoValue, evaluate, is_name};
use super::tree::{Key, Node, Source, Value};
use catoptric_model::place::nearest;
use serde_json::Value as Json;
use std::collections::{BTreeMap, BTreeSet};

/// Maximum number of parameters that depend on one another in a row.
const LONGEST_CHAIN: usize = 64;

/// Maximum number of names listed in a message.
const MOST_LISTED: usize = 20;

/// An error in a parameter or an expression.
#[derive(Debug)]
pub(super) struct Fault {
    /// The value that contains it.
    pub(super) whole: Source,
    /// The faulty part of it.
    pub(super) part: Source,
    /// What was found and what is needed.
    pub(super) message: String,
    /// How to fix it.
    pub(super) help: Option<String>,
}

/// Replaces every expression by a number; `text` is the file, for positions in it, `texts` the
/// [`text_keys`].
pub(super) fn resolve(root: &mut Node, text: &str, texts: &BTreeSet<String>) -> Vec<Fault> {
    let mut faults = Vec::new();
    let definitions = definitions(root, &mut faults);
    let mut values = Values {
        definitions: &definitions,
        known: BTreeMap::new(),
        open: 0,
        unknown: 0,
    };
    walk(root, "", text, texts, &mut values, &mut faults);
    faults
}

/// Expands parameters given as a bare number or expression, which are short for their value.
fn definitions(root: &mut Node, faults: &mut Vec<Fault>) -> BTreeMap<String, Value> {
    let Value::Table(entries) = &mut root.value else {
        return BTreeMap::new();
    };
    let parameters = entries.iter_mut().find(|(k, _)| k.name == "parameters");
    let Some(Value::Table(parameters)) = parameters.map(|(_, n)| &mut n.value) else {
        return BTreeMap::new();
    };
    let mut found = BTreeMap::new();
    for (key, node) in parameters {
        if !is_name(&key.name) {
            faults.push(Fault {
                whole: key.source.clone(),
                part: key.source.clone(),
                message: format!("the parameter `{}` cannot be used in an expression", key.name),
                help: Some("letters, digits and _ make a name, no digit first".to_owned()),
            });
        }
        if matches!(node.value, Value::Integer(_) | Value::Float(_) | Value::String(_)) {
            let value = Key {
                source: node.source.clone(),
                name: "value".to_owned(),
            };
            node.value = Value::Table(vec![(value, node.clone())]);
        }
        if let Value::Table(fields) = &node.value
            && let Some((_, value)) = fields.iter().find(|(k, _)| k.name == "value")
        {
            found.insert(key.name.clone(), value.value.clone());
        }
    }
    found
}

/// Values of the parameters evaluated so far.
struct Values<'a> {
    definitions: &'a BTreeMap<String, Value>,
    /// `None` while it is being evaluated.
    known: BTreeMap<String, Option<f64>>,
    /// How many are being evaluated.
    open: usize,
    /// How many names were no parameter.
    unknown: usize,
}

impl Values<'_> {
    fn of(&mut self, name: &str) -> Result<f64, NoValue> {
        let none = |message: String, help: Option<String>| Err(NoValue { message, help });
        match self.known.get(name) {
            Some(Some(value)) => return Ok(*value),
            Some(None) => {
                return none(format!("is circular: `{name}` depends on itself"), None);
            }
            None => {}
        }
        let Some(definition) = self.definitions.get(name) else {
            let message = format!("names `{name}`, which is no parameter");
            // Many unknown names among many parameters would take a minute to compare.
            if self.unknown > MOST_SHOWN {
                return none(message, None);
            }
            self.unknown += 1;
            let names = self.definitions.keys().map(String::as_str);
            let help = match (nearest(name, names.clone()), self.definitions.is_empty()) {
                (Some(near), _) => format!("did you mean `{near}`?"),
                (None, true) => "the scene has no [parameters]".to_owned(),
                (None, false) => {
                    let more = if names.len() > MOST_LISTED { ", …" } else { "" };
                    let first: Vec<&str> = names.take(MOST_LISTED).collect();
                    format!("parameters: {}{more}", first.join(", "))
                }
            };
            return none(message, Some(help));
        };
        if self.open == LONGEST_CHAIN {
            return none(
                format!("depends on more than {LONGEST_CHAIN} parameters in a row"),
                None,
            );
        }
        let value = match definition {
            Value::String(text) => {
                let Some(expression) = expression(text) else {
                    return none(format!("names `{name}`, which has no value"), None);
                };
                self.known.insert(name.to_owned(), None);
                self.open += 1;
                let value = evaluate(expression, &mut |n| self.of(n));
                self.open -= 1;
                self.known.remove(name);
                value.map_err(|flaw| NoValue {
                    message: format!("names `{name}`, which {}", flaw.message),
                    help: flaw.help,
                })?
            }
            other => match other.number() {
                Some(number) => number,
                None => return none(format!("names `{name}`, which has no value"), None),
            },
        };
        self.known.insert(name.to_owned(), Some(value));
        Ok(value)
    }
}

/// The text after the `=`.
fn expression(text: &str) -> Option<&str> {
    text.trim_start().strip_prefix('=')
}

fn walk(
    node: &mut Node,
    key: &str,
    text: &str,
    texts: &BTreeSet<String>,
    values: &mut Values<'_>,
    faults: &mut Vec<Fault>,
) {
    match &mut node.value {
        Value::Table(entries) => {
            for (key, child) in entries {
                walk(child, &key.name, text, texts, values, faults);
            }
        }
        Value::Array(items) => {
            for item in items {
                walk(item, key, text, texts, values, faults);
            }
        }
        Value::String(written) if !texts.contains(key) => {
            let Some(own) = expression(written) else { return };
            match evaluate(own, &mut |name| values.of(name)) {
                Ok(value) => node.value = number(value),
                Err(flaw) => faults.push(fault(node.source.clone(), written, own, flaw, text)),
            }
        }
        _ => {}
    }
}

/// Integers stay integers, for keys that count.
fn number(value: f64) -> Value {
    // The range in which every integer is exact.
    if value.fract() == 0.0 && value.abs() < 9e15 {
        #[allow(clippy::cast_possible_truncation)]
        return Value::Integer(value as i128);
    }
    Value::Float(value)
}

fn fault(whole: Source, written: &str, own: &str, flaw: Flaw, text: &str) -> Fault {
    let skipped = written.len() - own.len();
    let part = match &whole {
        // Without escapes, a position in the text is a position in the file.
        Source::File(span) if text.get(span.start + 1..span.end.saturating_sub(1)) == Some(written) => {
            let start = span.start + 1 + skipped + flaw.at;
            Source::File(start..start + flaw.length.max(1))
        }
        other => other.clone(),
    };
    Fault {
        whole,
        part,
        message: format!("the expression {:?} {}", own.trim(), flaw.message),
        help: flaw.help,
    }
}

/// Keys that hold text everywhere in the schema; their values are never expressions.
pub(super) fn text_keys(schema: &Json) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    collect_text_keys(schema, &mut found);
    found
}

fn collect_text_keys(schema: &Json, found: &mut BTreeSet<String>) {
    match schema {
        Json::Object(fields) => {
            let properties = fields.get("properties").and_then(Json::as_object);
            for (name, own) in properties.into_iter().flatten() {
                if holds_text(own) || own.get("items").is_some_and(holds_text) {
                    found.insert(name.clone());
                }
            }
            fields.values().for_each(|own| collect_text_keys(own, found));
        }
        Json::Array(items) => items.iter().for_each(|own| collect_text_keys(own, found)),
        _ => {}
    }
}

fn holds_text(schema: &Json) -> bool {
    match schema.get("type") {
        Some(Json::String(kind)) => kind == "string",
        Some(Json::Array(kinds)) => kinds.iter().any(|k| k == "string"),
        _ => false,
    }
}

/// The schema for editors: numbers may be expressions, and a parameter just a number.
pub(super) fn with_expressions(mut schema: Json) -> Json {
    open_numbers(&mut schema);
    let parameter = schema.pointer_mut("/$defs/Parameter");
    if let Some(parameter) = parameter {
        let table = parameter.take();
        let description = table.get("description").cloned().unwrap_or_default();
        let limit = |name: &str| {
            table
                .pointer(&format!("/properties/value/{name}"))
                .cloned()
                .unwrap_or_default()
        };
        let (least, greatest) = (limit("minimum"), limit("maximum"));
        *parameter = serde_json::json!({
            "description": description,
            "anyOf": [
                {
                    "type": ["number", "string"], "pattern": PATTERN, "minimum": least, "maximum": greatest,
                },
                table,
            ],
        });
    }
    schema
}

/// Pattern of an expression.
const PATTERN: &str = "^\\s*=";

fn open_numbers(schema: &mut Json) {
    match schema {
        Json::Object(fields) => {
            let is_number = |k: &Json| k == "number" || k == "integer";
            match fields.get_mut("type") {
                Some(Json::Array(kinds)) if kinds.iter().any(is_number) => {
                    kinds.push("string".into());
                    fields.insert("pattern".to_owned(), PATTERN.into());
                }
                Some(kind) if is_number(kind) => {
                    *kind = Json::Array(vec![kind.clone(), "string".into()]);
                    fields.insert("pattern".to_owned(), PATTERN.into());
                }
                _ => {}
            }
            fields.values_mut().for_each(open_numbers);
        }
        Json::Array(items) => items.iter_mut().for_each(open_numbers),
        _ => {}
    }
}
