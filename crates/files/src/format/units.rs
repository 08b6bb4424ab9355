//! Units in the names of keys, and help for values in another unit.

use super::super::tree::{Node, Value};

/// Units in the names of keys, with their dimension and their size in its SI unit.
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

/// Splits `tilt_deg` into ("tilt", "deg").
pub(super) fn split_unit(key: &str) -> Option<(&str, &str)> {
    key.rsplit_once('_')
        .filter(|(_, unit)| UNITS.iter().any(|(u, _, _)| u == unit))
}

/// The unit as printed after a number in a message.
pub(super) fn unit_sign(key: &str) -> String {
    match split_unit(key) {
        Some((_, "deg")) => "°".to_owned(),
        Some((_, "hz")) => " Hz".to_owned(),
        Some((_, "w")) => " W".to_owned(),
        Some((_, unit)) => format!(" {unit}"),
        None => String::new(),
    }
}

/// Help for a key that exists in another unit, with the value converted if possible.
pub(super) fn other_unit(found: &str, name: &str, child: &Node) -> String {
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

/// Six decimal places: more than a person writes.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}
