//! JSON as a tree: without positions, because its reader keeps none.

use super::super::diagnostic::{Diagnostic, Place};
use super::{Key, Node, Source, Value};
use serde::de::{Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;

/// Reads JSON; a duplicate key is an error, as in TOML.
pub(crate) fn from_json(text: &str) -> Result<Node, Diagnostic> {
    serde_json::from_str(text).map_err(|e| {
        let message = e.to_string();
        // The position is split from the message.
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
