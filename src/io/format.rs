//! A tree of values against the JSON Schema of its type: every departure, not only the first.

use super::tree::{Node, Source, Value};
use catoptric_sim::check::{Path, Segment, nearest};
use serde_json::Value as Json;

/// A departure from the schema.
#[derive(Debug)]
pub(super) struct Finding {
    pub(super) source: Source,
    pub(super) path: Path,
    pub(super) message: String,
    pub(super) help: Option<String>,
    /// Whether something is not there at all, as much is after a syntax error.
    pub(super) missing: bool,
}

/// Units that keys carry, with their dimension and their size in its SI unit.
const UNITS: [(&str, &str, f64); 13] = [
    ("deg", "angle", std::f64::consts::PI / 180.0),
    ("rad", "angle", 1.0),
    ("mrad", "angle", 1e-3),
    ("m", "length", 1.0),
    ("cm", "length", 1e-2),
    ("mm", "length", 1e-3),
    ("um", "length", 1e-6),
    ("s", "time", 1.0),
    ("ms", "time", 1e-3),
    ("ns", "time", 1e-9),
    ("hz", "frequency", 1.0),
    ("w", "power", 1.0),
    ("sr", "solid angle", 1.0),
];

/// Every departure of a tree from a schema.
pub(super) fn check(root: &Node, schema: &Json) -> Vec<Finding> {
    let mut walk = Walk {
        schema,
        found: Vec::new(),
    };
    walk.value(root, schema, &Path::default());
    walk.found
}

struct Walk<'a> {
    schema: &'a Json,
    found: Vec<Finding>,
}

impl<'a> Walk<'a> {
    fn add(&mut self, node: &Node, path: &Path, message: String, help: Option<String>) {
        self.found.push(Finding {
            source: node.source.clone(),
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

    fn value(&mut self, node: &Node, schema: &'a Json, path: &Path) {
        if let Some(target) = self.resolve(schema) {
            self.value(node, target, path);
        }
        if let Some(alternatives) = schema.get("anyOf").and_then(Json::as_array) {
            // An optional value: the value's own schema beside that of null.
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

    fn typed(&mut self, node: &Node, kind: &str, schema: &'a Json, path: &Path) {
        match (kind, &node.value) {
            // The word itself is looked at where the words are listed.
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

    fn wrong_type(&mut self, node: &Node, kind: &str, schema: &Json, path: &Path) {
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
        self.add(node, path, message, help);
    }

    fn not_finite(&mut self, node: &Node, path: &Path) {
        let message = format!("`{path}` is {}; a finite number is needed", node.value.describe());
        self.add(node, path, message, None);
    }

    fn integer(&mut self, node: &Node, value: i128, schema: &Json, path: &Path) {
        let (least, greatest) = match schema.get("format").and_then(Json::as_str) {
            Some("uint32") => (0, u32::MAX.into()),
            Some("uint64" | "uint") => (0, u64::MAX.into()),
            _ => (i64::MIN.into(), i64::MAX.into()),
        };
        let limit = |name: &str| schema.get(name).and_then(Json::as_f64);
        if value < least || value > greatest {
            let low = limit("minimum").map_or(least.to_string(), |v| v.to_string());
            let high = limit("maximum").map_or(greatest.to_string(), |v| v.to_string());
            let message = format!("`{path}` is {value}; {low} to {high} is allowed");
            self.add(node, path, message, None);
        } else {
            self.number(node, schema, path);
        }
    }

    fn number(&mut self, node: &Node, schema: &Json, path: &Path) {
        let Some(value) = node.value.number() else { return };
        if !value.is_finite() {
            return self.not_finite(node, path);
        }
        let limit = |name: &str| schema.get(name).and_then(Json::as_f64);
        let (least, greatest) = (limit("minimum"), limit("maximum"));
        let above = limit("exclusiveMinimum");
        let fits = least.is_none_or(|l| value >= l)
            && greatest.is_none_or(|g| value <= g)
            && above.is_none_or(|a| value > a);
        if fits {
            return;
        }
        let (key, unit) = (last_key(path), unit_sign(last_key(path)));
        let allowed = match (least, greatest, above) {
            (Some(l), Some(g), _) if l == g => format!("{l}{unit}"),
            (Some(l), Some(g), _) => format!("{l}{unit} to {g}{unit}"),
            (Some(l), None, _) => format!("{l}{unit} or more"),
            (None, Some(g), _) => format!("{g}{unit} or less"),
            (None, None, above) => format!("more than {}{unit}", above.unwrap_or_default()),
        };
        let message = format!(
            "`{path}` is {}{unit}; {allowed} is allowed",
            node.value.describe()
        );
        let help = match split_unit(key) {
            Some((_, "deg")) => Some("angles are in degrees".to_owned()),
            _ if key == "schema_version" => Some("this program reads version 1".to_owned()),
            _ => None,
        };
        self.add(node, path, message, help);
    }

    fn list(&mut self, node: &Node, items: &[Node], schema: &'a Json, path: &Path) {
        let limit = |name: &str| schema.get(name).and_then(Json::as_u64);
        let (least, most) = (limit("minItems"), limit("maxItems"));
        let count = items.len() as u64;
        if least.is_some_and(|l| count < l) || most.is_some_and(|m| count > m) {
            let needed = match (least, most) {
                (Some(l), Some(m)) if l == m => format!("exactly {l} are needed"),
                (Some(l), Some(m)) => format!("{l} to {m} are needed"),
                (Some(l), None) => format!("at least {l} {} needed", if l == 1 { "is" } else { "are" }),
                (None, m) => format!("at most {} are allowed", m.unwrap_or_default()),
            };
            let message = format!("`{path}` has {count} entries; {needed}");
            self.add(node, path, message, None);
        }
        if let Some(own) = schema.get("items") {
            for (i, item) in items.iter().enumerate() {
                self.value(item, own, &path.index(i));
            }
        }
    }

    fn table(&mut self, node: &Node, schema: &'a Json, path: &Path) {
        let Value::Table(entries) = &node.value else {
            return;
        };
        let none = serde_json::Map::new();
        let properties = schema.get("properties").and_then(Json::as_object);
        let names: Vec<&str> = properties.unwrap_or(&none).keys().map(String::as_str).collect();
        let additional = schema.get("additionalProperties");
        let mut meant: Vec<&str> = Vec::new();
        for (key, child) in entries {
            let path = path.key(&key.name);
            if let Some(own) = properties.and_then(|p| p.get(&key.name)) {
                self.value(child, own, &path);
            } else if let Some(own) = additional.filter(|a| a.is_object()) {
                self.value(child, own, &path);
            } else if additional == Some(&Json::Bool(false)) {
                let (help, name) = self.unknown_key(&key.name, child, &names);
                meant.extend(name);
                let within = table_name(node_path(&path).as_ref());
                let spot = Node {
                    source: key.source.clone(),
                    value: Value::Null,
                };
                self.add(
                    &spot,
                    &path,
                    format!("unknown key `{}` in {within}", key.name),
                    Some(help),
                );
            }
        }
        for required in schema
            .get("required")
            .and_then(Json::as_array)
            .into_iter()
            .flatten()
        {
            let Some(name) = required.as_str() else { continue };
            // A key that is there under a slip of the pen has been reported once.
            if entries.iter().any(|(k, _)| k.name == name) || meant.contains(&name) {
                continue;
            }
            let about = properties
                .and_then(|p| p.get(name))
                .and_then(|p| p.get("description"));
            self.found.push(Finding {
                source: node.source.clone(),
                path: path.key(name),
                message: format!("missing key `{name}` in {}", table_name(Some(path))),
                help: about
                    .and_then(Json::as_str)
                    .map(|d| format!("{name}: {}", one_line(d))),
                missing: true,
            });
        }
    }

    /// What to do about a key that does not exist, and the one that was meant.
    fn unknown_key<'n>(&self, key: &str, child: &Node, names: &[&'n str]) -> (String, Option<&'n str>) {
        let stem = split_unit(key).map_or(key, |(stem, _)| stem);
        let same_stem = names
            .iter()
            .find(|n| **n == stem || split_unit(n).is_some_and(|(s, _)| s == stem));
        if let Some(name) = same_stem {
            return (other_unit(key, name, child), Some(name));
        }
        if let Some(name) = nearest(key, names.iter().copied()) {
            return (format!("did you mean `{name}`?"), Some(name));
        }
        let elsewhere = self.tables_with(key);
        let help = if elsewhere.is_empty() {
            format!("known keys: {}", names.join(", "))
        } else {
            format!("a key of that name belongs to `{}`", elsewhere.join("`, `"))
        };
        (help, None)
    }

    /// Tables of the whole file that know a key.
    fn tables_with(&self, key: &str) -> Vec<String> {
        let mut out = Vec::new();
        self.search(key, self.schema, &mut Vec::new(), &mut out);
        out
    }

    fn search(&self, key: &str, schema: &'a Json, path: &mut Vec<String>, out: &mut Vec<String>) {
        let schema = self.resolve(schema).unwrap_or(schema);
        if let Some(items) = schema.get("items") {
            self.search(key, items, path, out);
        }
        let variants = schema.get("oneOf").and_then(Json::as_array);
        for variant in variants.into_iter().flatten() {
            self.search(key, variant, path, out);
        }
        let properties = schema.get("properties").and_then(Json::as_object);
        for (name, child) in properties.into_iter().flatten() {
            if name == key && !path.is_empty() {
                out.push(path.join("."));
            }
            path.push(name.clone());
            self.search(key, child, path, out);
            path.pop();
        }
    }

    /// A choice: one of several words, or a table with one of several keys.
    fn variant(&mut self, node: &Node, variants: &'a [Json], path: &Path) {
        let words: Vec<&str> = variants
            .iter()
            .filter_map(|v| v.get("const").and_then(Json::as_str))
            .collect();
        if words.len() == variants.len() {
            return self.word(node, &words, path);
        }
        let tagged: Vec<(&str, &'a Json)> = variants
            .iter()
            .filter_map(|v| v.get("properties")?.as_object()?.iter().next())
            .map(|(name, schema)| (name.as_str(), schema))
            .collect();
        let names: Vec<&str> = tagged.iter().map(|(name, _)| *name).collect();
        let choice = format!("exactly one of {} is needed", names.join(", "));
        let Value::Table(entries) = &node.value else {
            let message = format!("`{path}` is {}; a table with {choice}", node.value.describe());
            return self.add(node, path, message, None);
        };
        let mut chosen = Vec::new();
        for (key, child) in entries {
            if let Some((name, schema)) = tagged.iter().find(|(name, _)| *name == key.name) {
                chosen.push(*name);
                self.value(child, schema, &path.key(name));
            } else {
                let spot = Node {
                    source: key.source.clone(),
                    value: Value::Null,
                };
                let help = match nearest(&key.name, names.iter().copied()) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => choice.clone(),
                };
                let message = format!("unknown key `{}` in `{path}`", key.name);
                self.add(&spot, &path.key(&key.name), message, Some(help));
            }
        }
        if entries.is_empty() || chosen.len() > 1 {
            let has = if chosen.is_empty() {
                "is empty".to_owned()
            } else {
                format!("has {}", chosen.join(" and "))
            };
            self.add(node, path, format!("`{path}` {has}; {choice}"), None);
        }
    }

    fn word(&mut self, node: &Node, words: &[&str], path: &Path) {
        match &node.value {
            Value::String(word) if words.contains(&word.as_str()) => {}
            Value::String(word) => {
                let help = nearest(word, words.iter().copied()).map(|w| format!("did you mean \"{w}\"?"));
                let message = format!("`{path}` is {word:?}; allowed: {}", words.join(", "));
                self.add(node, path, message, help);
            }
            other => {
                let message = format!(
                    "`{path}` is {}; one of the words {} is needed",
                    other.describe(),
                    words.join(", ")
                );
                self.add(node, path, message, None);
            }
        }
    }
}

/// `tilt_deg` as ("tilt", "deg").
fn split_unit(key: &str) -> Option<(&str, &str)> {
    key.rsplit_once('_')
        .filter(|(_, unit)| UNITS.iter().any(|(u, _, _)| u == unit))
}

/// What follows a number in a message.
fn unit_sign(key: &str) -> String {
    match split_unit(key) {
        Some((_, "deg")) => "°".to_owned(),
        Some((_, "hz")) => " Hz".to_owned(),
        Some((_, "w")) => " W".to_owned(),
        Some((_, unit)) => format!(" {unit}"),
        None => String::new(),
    }
}

/// Help for a key that exists in another unit, with the value converted where that can be done.
fn other_unit(found: &str, name: &str, child: &Node) -> String {
    let unit = |key: &str| {
        let (_, unit) = split_unit(key)?;
        UNITS.iter().find(|(u, _, _)| *u == unit)
    };
    let mut help = format!("did you mean `{name}`?");
    let numbers: Option<Vec<f64>> = match &child.value {
        Value::Array(items) => items.iter().map(|n| n.value.number()).collect(),
        other => other.number().map(|n| vec![n]),
    };
    let Some((to, to_dimension, to_size)) = unit(name) else {
        return help;
    };
    let in_unit = match *to {
        "deg" => "angles are in degrees".to_owned(),
        _ => format!("its unit is {to}"),
    };
    help = format!("{help} {in_unit}");
    if let (Some((from, from_dimension, from_size)), Some(numbers)) = (unit(found), numbers)
        && from_dimension == to_dimension
    {
        let write = |values: Vec<f64>| {
            let list: Vec<String> = values.iter().map(|v| rounded(*v).to_string()).collect();
            match &child.value {
                Value::Array(_) => format!("[{}]", list.join(", ")),
                _ => list.join(", "),
            }
        };
        let converted = write(numbers.iter().map(|v| v * from_size / to_size).collect());
        let turns = numbers.iter().any(|v| v.abs() > std::f64::consts::TAU);
        help = if *from == "rad" && turns {
            let given = write(numbers);
            format!(
                "{help}: {given} rad would be {converted}°; if degrees were meant, write {name} = {given}"
            )
        } else {
            format!("{help}: write {name} = {converted}")
        };
    }
    help
}

/// Six significant places after the point: more than a person writes.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
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

fn last_key(path: &Path) -> &str {
    let keys = path.0.iter().rev();
    keys.filter_map(|s| match s {
        Segment::Key(key) => Some(key.as_str()),
        Segment::Index(_) => None,
    })
    .next()
    .unwrap_or_default()
}

/// The table that holds a key.
fn node_path(path: &Path) -> Option<Path> {
    let (_, before) = path.0.split_last()?;
    Some(Path(before.to_vec()))
}

fn table_name(path: Option<&Path>) -> String {
    match path.filter(|p| !p.0.is_empty()) {
        Some(path) => format!("`{path}`"),
        None => "the outermost table".to_owned(),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
