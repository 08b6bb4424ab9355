//! What outlines of plane mirrors share: rectangles, and the checks of corners.

use crate::findings::Findings;
use catoptric_cast::area_vector;
use catoptric_model::place::KeyPath;
use catoptric_model::{MirrorPlane, ScanGeometry};
use nalgebra::{Point3, Unit, Vector3};

/// Corners closer than this coincide, and a polygon narrower than this is a line: no cutter is more precise. Corners
/// written to 0.01 mm lie in a plane to within this.
pub(crate) const CUTTING_ERROR_M: f64 = 1e-5;

/// Corners of a rectangle whose width is horizontal, in meters; `None` for a zero-length normal.
pub(crate) fn rectangle(
    center: Point3<f64>,
    normal: Vector3<f64>,
    [width, height]: [f64; 2],
) -> Option<Vec<Point3<f64>>> {
    let m = Unit::try_new(normal, f64::MIN_POSITIVE)?;
    // A mirror parallel to the scan plane has no distinguished horizontal side; use x.
    let across = Unit::try_new(Vector3::z().cross(&m), 1e-9).unwrap_or(Vector3::x_axis());
    let along = m.cross(&across);
    let (x, y) = (across.into_inner() * (0.5 * width), along * (0.5 * height));
    Some(vec![
        center - x - y,
        center + x - y,
        center + x + y,
        center - x + y,
    ])
}

/// Checks that corners outline a convex plane polygon, and returns whether they do.
pub(crate) fn check_outline(corners: &[Point3<f64>], path: &KeyPath, found: &mut Findings) -> bool {
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
    let area = area_vector(corners);
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
pub(crate) fn check_side(corners: &[Point3<f64>], path: &KeyPath, help: &str, found: &mut Findings) {
    let normal = Unit::try_new(area_vector(corners), f64::MIN_POSITIVE);
    let (Some(corner), Some(normal)) = (corners.first(), normal) else {
        return;
    };
    let offset = MirrorPlane::through(*corner, normal).offset;
    if offset.abs() < CUTTING_ERROR_M {
        found.add(
            path,
            "puts the mirror's plane through the origin of the scanner, which sees it edge-on",
            "move the mirror off the origin".to_owned(),
        );
    } else if offset > 0.0 {
        found.add(
            path,
            "makes the reflecting side face away from the scanner",
            help.to_owned(),
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
pub(crate) fn spread(points: &[Point3<f64>]) -> f64 {
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

/// Whether a scan sees everything from one azimuth to another, in degrees, the smaller first.
pub(crate) fn covers(scan: &ScanGeometry, first: f64, last: f64) -> bool {
    let [low, high] = scan.range_deg();
    let around = |turn: f64| low <= first + turn && last + turn <= high;
    scan.closes() || [-360.0, 0.0, 360.0].into_iter().any(around)
}

/// The extent of a scan as text.
pub(crate) fn reach(scan: &ScanGeometry) -> String {
    let [low, high] = scan.range_deg().map(rounded);
    format!("the scan reaches from {low}° to {high}°")
}

/// Three decimals: as much as a message needs.
pub(crate) fn rounded(value: f64) -> f64 {
    // Adding zero turns −0 into 0.
    (value * 1e3).round() / 1e3 + 0.0
}
