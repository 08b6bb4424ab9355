//! Tables and lists: unknown keys, missing keys, number of entries.

use super::super::tree::{Node, Value};
use super::units::{other_unit, split_unit};
use super::{Finding, Walk};
use catoptric_model::place::{KeyPath, nearest};
use serde_json::Value as Json;

impl<'a> Walk<'a> {
    pub(super) fn list(&mut self, node: &Node, items: &[Node], schema: &'a Json, path: &KeyPath) {
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
            self.add(&node.source, path, message, None);
        }
        if let Some(own) = schema.get("items") {
            for (i, item) in items.iter().enumerate() {
                self.value(item, own, &path.index(i));
            }
        }
    }

    pub(super) fn table(&mut self, node: &Node, schema: &'a Json, path: &KeyPath) {
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
                self.add(
                    &key.source,
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
            // A key with a typo in its name has been reported already.
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

    /// Help for an unknown key, and the key that was probably meant.
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

    /// Tables of the whole file that have a key of that name.
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
}

/// The table that contains a key.
fn node_path(path: &KeyPath) -> Option<KeyPath> {
    let (_, before) = path.0.split_last()?;
    Some(KeyPath(before.to_vec()))
}

fn table_name(path: Option<&KeyPath>) -> String {
    match path.filter(|p| !p.0.is_empty()) {
        Some(path) => format!("`{path}`"),
        None => "the outermost table".to_owned(),
    }
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
