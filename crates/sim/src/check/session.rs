//! Checks of the table `[session]`: what it names exists, and what is laid over is a session in the end.

use super::values::{columns, increasing};
use crate::build::board::board_markers;
use crate::findings::{Findings, suggestion};
use crate::scene::{BeliefsOverlay, MarkerOverlay, NoiseOverlay, RangeBiasOverlay, Scene};
use catoptric_model::ScanGeometry;
use catoptric_model::place::KeyPath;

/// Largest deviation of a quaternion's length from 1 that counts as rounding.
const ROUNDED_QUATERNION: f64 = 1e-3;

pub(super) fn check(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let over = &scene.session;
    let root = KeyPath::of("session");
    if over.name.as_ref().is_some_and(|name| name.trim().is_empty()) {
        found.add(
            &root.key("name"),
            "is empty; a name needs at least one letter",
            None,
        );
    }
    check_scanner(scene, scan, &root.key("scanner"), found);
    check_beliefs(&over.believed, &root.key("believed"), found);
    check_bare(scene, scan, &root.key("bare_structure"), found);
    if let Some(q) = &over.nominal_rig_from_sensor.rotation_xyzw {
        let length = q.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > ROUNDED_QUATERNION {
            found.add(
                &root.key("nominal_rig_from_sensor").key("rotation_xyzw"),
                format_args!("has the length {length:.4}; a rotation is a unit quaternion"),
                None,
            );
        }
    }
    let room = &over.room;
    if !scene.room.has_walls() && *room != Default::default() {
        found.add(
            &root.key("room"),
            "is given, but the scene has no walls to survey",
            "give `room.size_m`, or leave this out".to_owned(),
        );
    }
    let [x, y, z] = scene.room.size_m;
    let low = room.min_m.unwrap_or([-0.5 * x, -0.5 * y, 0.0]);
    let high = room.max_m.unwrap_or([0.5 * x, 0.5 * y, z]);
    if scene.room.has_walls() && (0..3).any(|axis| low[axis] >= high[axis]) {
        let key = if room.max_m.is_some() { "max_m" } else { "min_m" };
        found.add(
            &root.key("room").key(key),
            format_args!("leaves no room: it reaches from {low:?} to {high:?} m"),
            None,
        );
    }
    named(scene, &root, found);
}

/// Checks the names of list entries.
fn named(scene: &Scene, root: &KeyPath, found: &mut Findings) {
    let over = &scene.session;
    let structure = &scene.superstructure;
    let rig: Vec<&str> = structure.marker.iter().map(|m| m.name.as_str()).collect();
    markers(&over.rig_markers, &rig, &root.key("rig_markers"), found);
    let facets: Vec<&str> = structure.facet.iter().map(|f| f.name.as_str()).collect();
    let boards: Vec<&str> = scene.board.iter().map(|b| b.name.as_str()).collect();
    let of_facets = over.facets.iter().map(|f| f.name.as_str());
    known(of_facets, "facets", &facets, &root.key("facets"), found);
    let of_boards = over.boards.iter().map(|b| b.name.as_str());
    known(of_boards, "boards", &boards, &root.key("boards"), found);
    for (i, board) in over.boards.iter().enumerate() {
        let (Some(of_board), Some(list)) =
            (scene.board.iter().find(|b| b.name == board.name), &board.markers)
        else {
            continue;
        };
        let drawn = board_markers(of_board);
        let names: Vec<&str> = drawn.iter().map(|m| m.name.as_str()).collect();
        markers(list, &names, &root.key("boards").index(i).key("markers"), found);
    }
}

fn markers(list: &[MarkerOverlay], names: &[&str], path: &KeyPath, found: &mut Findings) {
    known(
        list.iter().map(|m| m.name.as_str()),
        "markers",
        names,
        path,
        found,
    );
}

/// Checks that every entry of a list is laid over one that there is.
fn known<'a>(
    given: impl Iterator<Item = &'a str>,
    what: &str,
    names: &[&str],
    path: &KeyPath,
    found: &mut Findings,
) {
    for (i, name) in given.enumerate() {
        if !names.contains(&name) {
            found.add(
                &path.index(i).key("name"),
                format_args!("is {name:?}, which is not among the session's {what}"),
                suggestion(name, what, names.iter().copied()),
            );
        }
    }
}

fn check_scanner(scene: &Scene, scan: &ScanGeometry, path: &KeyPath, found: &mut Findings) {
    let over = &scene.session.scanner;
    match over.scan_over(scan) {
        Err(error) => found.add(&path.key(error.key), error.problem, None),
        Ok(believed) if believed.beams() != scan.beams() => found.add(
            &path.key("beams"),
            format_args!(
                "is {}, but the scanner records {}",
                believed.beams(),
                scan.beams()
            ),
            None,
        ),
        Ok(_) => {}
    }
    let limits = scene.scanner.limits();
    let least = over.range_min_m.unwrap_or(limits.range_min_m);
    let most = over.range_max_m.unwrap_or(limits.range_max_m);
    if least >= most {
        let key = if over.range_max_m.is_some() {
            "range_max_m"
        } else {
            "range_min_m"
        };
        found.add(
            &path.key(key),
            format_args!("leaves no range: from {least} m to {most} m"),
            None,
        );
    }
}

fn check_beliefs(over: &BeliefsOverlay, path: &KeyPath, found: &mut Findings) {
    if let Some(noise) = &over.noise {
        check_noise(noise, &path.key("noise"), found);
    }
    for (color, noise) in over.noise_of.iter().flatten() {
        check_noise(noise, &path.key("noise_of").key(color), found);
    }
    let Some(RangeBiasOverlay { distance, angle, .. }) = &over.bias else {
        return;
    };
    let path = path.key("bias");
    if let Some(table) = distance {
        let place = path.key("distance");
        if let Some((x, y)) = both(
            &table.range_m,
            &table.error_mm,
            "range_m",
            "error_mm",
            &place,
            found,
        ) {
            columns(x, y, &place, "error_mm", found);
        }
    }
    if let Some(table) = angle.as_ref().and_then(|a| a.table.as_ref()) {
        let place = path.key("angle").key("table");
        let pair = both(
            &table.incidence_deg,
            &table.error_mm,
            "incidence_deg",
            "error_mm",
            &place,
            found,
        );
        if let Some((x, y)) = pair {
            increasing(("incidence_deg", "°", x), y, &place, "error_mm", found);
        }
    }
}

fn check_noise(table: &NoiseOverlay, path: &KeyPath, found: &mut Findings) {
    if let Some((x, y)) = both(&table.range_m, &table.sd_mm, "range_m", "sd_mm", path, found) {
        columns(x, y, path, "sd_mm", found);
    }
}

/// Both columns of a table, which belong together.
fn both<'t>(
    x: &'t Option<Vec<f64>>,
    y: &'t Option<Vec<f64>>,
    x_key: &str,
    y_key: &str,
    path: &KeyPath,
    found: &mut Findings,
) -> Option<(&'t [f64], &'t [f64])> {
    let missing = match (x, y) {
        (Some(x), Some(y)) => return Some((x, y)),
        (None, Some(_)) => x_key,
        (Some(_), None) => y_key,
        (None, None) => return None,
    };
    found.add(
        path,
        format_args!("is given without `{missing}`"),
        format!("a table needs both `{x_key}` and `{y_key}`"),
    );
    None
}

fn check_bare(scene: &Scene, scan: &ScanGeometry, path: &KeyPath, found: &mut Findings) {
    let over = &scene.session.bare_structure;
    let first = over.first_beam.unwrap_or(0);
    let count = over.distance_m.as_ref().map_or(0, Vec::len);
    if first + count > scan.beams() {
        let key = if over.distance_m.is_some() {
            "distance_m"
        } else {
            "first_beam"
        };
        found.add(
            &path.key(key),
            format_args!(
                "reaches to beam {}, but the scanner has {}",
                first + count,
                scan.beams()
            ),
            None,
        );
    }
}
