//! Checks of names, colors, tables and pairs of limits.

use crate::build::color;
use crate::findings::{Findings, suggestion};
use crate::scene::{Detector, EchoChoice, Errors, MocapProfile, NoiseTable, Preset, Principle, Scene};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::place::KeyPath;
use std::collections::BTreeMap;

pub(super) fn check(scene: &Scene, found: &mut Findings) {
    names(scene, found);
    parameters(scene, found);
    colors(scene, found);
    tables(scene, found);
    shares(scene, found);
    detection(scene, found);
    let experiment = KeyPath::of("experiment");
    order(
        &scene.experiment.tilt_deg,
        &experiment.key("tilt_deg"),
        "°",
        found,
    );
    order(&scene.experiment.range_m, &experiment.key("range_m"), " m", found);
}

/// Checks that names are not empty and not used twice, which would be ambiguous.
pub(super) fn distinct<'a>(list: &KeyPath, names: impl Iterator<Item = &'a str>, found: &mut Findings) {
    let mut seen: BTreeMap<&str, usize> = BTreeMap::new();
    for (i, name) in names.enumerate() {
        let path = list.index(i).key("name");
        if name.trim().is_empty() {
            found.add(&path, "is empty; a name needs at least one letter", None);
        } else if let Some(first) = seen.get(name) {
            found.add(
                &path,
                format_args!("is {name:?}, already the name of `{list}[{first}]`"),
                "names must be unique".to_owned(),
            );
        }
        seen.entry(name).or_insert(i);
    }
}

/// Checks the limits between which a parameter is searched.
fn parameters(scene: &Scene, found: &mut Findings) {
    for (name, parameter) in &scene.parameters {
        let path = KeyPath::of("parameters").key(name);
        match (parameter.low, parameter.high) {
            (Some(low), Some(high)) if low >= high => found.add(
                &path,
                format_args!("ranges from {low} to {high}; the smaller limit is `low`"),
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
                "add the other, or delete this one".to_owned(),
            ),
            _ => {}
        }
    }
}

fn names(scene: &Scene, found: &mut Findings) {
    if scene.name.trim().is_empty() {
        found.add(
            &KeyPath::of("name"),
            "is empty; a name needs at least one letter",
            None,
        );
    }
    let structure = KeyPath::of("superstructure");
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
    let boards = KeyPath::of("board");
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
        // "markers" is the topic of the labeled markers of all bodies.
        if board.name == RIG_SUBJECT || board.name == "markers" {
            found.add(
                &path,
                format_args!("is {:?}, which the recording reserves", board.name),
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
    let mut used = vec![(KeyPath::of("room").key("color"), scene.room.color.as_str())];
    for (i, post) in scene.superstructure.post.iter().enumerate() {
        let path = KeyPath::of("superstructure").key("post").index(i).key("color");
        used.push((path, &post.color));
    }
    for (i, board) in scene.board.iter().enumerate() {
        used.push((KeyPath::of("board").index(i).key("color"), &board.color));
    }
    for (i, surface) in scene.room.surface.iter().enumerate() {
        let path = KeyPath::of("room").key("surface").index(i).key("color");
        used.push((path, &surface.color));
    }
    for name in scene.errors.color.keys() {
        used.push((KeyPath::of("errors").key("color").key(name), name));
    }
    for (path, name) in used {
        if !known.contains(&name) {
            let help = suggestion(name, "colors", known.iter().copied());
            found.add(
                &path,
                format_args!("names the color {name:?}, which is neither built in nor defined under `color`"),
                format!("{help}; define a new one as a table [color.{name}] with its reflectivity"),
            );
        }
    }
}

/// Warns of a table of noise that does not hold for the boards and walls, whose colors have their own.
pub(super) fn warn(scene: &Scene, found: &mut Findings) {
    if scene.errors.noise == Errors::default().noise {
        return;
    }
    let boards = scene.board.iter().map(|b| b.color.as_str());
    let mut own: Vec<&str> = boards
        .chain([scene.room.color.as_str()])
        .filter(|name| color::has_own_noise(scene, name))
        .collect();
    own.sort_unstable();
    own.dedup();
    if !own.is_empty() {
        found.add(
            &KeyPath::of("errors").key("noise"),
            format_args!("is not that of {}, which the paper's Table 4 gives", own.join(", ")),
            format!("to use it there too, give the color without noise of its own: [color.{}] with a reflectivity", own[0]),
        );
    }
}

fn tables(scene: &Scene, found: &mut Findings) {
    let errors = KeyPath::of("errors");
    let noise = |table: &NoiseTable, path: &KeyPath, found: &mut Findings| {
        columns(&table.range_m, &table.sd_mm, path, "sd_mm", found);
    };
    noise(&scene.errors.noise, &errors.key("noise"), found);
    for (name, color) in &scene.color {
        if let Some(table) = &color.noise {
            noise(table, &KeyPath::of("color").key(name).key("noise"), found);
        }
    }
    if let Some(table) = &scene.errors.incidence {
        let nodes = ("incidence_deg", "°", table.incidence_deg.as_slice());
        increasing(nodes, &table.factor, &errors.key("incidence"), "factor", found);
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

/// Checks settings that only pulsed light or only a custom scanner has, and the order of limits.
fn detection(scene: &Scene, found: &mut Findings) {
    let detection = &scene.detection;
    let path = KeyPath::of("detection");
    if detection.principle == Principle::Phase {
        let pulsed = [
            ("detector", detection.detector != Detector::default()),
            ("echo", detection.echo != EchoChoice::default()),
            (
                "saturation_over_threshold",
                detection.saturation_over_threshold > 0.0,
            ),
        ];
        for (key, _) in pulsed.iter().filter(|(_, set)| *set) {
            found.add(
                &path.key(key),
                "is set, but a phase has neither pulses nor echoes",
                "omit it, or set `detection.principle` to \"pulsed\"".to_owned(),
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
    let beams = detection.median_of_beams;
    if beams > 0 && beams.is_multiple_of(2) {
        found.add(
            &path.key("median_of_beams"),
            format_args!("is {beams}; a beam in the middle has as many neighbors on either side"),
            format!("use {} or {}, or 0 for no smoothing", beams - 1, beams + 1),
        );
    }
    if detection.intensity.is_some() && detection.threshold_reflectivity == 0.0 {
        found.add(
            &path.key("intensity"),
            "counts from the threshold, and `detection.threshold_reflectivity` is 0: there is none",
            "give `detection.threshold_reflectivity` more than 0, or omit `detection.intensity`".to_owned(),
        );
    }
    let limits = scene.scanner.limits();
    if detection.echo == EchoChoice::All && limits.echoes < 2 {
        let several = (Preset::ALL.into_iter())
            .filter(|preset| preset.limits().echoes > 1)
            .map(|preset| format!("{:?}", preset.name()));
        let several: Vec<String> = several.collect();
        found.add(
            &path.key("echo"),
            format_args!(
                "is \"all\", but the scanner {:?} reports only one echo",
                scene.scanner.preset.name()
            ),
            format!(
                "use the preset {}, or \"custom\" with `scanner.custom.echoes`",
                several.join(" or ")
            ),
        );
    }
    let own_markers = scene.mocap.profile == MocapProfile::Custom;
    if own_markers != scene.mocap.marker.is_some() {
        let (what, remedy) = if own_markers {
            (
                "is \"custom\", whose errors must be given in the scene",
                "add marker = { constant_sd_mm = …, jitter_sd_mm = … } to [mocap]",
            )
        } else {
            (
                "has its own errors, but `mocap.marker` is given",
                "omit `mocap.marker`, or set the profile to \"custom\"",
            )
        };
        found.add(&KeyPath::of("mocap").key("profile"), what, remedy.to_owned());
    }
    let custom = scene.scanner.preset == Preset::Custom;
    let path = KeyPath::of("scanner");
    if custom && scene.scanner.beam.is_none() {
        found.add(
            &path.key("preset"),
            "is \"custom\", whose beam must be given in the scene",
            "add a table [scanner.beam] with wide_full_mrad and narrow_full_mrad".to_owned(),
        );
    }
    if !custom && scene.scanner.custom.is_some() {
        found.add(
            &path.key("custom"),
            format_args!(
                "is given, but the preset {:?} has its own limits",
                scene.scanner.preset.name()
            ),
            "omit it, or set `scanner.preset` to \"custom\"".to_owned(),
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

pub(super) fn columns(range_m: &[f64], values: &[f64], path: &KeyPath, column: &str, found: &mut Findings) {
    increasing(("range_m", " m", range_m), values, path, column, found);
    let path = path.key("range_m");
    if let Some(first) = range_m.first().filter(|r| **r < 0.0) {
        found.add(
            &path.index(0),
            format_args!("is {first} m; a distance must be 0 or more"),
            None,
        );
    }
}

/// Checks a column of nodes (its name, unit and values) and a column of values: equally long, the nodes strictly
/// increasing.
pub(super) fn increasing(
    (name, unit, nodes): (&str, &str, &[f64]),
    values: &[f64],
    path: &KeyPath,
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

/// Checks shares that must not be zero, which would leave nothing to detect.
fn shares(scene: &Scene, found: &mut Findings) {
    let light = KeyPath::of("light");
    for (path, value) in [
        (light.key("optics_transmission"), scene.light.optics_transmission),
        (light.key("air_transmission"), scene.light.air_transmission),
        (
            KeyPath::of("detection").key("threshold_reflectivity"),
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

fn order(limits: &[f64; 2], path: &KeyPath, unit: &str, found: &mut Findings) {
    let [low, high] = limits;
    if low > high {
        found.add(
            path,
            format_args!("runs from {low}{unit} down to {high}{unit}"),
            format!("write the smaller one first: [{high}, {low}]"),
        );
    }
}
