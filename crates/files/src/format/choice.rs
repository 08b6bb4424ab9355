//! Choices: one of several words, or a table with one of several keys.

use super::super::tree::{Node, Value};
use super::Walk;
use catoptric_model::place::{KeyPath, nearest};
use serde_json::Value as Json;

impl<'a> Walk<'a> {
    /// A choice: one of several words, or a table with one of several keys.
    pub(super) fn variant(&mut self, node: &Node, variants: &'a [Json], path: &KeyPath) {
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
            return self.add(&node.source, path, message, None);
        };
        let mut chosen = Vec::new();
        for (key, child) in entries {
            if let Some((name, schema)) = tagged.iter().find(|(name, _)| *name == key.name) {
                chosen.push(*name);
                self.value(child, schema, &path.key(name));
            } else {
                let help = match nearest(&key.name, names.iter().copied()) {
                    Some(name) => format!("did you mean `{name}`?"),
                    None => choice.clone(),
                };
                let message = format!("unknown key `{}` in `{path}`", key.name);
                self.add(&key.source, &path.key(&key.name), message, Some(help));
            }
        }
        if entries.is_empty() || chosen.len() > 1 {
            let has = if chosen.is_empty() {
                "is empty".to_owned()
            } else {
                format!("has {}", chosen.join(" and "))
            };
            self.add(&node.source, path, format!("`{path}` {has}; {choice}"), None);
        }
    }

    pub(super) fn word(&mut self, node: &Node, words: &[&str], path: &KeyPath) {
        match &node.value {
            Value::String(word) if words.contains(&word.as_str()) => {}
            Value::String(word) => {
                let help = nearest(word, words.iter().copied()).map(|w| format!("did you mean \"{w}\"?"));
                let message = format!("`{path}` is {word:?}; allowed: {}", words.join(", "));
                self.add(&node.source, path, message, help);
            }
            other => {
                let message = format!(
                    "`{path}` is {}; one of the words {} is needed",
                    other.describe(),
                    words.join(", ")
                );
                self.add(&node.source, path, message, None);
            }
        }
    }
}
