//! Checks of mirrors, posts and markers: whether each is a valid body, and whether light can reach it.

use super::outline::{Face, Meets, Obstacles};
use super::overlap;
use super::spot;
use super::values::distinct;
use crate::findings::Findings;
use crate::scene::facet::outline::{reach, rounded, spread};
use crate::scene::{Facet, Marker, Scanner, Scene};
use catoptric_model::place::KeyPath;
use catoptric_model::{ScanGeometry, beam};
use nalgebra::{Point3, Vector3};

/// Markers closer than this to one line do not determine the rotation about it: cameras locate a marker to a few tenths
/// of it.
const MARKER_SPREAD_M: f64 = 1e-3;

pub(super) fn check(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let structure = KeyPath::of("superstructure");
    if !scene.superstructure.pattern.is_empty() {
        found.add(
            &structure.key("pattern"),
            "has not been expanded into facets",
            "a scene read from a file is expanded; otherwise call `build::pattern::expand`".to_owned(),
        );
    }
    let obstacles = Obstacles::of(scene, scan);
    let before = found.0.len();
    for (i, facet) in scene.superstructure.facet.iter().enumerate() {
        let path = structure.key("facet").index(i);
        let faults = found.0.len();
        facet.shape.check(scan, &path.key("shape"), found);
        if found.0.len() == faults {
            facet.check_bend(&scene.superstructure.mirror, scan, &path, found);
        }
    }
    let curved = scene.superstructure.facet.iter().find(|f| f.curve.is_some());
    if let Some(facet) = curved.filter(|_| scene.light.vignetting) {
        found.add(
            &KeyPath::of("light").key("vignetting"),
            format_args!(
                "is set, but facet {:?} has a `curve`; the outlines through which the lens looks are those of flat mirrors",
                facet.name
            ),
            "omit one of the two".to_owned(),
        );
    }
    // Of an invalid facet this would only repeat what has been reported.
    if found.0.len() == before {
        overlap::check(scene, &obstacles, found);
    }
    for (i, post) in scene.superstructure.post.iter().enumerate() {
        let path = structure.key("post").index(i);
        match (&post.size_mm, &post.shape) {
            (None, None) => found.add(
                &path,
                "has neither `size_mm` nor `shape`",
                "give a box its size_mm, or a shape.cylinder or shape.mesh".to_owned(),
            ),
            (Some(_), Some(_)) => found.add(
                &path.key("size_mm"),
                "is the size of a box, but `shape` makes the post something else",
                "delete one of the two".to_owned(),
            ),
            _ => {}
        }
        if obstacles.post_holds_origin(i) {
            found.add(
                &structure.key("post").index(i).key("center_mm"),
                format_args!(
                    "puts post {:?} over the origin of the scanner; no beam could leave",
                    post.name
                ),
                None,
            );
        }
    }
    check_housing(&scene.scanner, found);
    let path = structure.key("marker");
    if !scene.only_shows_mirrors() {
        check_markers(&scene.superstructure.marker, &path, "the rig", found);
    }
    for (i, board) in scene.board.iter().enumerate() {
        // Without any, the laboratory places five markers itself.
        if !board.marker.is_empty() {
            let path = KeyPath::of("board").index(i).key("marker");
            check_markers(&board.marker, &path, &format!("board {:?}", board.name), found);
        }
    }
}

/// Warns of facets that no beam reaches, or none with all of its light.
pub(super) fn warn(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let obstacles = Obstacles::of(scene, scan);
    let met = obstacles.met_by_beams();
    for (i, face) in obstacles.facets.iter().enumerate() {
        if let Some(face) = face {
            check_reach(scene, scan, i, face, &met, found);
        }
    }
    spot::warn(scene, scan, &obstacles, &met, found);
}

fn check_housing(scanner: &Scanner, found: &mut Findings) {
    let path = KeyPath::of("scanner").key("housing_box");
    let boxes = scanner.housing_box.as_deref().unwrap_or_default();
    if !scanner.housing && !boxes.is_empty() {
        found.add(
            &path,
            "describes a housing, but `scanner.housing` is false",
            "delete one of the two".to_owned(),
        );
    }
    for (i, part) in boxes.iter().enumerate() {
        let holds = |axis: usize| part.center_mm[axis].abs() <= 0.5 * part.size_mm[axis];
        if holds(0) && holds(1) && holds(2) {
            found.add(
                &path.index(i).key("center_mm"),
                "puts a box of the housing over the origin of the scanner; no beam could leave",
                "the scan plane is z = 0: leave a window there".to_owned(),
            );
        }
    }
}

fn check_reach(
    scene: &Scene,
    scan: &ScanGeometry,
    index: usize,
    face: &Face,
    met: &[Option<Meets>],
    found: &mut Findings,
) {
    if met.contains(&Some(Meets::Facet(index))) {
        return;
    }
    let path = KeyPath::of("superstructure").key("facet").index(index);
    let name = |facet: &Facet| format!("{:?}", facet.name);
    let reached: Vec<usize> = (0..scan.beams())
        .filter(|i| face.distance(&beam::direction(scan.azimuth(*i))).is_some())
        .collect();
    if let Some(hider) = reached.iter().find_map(|i| met[*i]) {
        let hider = match hider {
            Meets::Facet(i) | Meets::Back(i) => {
                format!("facet {}", name(&scene.superstructure.facet[i]))
            }
            Meets::Post(i) => format!("post {:?}", scene.superstructure.post[i].name),
        };
        let message = format!("gets no light: all its beams end at {hider} before they reach it");
        found.add(&path, message, None);
        return;
    }
    let (low, high) = extent(face.corners.iter().map(|c| c.z * 1e3));
    if low > 0.0 || high < 0.0 {
        found.add(
            &path,
            format_args!(
                "is not reached by any beam: it lies between z = {} mm and {} mm, the scan plane is z = 0",
                rounded(low),
                rounded(high)
            ),
            None,
        );
        return;
    }
    let (low, high) = extent(face.corners.iter().map(|c| libm::atan2(c.y, c.x).to_degrees()));
    found.add(
        &path,
        format_args!(
            "is not reached by any beam: its corners are at azimuths {}° to {}°, {} in steps of {}°",
            rounded(low),
            rounded(high),
            reach(scan),
            rounded(scan.angles().step_deg)
        ),
        None,
    );
}

fn check_markers(markers: &[Marker], path: &KeyPath, body: &str, found: &mut Findings) {
    distinct(path, markers.iter().map(|m| m.name.as_str()), found);
    let points: Vec<Point3<f64>> = markers
        .iter()
        .map(|m| Point3::from(Vector3::from(m.position_mm) * 1e-3))
        .collect();
    if markers.len() < 3 {
        found.add(
            path,
            format_args!("gives {body} {} markers; at least 3 are needed", markers.len()),
            "three markers that are not on one line fix a pose; four or more survive a dropout".to_owned(),
        );
    } else if spread(&points) < MARKER_SPREAD_M {
        found.add(
            path,
            format_args!(
                "puts all markers of {body} within {} mm of one line; its rotation about that line cannot be determined",
                MARKER_SPREAD_M * 1e3
            ),
            "move at least one marker off the line".to_owned(),
        );
    }
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}
