//! Names, colors, tables and pairs of limits.

use super::findings::{Findings, suggestion};
use crate::build::color;
use crate::scene::{Detector, EchoChoice, MocapProfile, NoiseTable, Preset, Principle, Scene};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::place::Path;

pub(super) fn check(scene: &Scene, found: &mut Findings) {
    names(scene, found);
    parameters(scene, found);
    colors(scene, found);
    tables(scene, found);
    shares(scene, found);
    detection(scene, found);
    let experiment = Path::of("experiment");
    order(
        &scene.experiment.tilt_deg,
        &experiment.key("tilt_deg"),
        "°",
        found,
    );
    order(&scene.experiment.range_m, &experiment.key("range_m"), " m", found);
}

/// A name that is used twice says nothing about which one is meant.
pub(super) fn distinct<'a>(list: &Path, names: impl Iterator<Item = &'a str>, found: &mut Findings) {
    let mut seen: Vec<&str> = Vec::new();
    for (i, name) in names.enumerate() {
        let path = list.index(i).key("name");
        if name.trim().is_empty() {
            found.add(&path, "is empty; a name needs at least one letter", None);
        } else if let Some(first) = seen.iter().position(|s| *s == name) {
            found.add(
                &path,
                format_args!("is {name:?}, the name that `{list}[{first}]` has already"),
                "every name may be used once".to_owned(),
            );
        }
        seen.push(name);
    }
}

/// A search goes from one limit to the other.
fn parameters(scene: &Scene, found: &mut Findings) {
    for (name, parameter) in &scene.parameters {
        let path = Path::of("parameters").key(name);
        match (parameter.low, parameter.high) {
            (Some(low), Some(high)) if low >= high => found.add(
                &path,
                format_args!("reaches from {low} to {high}; the smaller limit is `low`"),
                (low > high).then(|| format!("write low = {high}, high = {low}")),
            ),
            (Some(low), Some(high)) if !(low..=high).contains(&parameter.value) => found.add(
                &path.key("value"),
                format_args!("is {}; {low} to {high} is allowed", parameter.value),
                None,
            ),
            (Some(_), None) | (None, Some(_)) => found.add(
                &path,
                "has one limit; a search needs both `low` and `high`",
                "give it the other, or none".to_owned(),
            ),
            _ => {}
        }
    }
}

fn names(scene: &Scene, found: &mut Findings) {
    if scene.name.trim().is_empty() {
        found.add(
            &Path::of("name"),
            "is empty; a name needs at least one letter",
            None,
        );
    }
    let structure = Path::of("superstructure");
    let facets = &scene.superstructure.facet;
    let posts = &scene.superstructure.post;
    distinct(
        &structure.key("facet"),
        facets.iter().map(|f| f.name.as_str()),
        found,
    );
    distinct(
        &structure.key("post"),
        posts.iter().map(|p| p.name.as_str()),
        found,
    );
    let boards = Path::of("board");
    distinct(&boards, scene.board.iter().map(|b| b.name.as_str()), found);
    for (i, board) in scene.board.iter().enumerate() {
        let path = boards.index(i).key("name");
        let plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if !board.name.chars().all(plain) {
            found.add(
                &path,
                format_args!("is {:?}; letters, digits, `_` and `-` are allowed", board.name),
                "the name becomes a topic of the recording, /mocap/NAME".to_owned(),
            );
        }
        // "markers" is the topic of the labelled markers of all bodies.
        if board.name == RIG_SUBJECT || board.name == "markers" {
            found.add(
                &path,
                format_args!("is {:?}, which the recording needs for itself", board.name),
                "choose another name".to_owned(),
            );
        }
    }
}

fn colors(scene: &Scene, found: &mut Findings) {
    let known: Vec<&str> = color::BUILT_IN
        .into_iter()
        .chain(scene.color.keys().map(String::as_str))
        .collect();
    let mut used = vec![(Path::of("room").key("color"), scene.room.color.as_str())];
    for (i, post) in scene.superstructure.post.iter().enumerate() {
        let path = Path::of("superstructure").key("post").index(i).key("color");
        used.push((path, &post.color));
    }
    for (i, board) in scene.board.iter().enumerate() {
        used.push((Path::of("board").index(i).key("color"), &board.color));
    }
    for (i, surface) in scene.room.surface.iter().enumerate() {
        let path = Path::of("room").key("surface").index(i).key("color");
        used.push((path, &surface.color));
    }
    for name in scene.errors.color.keys() {
        used.push((Path::of("errors").key("color").key(name), name));
    }
    for (path, name) in used {
        if !known.contains(&name) {
            let help = suggestion(name, "colors", known.iter().copied());
            found.add(
                &path,
                format_args!("names the color {name:?}, which is neither built in nor under `color`"),
                format!("{help}; a new one is a table [color.{name}] with its reflectivity"),
            );
        }
    }
}

fn tables(scene: &Scene, found: &mut Findings) {
    let errors = Path::of("errors");
    let noise = |table: &NoiseTable, path: &Path, found: &mut Findings| {
        columns(&table.range_m, &table.sd_mm, path, "sd_mm", found);
    };
    noise(&scene.errors.noise, &errors.key("noise"), found);
    for (name, color) in &scene.color {
        if let Some(table) = &color.noise {
            noise(table, &Path::of("color").key(name).key("noise"), found);
        }
    }
    let distance = &scene.errors.distance;
    columns(
        &distance.range_m,
        &distance.error_mm,
        &errors.key("distance"),
        "error_mm",
        found,
    );
    if let Some(table) = &scene.errors.angle.table {
        let path = errors.key("angle").key("table");
        let nodes = ("incidence_deg", "°", table.incidence_deg.as_slice());
        increasing(nodes, &table.error_mm, &path, "error_mm", found);
    }
}

/// What only pulsed light has, what only a scanner of one's own has, and limits in their order.
fn detection(scene: &Scene, found: &mut Findings) {
    let detection = &scene.detection;
    let path = Path::of("detection");
    if detection.principle == Principle::Phase {
        let pulsed = [
            ("detector", detection.detector != Detector::LeadingEdge),
            ("echo", detection.echo != EchoChoice::First),
            (
                "saturation_over_threshold",
                detection.saturation_over_threshold > 0.0,
            ),
        ];
        for (key, _) in pulsed.iter().filter(|(_, set)| *set) {
            found.add(
                &path.key(key),
                "is set, and a phase has neither pulses nor echoes",
                "leave it out, or set `detection.principle` to \"pulsed\"".to_owned(),
            );
        }
    }
    let saturation = detection.saturation_over_threshold;
    if saturation > 0.0 && saturation <= 1.0 {
        found.add(
            &path.key("saturation_over_threshold"),
            format_args!("is {saturation}; a receiver that clips at its threshold detects nothing"),
            "more than 1 is allowed, or 0 for a receiver that never clips".to_owned(),
        );
    }
    let limits = scene.scanner.limits();
    if detection.echo == EchoChoice::All && limits.echoes < 2 {
        found.add(
            &path.key("echo"),
            format_args!(
                "is \"all\", and the scanner {:?} reports one echo",
                scene.scanner.preset.name()
            ),
            "use the preset \"utm-30lx-ew\", or \"custom\" with `scanner.custom.echoes`".to_owned(),
        );
    }
    let own_markers = scene.mocap.profile == MocapProfile::Custom;
    if own_markers != scene.mocap.marker.is_some() {
        let (what, remedy) = if own_markers {
            (
                "is \"custom\", whose errors only the scene can tell",
                "add marker = { constant_sd_mm = …, jitter_sd_mm = … } to [mocap]",
            )
        } else {
            (
                "has errors of its own, and `mocap.marker` is given",
                "leave `mocap.marker` out, or set the profile to \"custom\"",
            )
        };
        found.add(&Path::of("mocap").key("profile"), what, remedy.to_owned());
    }
    let custom = scene.scanner.preset == Preset::Custom;
    let path = Path::of("scanner");
    if custom && scene.scanner.beam.is_none() {
        found.add(
            &path.key("preset"),
            "is \"custom\", whose beam only the scene can describe",
            "add a table [scanner.beam] with wide_full_mrad and narrow_full_mrad".to_owned(),
        );
    }
    if !custom && scene.scanner.custom.is_some() {
        found.add(
            &path.key("custom"),
            format_args!(
                "is given, and the preset {:?} has limits of its own",
                scene.scanner.preset.name()
            ),
            "leave it out, or set `scanner.preset` to \"custom\"".to_owned(),
        );
    }
    if limits.range_min_m >= limits.range_max_m {
        found.add(
            &path.key("custom").key("range_min_m"),
            format_args!(
                "is {} m, not less than `range_max_m`, {} m",
                limits.range_min_m, limits.range_max_m
            ),
            None,
        );
    }
}

fn columns(range_m: &[f64], values: &[f64], path: &Path, column: &str, found: &mut Findings) {
    increasing(("range_m", " m", range_m), values, path, column, found);
    let path = path.key("range_m");
    if let Some(first) = range_m.first().filter(|r| **r < 0.0) {
        found.add(
            &path.index(0),
            format_args!("is {first} m; a distance is 0 or more"),
            None,
        );
    }
}

/// A column of nodes (its name, its unit, its values) and one of values: as many, and strictly increasing.
fn increasing(
    (name, unit, nodes): (&str, &str, &[f64]),
    values: &[f64],
    path: &Path,
    column: &str,
    found: &mut Findings,
) {
    let what = if unit == "°" { "angle" } else { "distance" };
    if nodes.len() != values.len() {
        found.add(
            &path.key(column),
            format_args!(
                "has {} entries, `{path}.{name}` has {}",
                values.len(),
                nodes.len()
            ),
            format!("a table has one value for every {what}"),
        );
    }
    let path = path.key(name);
    for (i, pair) in nodes.windows(2).enumerate() {
        if pair[1] <= pair[0] {
            found.add(
                &path.index(i + 1),
                format_args!(
                    "is {}{unit}, not more than the {}{unit} before it",
                    pair[1], pair[0]
                ),
                format!("{what}s must be strictly increasing"),
            );
        }
    }
}

/// Shares of which none at all would leave nothing to detect.
fn shares(scene: &Scene, found: &mut Findings) {
    let light = Path::of("light");
    for (path, value) in [
        (light.key("optics_transmission"), scene.light.optics_transmission),
        (light.key("air_transmission"), scene.light.air_transmission),
        (
            Path::of("detection").key("threshold_reflectivity"),
            scene.detection.threshold_reflectivity,
        ),
    ] {
        if value <= 0.0 {
            found.add(
                &path,
                format_args!("is {value}; more than 0 and at most 1 is allowed"),
                None,
            );
        }
    }
}

fn order(limits: &[f64; 2], path: &Path, unit: &str, found: &mut Findings) {
    let [least, greatest] = limits;
    if least > greatest {
        found.add(
            path,
            format_args!("runs from {least}{unit} down to {greatest}{unit}"),
            format!("write the smaller one first: [{greatest}, {least}]"),
        );
    }
}
