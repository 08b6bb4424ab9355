//! Setting one value of a tree from the command line.

use super::toml::node;
use super::{Key, Node, Source, Value};
use catoptric_model::place::{Segment, nearest};
use toml::de::DeValue;

/// The table whose entries may be set by name alone.
const PARAMETERS: &str = "parameters";

/// Applies the `--set` with a given index: `superstructure.facet.0.name=left`, `board[1].width_mm=500`.
pub(crate) fn apply_set(root: &mut Node, argument: &str, number: usize) -> Result<(), String> {
    let source = Source::Set(number);
    let (path, text) = argument
        .split_once('=')
        .ok_or("has no `=`; write it as KEY=VALUE")?;
    let steps = split_path(path.trim())?;
    let value = Node {
        source: source.clone(),
        value: set_value(text.trim(), &source)?,
    };
    let of_parameters = steps.first().is_some_and(|s| s == PARAMETERS);
    if let (true, Some(name)) = (of_parameters, steps.get(1)) {
        known_parameter(root, name)?;
    }
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
                    // Tables that the file leaves at their defaults are created here.
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
    if let [_, _] = steps.as_slice()
        && of_parameters
        && let Value::Table(entries) = &mut at.value
        && !matches!(value.value, Value::Table(_))
    {
        // A parameter keeps its limits.
        let key = Key {
            source: source.clone(),
            name: "value".to_owned(),
        };
        entries.retain(|(k, _)| k.name != key.name);
        entries.push((key, value));
        return Ok(());
    }
    *at = value;
    Ok(())
}

/// Rejects a new parameter on the command line, which would have no effect.
fn known_parameter(root: &Node, name: &str) -> Result<(), String> {
    let table = root.child(&Segment::Key(PARAMETERS.to_owned())).map(|n| &n.value);
    let names: Vec<&str> = match table {
        Some(Value::Table(entries)) => entries.iter().map(|(k, _)| k.name.as_str()).collect(),
        _ => Vec::new(),
    };
    if names.contains(&name) {
        return Ok(());
    }
    let help = match (nearest(name, names.iter().copied()), names.is_empty()) {
        (Some(near), _) => format!("did you mean {PARAMETERS}.{near}?"),
        (None, true) => "it has none".to_owned(),
        (None, false) => format!("it has {}", names.join(", ")),
    };
    Err(format!("the scene has no parameter `{name}`; {help}"))
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
