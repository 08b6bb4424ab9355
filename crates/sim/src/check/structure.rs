//! Checks of mirrors, posts and markers: whether each is a valid body, and whether light can reach it.

use super::findings::Findings;
use super::outline::{Face, Meets, Obstacles};
use super::values::distinct;
use crate::build::layout;
use crate::scene::{Facet, FacetShape, Marker, Plate, RectangleShape, Scanner, Scene, Wedge};
use catoptric_model::place::Path;
use catoptric_model::{ScanGeometry, beam};
use nalgebra::{Point3, Unit, Vector3};

/// Corners closer than this coincide, and a polygon narrower than this is a line: no cutter is more precise. Corners
/// written to 0.01 mm lie in a plane to within this.
const CUTTING_ERROR_M: f64 = 1e-5;

/// Markers closer than this to one line do not determine the rotation about it: cameras locate a marker to a few tenths
/// of it.
const MARKER_SPREAD_M: f64 = 1e-3;

pub(super) fn check(scene: &Scene, scan: &ScanGeometry, found: &mut Findings) {
    let structure = Path::of("superstructure");
    if !scene.superstructure.pattern.is_empty() {
        found.add(
            &structure.key("pattern"),
            "has not been expanded into facets",
            "a scene read from a file is expanded; otherwise call `build::pattern::expand`".to_owned(),
        );
    }
    let obstacles = Obstacles::of(scene, scan);
    let met = obstacles.met_by_beams();
    for (i, facet) in scene.superstructure.facet.iter().enumerate() {
        let path = structure.key("facet").index(i).key("shape");
        let before = found.0.len();
        match &facet.shape {
            FacetShape::Wedge(wedge) => check_wedge(wedge, scan, &path.key("wedge"), found),
            FacetShape::Plate(plate) => check_plate(plate, scan, &path.key("plate"), found),
            FacetShape::Rectangle(shape) => check_rectangle(shape, scan, &path.key("rectangle"), found),
            FacetShape::Polygon(shape) => {
                let corners = layout::corners(&facet.shape, scan).unwrap_or_default();
                let path = path.key("polygon").key("corners_mm");
                if shape.corners_mm.len() >= 3 {
                    check_polygon(&corners, &path, found);
                }
            }
        }
        // For an invalid facet this would only repeat what has been reported.
        if found.0.len() == before
            && let Some(face) = &obstacles.facets[i]
        {
            check_reach(scene, scan, i, face, &met, found);
        }
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
    check_markers(&scene.superstructure.marker, &path, "the rig", found);
    for (i, board) in scene.board.iter().enumerate() {
        // Without any, the laboratory places five markers itself.
        if !board.marker.is_empty() {
            let path = Path::of("board").index(i).key("marker");
            check_markers(&board.marker, &path, &format!("board {:?}", board.name), found);
        }
    }
}

fn check_housing(scanner: &Scanner, found: &mut Findings) {
    let path = Path::of("scanner").key("housing_box");
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

fn check_wedge(wedge: &Wedge, scan: &ScanGeometry, path: &Path, found: &mut Findings) {
    let [first, last] = wedge.azimuth_deg;
    let azimuths = path.key("azimuth_deg");
    if first >= last {
        found.add(
            &azimuths,
            format_args!("runs from {first}° to {last}°; the smaller azimuth comes first"),
            (first > last).then(|| format!("write [{last}, {first}]")),
        );
        return;
    }
    if !covers(scan, first, last) {
        found.add(
            &azimuths,
            format_args!("is [{first}, {last}]°; {}", reach(scan)),
            "a mirror behind the scanner would get no light".to_owned(),
        );
        return;
    }
    let step_deg = scan.angles().step_deg;
    if last - first < step_deg {
        let radians = last.abs().max(first.abs()) <= std::f64::consts::PI;
        let in_degrees = || {
            let [a, b] = [first, last].map(|v| rounded(v.to_degrees()));
            format!("angles are in degrees; if these were radians, write [{a}, {b}]")
        };
        found.add(
            &azimuths,
            format_args!(
                "spans {}°; a mirror needs at least the {}° between two beams",
                rounded(last - first),
                rounded(step_deg)
            ),
            radians.then(in_degrees),
        );
        return;
    }
    if layout::corners(&FacetShape::Wedge(wedge.clone()), scan).is_none() {
        let middle = 0.5 * (first + last);
        let u = beam::direction(middle.to_radians());
        let v = beam::spherical(
            wedge.exit_azimuth_deg.to_radians(),
            wedge.exit_elevation_deg.to_radians(),
        );
        let turn = beam::angle_between(&u, &v).to_degrees();
        found.add(
            path,
            format_args!(
                "describes no mirror: turning the beam at {middle}° by {}° needs a plane that not all beams \
                 from {first}° to {last}° hit",
                rounded(turn)
            ),
            "turn the beam farther, narrow azimuth_deg or lower height_mm".to_owned(),
        );
    }
}

fn check_plate(plate: &Plate, scan: &ScanGeometry, path: &Path, found: &mut Findings) {
    match (plate.azimuth_deg, plate.beam) {
        (Some(_), Some(_)) => found.add(
            &path.key("beam"),
            "names a beam, and `azimuth_deg` names another",
            "delete one of the two".to_owned(),
        ),
        (None, Some(beam)) if beam as usize >= scan.beams() => {
            found.add(
                &path.key("beam"),
                format_args!("is {beam}; 0 to {} is allowed", scan.beams() - 1),
                None,
            );
            return;
        }
        (None, None) => found.add(
            path,
            "does not name the beam that hits its center",
            "set azimuth_deg or beam".to_owned(),
        ),
        _ => {}
    }
    let exit = [plate.exit_azimuth_deg, plate.exit_elevation_deg];
    let normal = [plate.normal_azimuth_deg, plate.normal_elevation_deg];
    let given = |angles: &[Option<f64>; 2]| angles.iter().flatten().count();
    if !matches!((given(&exit), given(&normal)), (2, 0) | (0, 2)) {
        found.add(
            path,
            "needs exactly one direction, but has none, half of one, or two",
            "set exit_azimuth_deg and exit_elevation_deg, or normal_azimuth_deg and normal_elevation_deg"
                .to_owned(),
        );
        return;
    }
    let one_beam = plate.azimuth_deg.is_some() != plate.beam.is_some();
    match layout::corners(&FacetShape::Plate(plate.clone()), scan) {
        Some(corners) => {
            let help = "reverse the normal: it points from the mirror toward the scanner's side";
            check_side(&corners, path, help, found);
        }
        None if one_beam => found.add(
            path,
            "describes no mirror: its beam leaves undeflected",
            "turn exit_azimuth_deg or exit_elevation_deg away from the beam".to_owned(),
        ),
        None => {}
    }
}

fn check_rectangle(shape: &RectangleShape, scan: &ScanGeometry, path: &Path, found: &mut Findings) {
    let Some(corners) = layout::corners(&FacetShape::Rectangle(shape.clone()), scan) else {
        let path = path.key("normal");
        found.add(
            &path,
            "has length 0; a normal of any other length is allowed",
            None,
        );
        return;
    };
    let help = "reverse the normal: it points from the mirror toward the scanner's side";
    check_side(&corners, &path.key("normal"), help, found);
}

fn check_polygon(corners: &[Point3<f64>], path: &Path, found: &mut Findings) {
    if !check_outline(corners, path, found) {
        return;
    }
    let help = "list the corners in the opposite order: counter-clockwise seen from the scanner's side";
    check_side(corners, path, help, found);
}

/// Checks that corners outline a convex plane polygon, and returns whether they do.
pub(super) fn check_outline(corners: &[Point3<f64>], path: &Path, found: &mut Findings) -> bool {
    let count = distinct_points(corners);
    if count < 3 {
        found.add(
            path,
            format_args!("has {count} different corners; at least 3 are needed"),
            None,
        );
        return false;
    }
    if spread(corners) < CUTTING_ERROR_M {
        found.add(
            path,
            format_args!(
                "lists {} corners on one line; a mirror needs corners that span a plane",
                corners.len()
            ),
            "move at least one corner off the line".to_owned(),
        );
        return false;
    }
    let area = catoptric_cast::area_vector(corners);
    // The two lobes of a bow tie cancel; the rounding error that remains has no direction.
    let Some(normal) = Unit::try_new(area, CUTTING_ERROR_M * spread(corners)) else {
        found.add(
            path,
            "crosses itself; list the corners in order around the mirror",
            None,
        );
        return false;
    };
    let center = corners.iter().map(|c| c.coords).sum::<Vector3<f64>>() / corners.len() as f64;
    let off_plane = |c: &Point3<f64>| normal.dot(&(c.coords - center)).abs();
    let worst = corners.iter().map(off_plane).fold(0.0, f64::max);
    if worst > CUTTING_ERROR_M {
        found.add(
            path,
            format_args!(
                "lists corners that are {} mm off one plane; {} mm is allowed",
                rounded(worst * 1e3),
                CUTTING_ERROR_M * 1e3
            ),
            "mirrors are flat; three corners always lie in a plane".to_owned(),
        );
        return false;
    }
    if let Some(corner) = outside_corner(corners, &normal) {
        found.add(
            &path.index(corner),
            "makes the outline concave, or is out of order; the corners must form a convex polygon",
            "describe a concave mirror as two convex facets".to_owned(),
        );
        return false;
    }
    true
}

/// A corner at which the outline is not convex: one where it turns in the wrong direction, or else one on the wrong
/// side of some edge. A convex polygon that winds around once has neither.
fn outside_corner(corners: &[Point3<f64>], normal: &Unit<Vector3<f64>>) -> Option<usize> {
    let n = corners.len();
    let outside = |corner: usize, edge: usize| {
        let (a, b) = (corners[edge], corners[(edge + 1) % n]);
        Unit::try_new(normal.cross(&(b - a)), CUTTING_ERROR_M)
            .is_some_and(|inward| inward.dot(&(corners[corner] - a)) < -CUTTING_ERROR_M)
    };
    let turns_back = |c: &usize| outside((*c + 1) % n, (*c + n - 1) % n);
    (0..n)
        .find(turns_back)
        .or_else(|| (0..n).find(|c| (0..n).any(|edge| outside(*c, edge))))
}

/// Checks that the scanner is on the reflecting side.
fn check_side(corners: &[Point3<f64>], path: &Path, help: &str, found: &mut Findings) {
    let Some(face) = Face::new(corners.to_vec()) else {
        return;
    };
    if face.plane.offset.abs() < CUTTING_ERROR_M {
        found.add(
            path,
            "puts the mirror's plane through the origin of the scanner, which sees it edge-on",
            "move the mirror off the origin".to_owned(),
        );
    } else if face.plane.offset > 0.0 {
        found.add(
            path,
            "makes the reflecting side face away from the scanner",
            help.to_owned(),
        );
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
    let path = Path::of("superstructure").key("facet").index(index);
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

fn check_markers(markers: &[Marker], path: &Path, body: &str, found: &mut Findings) {
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

fn distinct_points(points: &[Point3<f64>]) -> usize {
    let mut seen: Vec<&Point3<f64>> = Vec::new();
    for p in points {
        if seen.iter().all(|s| (*s - p).norm() > CUTTING_ERROR_M) {
            seen.push(p);
        }
    }
    seen.len()
}

/// Largest distance of a point from the line through the two that are farthest apart, in meters.
fn spread(points: &[Point3<f64>]) -> f64 {
    let pairs = points
        .iter()
        .enumerate()
        .flat_map(|(i, a)| points[..i].iter().map(move |b| (a, b)));
    let longest = pairs.max_by(|x, y| (x.0 - x.1).norm().total_cmp(&(y.0 - y.1).norm()));
    let line = longest.and_then(|(a, b)| Some((a, Unit::try_new(b - a, f64::MIN_POSITIVE)?)));
    let Some((start, along)) = line else {
        return 0.0;
    };
    points
        .iter()
        .map(|p| (p - start).cross(&along).norm())
        .fold(0.0, f64::max)
}

fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// Whether a scan sees everything from one azimuth to another, in degrees, the smaller first.
fn covers(scan: &ScanGeometry, first: f64, last: f64) -> bool {
    let [low, high] = scan.range_deg();
    let around = |turn: f64| low <= first + turn && last + turn <= high;
    scan.closes() || [-360.0, 0.0, 360.0].into_iter().any(around)
}

/// The extent of a scan as text.
pub(super) fn reach(scan: &ScanGeometry) -> String {
    let [low, high] = scan.range_deg().map(rounded);
    format!("the scan reaches from {low}° to {high}°")
}

/// Three decimals: as much as a message needs.
pub(super) fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
