//! JSON as a tree. The reader keeps no positions, but lends every value's text: its place in the file is its position.

use super::super::diagnostic::{Diagnostic, Place};
use super::super::json::{no_number, position_of};
use super::{Key, Node, Source, Value};
use serde::de::{Deserializer, MapAccess, SeqAccess, Visitor};
use serde_json::value::RawValue;
use std::collections::BTreeSet;
use std::fmt;

/// Maximum nesting: every level is read once more for the positions in it, and no file of ours has ten.
const DEEPEST: usize = 32;

/// Reads JSON; a duplicate key is an error, as in TOML.
pub(crate) fn from_json(text: &str) -> Result<Node, Diagnostic> {
    let whole: &RawValue = serde_json::from_str(text).map_err(|e| Diagnostic {
        place: Place::Position(e.line().max(1), e.column().max(1)),
        message: no_number(text.as_bytes(), &e).unwrap_or_else(|| without_place(&e)),
        help: None,
    })?;
    Reader { text }.node(whole.get(), DEEPEST)
}

/// An error without its position, which is that in the part that was read.
fn without_place(error: &serde_json::Error) -> String {
    let message = error.to_string();
    match message.rsplit_once(" at line ") {
        Some((message, _)) => message.to_owned(),
        None => message,
    }
}

struct Reader<'a> {
    text: &'a str,
}

impl<'a> Reader<'a> {
    fn node(&self, value: &'a str, deeper: usize) -> Result<Node, Diagnostic> {
        let value = value.trim_ascii();
        let start = position_of(self.text, value);
        let at = start..start + value.len();
        let fail = |message: String| Diagnostic {
            place: Place::Span(at.clone()),
            message,
            help: None,
        };
        let parts = Deserializer::deserialize_any(&mut serde_json::Deserializer::from_str(value), Parts);
        let value = match parts.map_err(|e| fail(without_place(&e)))? {
            Part::Value(value) => value,
            _ if deeper == 0 => return Err(fail(format!("more than {DEEPEST} levels of lists and tables"))),
            Part::List(items) => {
                let items = items.into_iter().map(|item| self.node(item.get(), deeper - 1));
                Value::Array(items.collect::<Result<_, _>>()?)
            }
            Part::Table(entries) => {
                let mut names = BTreeSet::new();
                let mut table = Vec::with_capacity(entries.len());
                for (name, value) in entries {
                    let key = self.key(position_of(self.text, value.get()));
                    if !names.insert(name.clone()) {
                        return Err(Diagnostic {
                            place: Place::Span(key),
                            message: format!("duplicate key `{name}`"),
                            help: None,
                        });
                    }
                    let source = Source::File(key);
                    table.push((Key { source, name }, self.node(value.get(), deeper - 1)?));
                }
                Value::Table(table)
            }
        };
        Ok(Node {
            source: Source::File(at),
            value,
        })
    }

    /// The key, with its quotes, of a value that begins at a byte.
    fn key(&self, value: usize) -> std::ops::Range<usize> {
        let before = self.text[..value].trim_ascii_end();
        let quoted = before.strip_suffix(':').unwrap_or(before).trim_ascii_end();
        let mut start = quoted.len().saturating_sub(1);
        // The opening quote is the first before it that no odd number of backslashes escapes.
        while let Some(quote) = quoted[..start].rfind('"') {
            let slashes = quoted[..quote].bytes().rev().take_while(|b| *b == b'\\').count();
            start = quote;
            if slashes % 2 == 0 {
                break;
            }
        }
        start..quoted.len()
    }
}

/// A value whose parts have not been read.
enum Part<'a> {
    Value(Value),
    List(Vec<&'a RawValue>),
    Table(Vec<(String, &'a RawValue)>),
}

struct Parts;

impl<'de> Visitor<'de> for Parts {
    type Value = Part<'de>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_unit<E>(self) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::Null))
    }

    fn visit_bool<E>(self, b: bool) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::Boolean(b)))
    }

    fn visit_i64<E>(self, i: i64) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::Integer(i.into())))
    }

    fn visit_u64<E>(self, i: u64) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::Integer(i.into())))
    }

    fn visit_f64<E>(self, f: f64) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::Float(f)))
    }

    fn visit_str<E>(self, s: &str) -> Result<Part<'de>, E> {
        Ok(Part::Value(Value::String(s.to_owned())))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Part<'de>, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Part::List(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Part<'de>, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(Part::Table(entries))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::place::{KeyPath, Segment};

    #[test]
    fn values_and_keys_have_their_positions() {
        let text = " {\"a\": [1, {\"b\\\"\\\\\" : -2.5}],\n \"c\": null}";
        let root = from_json(text).expect("JSON");
        let shown = |source: &Source| match source {
            Source::File(span) => text[span.clone()].to_owned(),
            other => panic!("{other:?}"),
        };
        let path = KeyPath::of("a").index(1).key("b\"\\");
        assert_eq!(shown(&root.nearest(&path).source), "-2.5");
        let table = root.nearest(&KeyPath::of("a").index(1));
        let Value::Table(entries) = &table.value else {
            panic!("a table")
        };
        assert_eq!(shown(&entries[0].0.source), "\"b\\\"\\\\\"");
        assert_eq!(
            root.child(&Segment::Key("c".to_owned()))
                .map(|n| shown(&n.source))
                .as_deref(),
            Some("null")
        );
    }

    #[test]
    fn duplicates_and_depth_have_a_place() {
        let error = from_json("{\"a\": 1,\n \"a\": 2}").expect_err("a duplicate");
        assert_eq!(
            (error.message.as_str(), error.place),
            ("duplicate key `a`", Place::Span(10..13))
        );
        let deep = "[".repeat(40) + &"]".repeat(40);
        assert!(
            from_json(&deep)
                .expect_err("too deep")
                .message
                .contains("32 levels")
        );
        assert!(from_json(&"[".repeat(1_000_000)).is_err());
        let large = from_json("[1e999]").expect_err("no number");
        assert!(large.message.contains("out of range"), "{}", large.message);
    }
}
