//! Numbers: integer or not, and within the allowed range.

use super::super::tree::Node;
use super::Walk;
use super::units::{split_unit, unit_sign};
use catoptric_model::place::{KeyPath, Segment};
use serde_json::Value as Json;

impl Walk<'_> {
    pub(super) fn integer(&mut self, node: &Node, value: i128, schema: &Json, path: &KeyPath) {
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
            self.add(&node.source, path, message, None);
        } else {
            self.number(node, schema, path);
        }
    }

    pub(super) fn number(&mut self, node: &Node, schema: &Json, path: &KeyPath) {
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
            _ if key == "schema_version" => Some("it is of another version of this program".to_owned()),
            _ => None,
        };
        self.add(&node.source, path, message, help);
    }

    pub(super) fn not_finite(&mut self, node: &Node, path: &KeyPath) {
        let message = format!("`{path}` is {}; a finite number is needed", node.value.describe());
        self.add(&node.source, path, message, None);
    }
}

fn last_key(path: &KeyPath) -> &str {
    let keys = path.0.iter().rev();
    keys.filter_map(|s| match s {
        Segment::Key(key) => Some(key.as_str()),
        Segment::Index(_) => None,
    })
    .next()
    .unwrap_or_default()
}
