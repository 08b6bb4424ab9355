//! TOML as a tree, as far as it can be read after a syntax error.

use super::super::diagnostic::{Diagnostic, Place};
use super::{Key, Node, Source, Value};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Reads TOML, as far as possible after a syntax error.
pub(crate) fn from_toml(text: &str) -> (Node, Vec<Diagnostic>) {
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
    // The outermost table is reported without a span; it begins at the start of the file.
    let value = table(root.get_ref(), &at);
    let source = Source::File(0..0);
    (Node { source, value }, diagnostics.collect())
}

pub(super) fn node(spanned: &Spanned<DeValue<'_>>, at: &impl Fn(Range<usize>) -> Source) -> Node {
    let value = match spanned.get_ref() {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Integer(i) => match i128::from_str_radix(i.as_str(), i.radix()) {
            Ok(i) => Value::Integer(i),
            // A number of more than 128 bits is out of range anyway.
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
