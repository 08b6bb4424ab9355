//! Numbers in texts, and their limits in a schema: written for the test alone, apart from the readers.

use serde_json::{Map, Value, json};
use std::ops::Range;

/// A number that occurs in no file, to find the path of the one whose place it takes.
pub(super) const MARK: f64 = 987_654.321_25;

/// One step of a path: a key, or an index of a list.
pub(super) type Steps = Vec<Value>;

/// The numbers of a text in TOML or JSON, by their bytes: outside of strings and comments, behind a delimiter.
pub(super) fn numbers(text: &str) -> Vec<Range<usize>> {
    let (mut found, mut before, mut chars) = (Vec::new(), b'\n', text.char_indices().peekable());
    while let Some((at, c)) = chars.next() {
        match c {
            '"' => {
                while let Some((_, c)) = chars.next() {
                    match c {
                        '\\' => drop(chars.next()),
                        '"' => break,
                        _ => {}
                    }
                }
                before = b'"';
            }
            '#' => while chars.next_if(|(_, c)| *c != '\n').is_some() {},
            ' ' => {}
            '\n' if before == b',' || before == b'[' => {}
            '0'..='9' | '-' | '+' if matches!(before, b'=' | b'[' | b',' | b':') => {
                let mut end = at + 1;
                while let Some((last, _)) =
                    chars.next_if(|(_, c)| c.is_ascii_alphanumeric() || "+-._".contains(*c))
                {
                    end = last + 1;
                }
                // A key of an inline table, such as `{ 1a = 2 }`, is not a number.
                if text[at..end].parse::<f64>().is_ok() {
                    found.push(at..end);
                }
                before = b'0';
            }
            c => before = u8::try_from(c).unwrap_or(b'?'),
        }
    }
    found
}

pub(super) fn replaced(text: &str, at: &Range<usize>, with: &str) -> String {
    [&text[..at.start], with, &text[at.end..]].concat()
}

/// The path of the marked number.
pub(super) fn marked(value: &Value, path: &mut Steps) -> bool {
    let mut into = |step: Value, child: &Value| {
        path.push(step);
        let found = marked(child, path);
        if !found {
            path.pop();
        }
        found
    };
    match value {
        Value::Number(n) => n.as_f64() == Some(MARK),
        Value::Array(items) => items.iter().enumerate().any(|(i, item)| into(json!(i), item)),
        Value::Object(map) => map.iter().any(|(key, child)| into(json!(key), child)),
        Value::Null | Value::Bool(_) | Value::String(_) => false,
    }
}

pub(super) fn tree(text: &str, is_json: bool) -> Value {
    if is_json {
        serde_json::from_str(text).unwrap()
    } else {
        toml::from_str(text).unwrap()
    }
}

/// The schema of the value at a path: what remains of it when references, options and variants have been followed.
pub(super) fn schema_at<'a>(root: &'a Value, at: &'a Value, path: &[Value]) -> Option<&'a Value> {
    if let Some(reference) = at.get("$ref") {
        return schema_at(root, root.pointer(&reference.as_str()?[1..])?, path);
    }
    for several in ["anyOf", "oneOf"] {
        let variants = at.get(several).and_then(Value::as_array).into_iter().flatten();
        if let Some(found) = variants.into_iter().find_map(|v| schema_at(root, v, path)) {
            return Some(found);
        }
    }
    match path {
        [] => at.get("type").map(|_| at),
        [Value::String(key), rest @ ..] => {
            let own = at.get("properties").and_then(|p| p.get(key));
            let other = || at.get("additionalProperties").filter(|o| o.is_object());
            schema_at(root, own.or_else(other)?, rest)
        }
        [_, rest @ ..] => schema_at(root, at.get("items")?, rest),
    }
}

/// Whether a schema allows a number as written.
pub(super) fn allows(schema: &Value, written: &str) -> bool {
    let Ok(number) = written.parse::<f64>() else {
        return false;
    };
    let limit = |name: &str| schema.get(name).and_then(Value::as_f64);
    let is = |name: &str| match &schema["type"] {
        Value::Array(all) => all.iter().any(|t| t == name),
        one => one == name,
    };
    let whole = written.bytes().all(|b| b.is_ascii_digit() || b == b'-');
    let unsigned = schema["format"].as_str().is_some_and(|f| f.starts_with("uint"));
    number.is_finite()
        && (is("number") || (is("integer") && whole))
        && !(unsigned && number < 0.0)
        && limit("minimum").is_none_or(|l| number >= l)
        && limit("maximum").is_none_or(|l| number <= l)
        && limit("exclusiveMinimum").is_none_or(|l| number > l)
}

/// A value with every key of a schema, within its limits.
pub(super) fn example(root: &Value, at: &Value) -> Value {
    if let Some(reference) = at.get("$ref") {
        return example(root, root.pointer(&reference.as_str().unwrap()[1..]).unwrap());
    }
    if let Some(variants) = at.get("anyOf").or_else(|| at.get("oneOf")) {
        return example(root, &variants[0]);
    }
    if let Some(one) = at.get("const") {
        return one.clone();
    }
    let kind = match &at["type"] {
        Value::Array(all) => all[0].as_str().unwrap(),
        one => one.as_str().unwrap(),
    };
    match kind {
        "object" => {
            let mut map = Map::new();
            for (key, own) in at
                .get("properties")
                .and_then(Value::as_object)
                .into_iter()
                .flatten()
            {
                map.insert(key.clone(), example(root, own));
            }
            if let Some(other) = at.get("additionalProperties").filter(|o| o.is_object()) {
                map.insert("any".to_owned(), example(root, other));
            }
            map.into()
        }
        "array" => {
            let count = at.get("minItems").and_then(Value::as_u64).unwrap_or(2);
            (0..count.max(1)).map(|_| example(root, &at["items"])).collect()
        }
        "string" => at.get("enum").map_or(json!("a"), |words| words[0].clone()),
        "boolean" => json!(true),
        "integer" => json!(1),
        "number" => json!(
            at["minimum"]
                .as_f64()
                .unwrap()
                .max(1.0)
                .min(at["maximum"].as_f64().unwrap())
        ),
        other => panic!("{other}"),
    }
}
