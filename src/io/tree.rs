//! A file as a tree of values that know where they were written, before it becomes a typed value.

use super::diagnostic::{Diagnostic, Place};
use catoptric_sim::check::{Path, Segment};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    /// Bytes of the file.
    File(Range<usize>),
    /// The `--set` of that number.
    Set(usize),
    /// In a format that keeps no positions.
    Unknown,
}

/// A value and its place.
#[derive(Debug, Clone)]
pub(super) struct Node {
    pub(super) source: Source,
    pub(super) value: Value,
}

/// A key of a table and its place.
#[derive(Debug, Clone)]
pub(super) struct Key {
    pub(super) source: Source,
    pub(super) name: String,
}

/// A value of any type.
#[derive(Debug, Clone)]
pub(super) enum Value {
    Null,
    Boolean(bool),
    Integer(i128),
    Float(f64),
    String(String),
    Datetime,
    Array(Vec<Node>),
    Table(Vec<(Key, Node)>),
}

/// Reads TOML; what can still be read after a syntax error is read.
pub(super) fn from_toml(text: &str) -> (Node, Vec<Diagnostic>) {
    let (root, errors) = DeTable::parse_recoverable(text);
    let diagnostics = errors.iter().map(|e| {
        let span = e.span().unwrap_or(text.len()..text.len());
        let message = match text.get(span.clone()) {
            Some(key) if e.message() == "duplicate key" => format!("duplicate key `{key}`"),
            _ => e.message().to_owned(),
        };
        Diagnostic {
            place: Place::Span(span),
            message,
            help: None,
        }
    });
    let at = |span: Range<usize>| Source::File(span);
    // The outermost table is reported without a span; it begins where the file does.
    let value = table(root.get_ref(), &at);
    let source = Source::File(0..0);
    (Node { source, value }, diagnostics.collect())
}

/// Reads JSON; a key that is given twice is an error, as in TOML.
pub(super) fn from_json(text: &str) -> Result<Node, Diagnostic> {
    serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        // The position is told apart from the message.
        let message = message
            .split_once(" at line ")
            .map_or(message.as_str(), |(m, _)| m);
        Diagnostic {
            place: Place::Position(e.line().max(1), e.column().max(1)),
            message: message.to_owned(),
            help: None,
        }
    })
}

fn node(spanned: &Spanned<DeValue<'_>>, at: &impl Fn(Range<usize>) -> Source) -> Node {
    let value = match spanned.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => match i128::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Value::Integer(i),
            // Beyond 128 bits it is out of every range anyway.
            Err(_) => Value::Float(f64::INFINITY),
        },
        DeValue::Float(f) => Value::Float(f.as_str().parse().unwrap_or(f64::NAN)),
        DeValue::Boolean(b) => Value::Boolean(*b),
        DeValue::Datetime(_) => Value::Datetime,
        DeValue::Array(items) => Value::Array(items.iter().map(|item| node(item, at)).collect()),
        DeValue::Table(entries) => table(entries, at),
    };
    Node {
        source: at(spanned.span()),
        value,
    }
}

fn table(entries: &DeTable<'_>, at: &impl Fn(Range<usize>) -> Source) -> Value {
    let entry = |(key, value): (&Spanned<_>, &Spanned<DeValue<'_>>)| {
        let key = Key {
            source: at(key.span()),
            name: AsRef::<str>::as_ref(key.get_ref()).to_owned(),
        };
        (key, node(value, at))
    };
    Value::Table(entries.iter().map(entry).collect())
}

/// Applies the `--set` of that number: `superstructure.facet.0.name=left`, `board[1].width_mm=500`.
pub(super) fn apply_set(root: &mut Node, argument: &str, number: usize) -> Result<(), String> {
    let source = Source::Set(number);
    let (path, text) = argument
        .split_once('=')
        .ok_or("has no `=`; write it as KEY=VALUE")?;
    let steps = split_path(path.trim())?;
    let value = Node {
        source: source.clone(),
        value: set_value(text.trim(), &source)?,
    };
    let mut at = root;
    for (i, step) in steps.iter().enumerate() {
        let so_far = if i == 0 {
            "the scene".to_owned()
        } else {
            format!("`{}`", steps[..i].join("."))
        };
        at = match &mut at.value {
            Value::Table(entries) => {
                let found = entries.iter().position(|(k, _)| k.name == *step);
                if found.is_none() && step.parse::<usize>().is_ok() {
                    return Err(format!(
                        "{so_far} has no entries in the scene; there is no {step}"
                    ));
                }
                let index = found.unwrap_or_else(|| {
                    // Tables that the file leaves to their defaults come into being here.
                    let key = Key {
                        source: source.clone(),
                        name: step.clone(),
                    };
                    let empty = Node {
                        source: source.clone(),
                        value: Value::Table(Vec::new()),
                    };
                    entries.push((key, empty));
                    entries.len() - 1
                });
                &mut entries[index].1
            }
            Value::Array(items) => {
                let count = items.len();
                let last = count.saturating_sub(1);
                let index: usize = step
                    .parse()
                    .map_err(|_| format!("{so_far} is a list; `{step}` must be a number from 0 to {last}"))?;
                items.get_mut(index).ok_or_else(|| {
                    format!("{so_far} has {count} entries, numbered from 0 to {last}; there is no {index}")
                })?
            }
            other => return Err(format!("{so_far} is {}; it has no keys", other.describe())),
        };
    }
    *at = value;
    Ok(())
}

fn split_path(path: &str) -> Result<Vec<String>, String> {
    let path = path.replace('[', ".").replace(']', "");
    let steps: Vec<String> = path.split('.').map(|s| s.trim().to_owned()).collect();
    if steps.iter().any(String::is_empty) {
        return Err(
            "has an empty key; write it as TABLE.KEY=VALUE, TABLE.0.KEY=VALUE or TABLE[0].KEY=VALUE".into(),
        );
    }
    Ok(steps)
}

/// A TOML value; a bare word is a string.
fn set_value(text: &str, source: &Source) -> Result<Value, String> {
    match DeValue::parse(text) {
        Ok(value) => Ok(node(&value, &|_| source.clone()).value),
        Err(error) if text.starts_with(['[', '{', '"', '\'']) => {
            Err(format!("the value is not TOML: {}", error.message()))
        }
        Err(_) => Ok(Value::String(text.to_owned())),
    }
}

impl Value {
    /// What it is, for a message.
    pub(super) fn describe(&self) -> String {
        match self {
            Self::Null => "null".to_owned(),
            Self::Boolean(b) => format!("the boolean {b}"),
            Self::Integer(i) => i.to_string(),
            Self::Float(f) => format!("{f:?}"),
            Self::String(s) => format!("the string {s:?}"),
            Self::Datetime => "a date".to_owned(),
            Self::Array(_) => "a list".to_owned(),
            Self::Table(_) => "a table".to_owned(),
        }
    }

    /// As a number, whole or not.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(i) => Some(*i as f64),
            Self::Float(f) => Some(*f),
            _ => None,
        }
    }
}

impl Node {
    fn child(&self, segment: &Segment) -> Option<&Node> {
        match (&self.value, segment) {
            (Value::Table(entries), Segment::Key(name)) => {
                entries.iter().find(|(k, _)| k.name == *name).map(|(_, n)| n)
            }
            (Value::Array(items), Segment::Index(index)) => items.get(*index),
            _ => None,
        }
    }

    /// The value at a path, or the last one on the way to it that was written down.
    pub(super) fn nearest(&self, path: &Path) -> &Node {
        let mut at = self;
        for segment in &path.0 {
            match at.child(segment) {
                Some(child) => at = child,
                None => break,
            }
        }
        at
    }

    /// The `--set` that this value, or a part of it, comes from.
    pub(super) fn set_within(&self) -> Option<usize> {
        if let Source::Set(number) = self.source {
            return Some(number);
        }
        match &self.value {
            Value::Table(entries) => entries.iter().find_map(|(_, n)| n.set_within()),
            Value::Array(items) => items.iter().find_map(Node::set_within),
            _ => None,
        }
    }

    /// Without places, for serde.
    pub(super) fn to_json(&self) -> serde_json::Value {
        use serde_json::Value as Json;
        match &self.value {
            Value::Null | Value::Datetime => Json::Null,
            Value::Boolean(b) => (*b).into(),
            Value::Integer(i) => {
                let small = u64::try_from(*i).map(Json::from);
                small
                    .or_else(|_| i64::try_from(*i).map(Json::from))
                    .unwrap_or_else(|_| (*i as f64).into())
            }
            Value::Float(f) => (*f).into(),
            Value::String(s) => s.as_str().into(),
            Value::Array(items) => items.iter().map(Node::to_json).collect(),
            Value::Table(entries) => entries
                .iter()
                .map(|(k, n)| (k.name.clone(), n.to_json()))
                .collect(),
        }
    }
}

impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = deserializer.deserialize_any(AnyValue)?;
        Ok(Self {
            source: Source::Unknown,
            value,
        })
    }
}

struct AnyValue;

impl<'de> Visitor<'de> for AnyValue {
    type Value = Value;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, b: bool) -> Result<Value, E> {
        Ok(Value::Boolean(b))
    }

    fn visit_i64<E>(self, i: i64) -> Result<Value, E> {
        Ok(Value::Integer(i.into()))
    }

    fn visit_u64<E>(self, i: u64) -> Result<Value, E> {
        Ok(Value::Integer(i.into()))
    }

    fn visit_f64<E>(self, f: f64) -> Result<Value, E> {
        Ok(Value::Float(f))
    }

    fn visit_str<E>(self, s: &str) -> Result<Value, E> {
        Ok(Value::String(s.to_owned()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Value, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Value::Array(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Value, A::Error> {
        let mut entries: Vec<(Key, Node)> = Vec::new();
        while let Some(name) = map.next_key::<String>()? {
            if entries.iter().any(|(k, _)| k.name == name) {
                return Err(serde::de::Error::custom(format_args!("duplicate key `{name}`")));
            }
            let key = Key {
                source: Source::Unknown,
                name,
            };
            entries.push((key, map.next_value()?));
        }
        Ok(Value::Table(entries))
    }
}
