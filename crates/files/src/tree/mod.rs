//! A file as a tree of values with their positions, before conversion to a typed value.

mod json;
#[cfg(feature = "scene")]
mod set;
mod toml;

use catoptric_model::place::{KeyPath, Segment};
use std::ops::Range;

pub(super) use self::json::from_json;
#[cfg(feature = "scene")]
pub(super) use self::set::apply_set;
pub(super) use self::toml::from_toml;

/// Position of a value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Source {
    /// Byte range in the file.
    File(Range<usize>),
    /// The `--set` with this index.
    Set(usize),
    /// In a format without positions.
    Unknown,
}

/// A value and its position.
#[derive(Debug, Clone)]
pub(crate) struct Node {
    pub(crate) source: Source,
    pub(crate) value: Value,
}

/// A key of a table and its position.
#[derive(Debug, Clone)]
pub(crate) struct Key {
    pub(crate) source: Source,
    pub(crate) name: String,
}

/// A value of any type.
#[derive(Debug, Clone)]
pub(crate) enum Value {
    Null,
    Boolean(bool),
    Integer(i128),
    Float(f64),
    String(String),
    Datetime,
    Array(Vec<Node>),
    Table(Vec<(Key, Node)>),
}

impl Value {
    /// A description for messages.
    pub(crate) fn describe(&self) -> String {
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

    /// As a number, integer or not.
    pub(crate) fn number(&self) -> Option<f64> {
        match self {
            Self::Integer(i) => Some(*i as f64),
            Self::Float(f) => Some(*f),
            _ => None,
        }
    }
}

impl Node {
    pub(crate) fn child(&self, segment: &Segment) -> Option<&Node> {
        match (&self.value, segment) {
            (Value::Table(entries), Segment::Key(name)) => {
                entries.iter().find(|(k, _)| k.name == *name).map(|(_, n)| n)
            }
            (Value::Array(items), Segment::Index(index)) => items.get(*index),
            _ => None,
        }
    }

    /// The value at a path, or the last value along that path that was written down.
    pub(crate) fn nearest(&self, path: &KeyPath) -> &Node {
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
    pub(crate) fn set_within(&self) -> Option<usize> {
        if let Source::Set(number) = self.source {
            return Some(number);
        }
        match &self.value {
            Value::Table(entries) => entries.iter().find_map(|(_, n)| n.set_within()),
            Value::Array(items) => items.iter().find_map(Node::set_within),
            _ => None,
        }
    }

    /// Without positions, for serde.
    pub(crate) fn to_json(&self) -> serde_json::Value {
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
