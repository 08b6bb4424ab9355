//! Polygons as triangles: convex ones as a fan, concave ones by clipping ears in their plane (Meisters, "Polygons have
//! ears", 1975). A concave polygon that is not flat, or crosses itself, encloses no surface that everybody agrees on, and is
//! refused.

use nalgebra::{Point2, Point3, Vector3};

/// Largest distance of a corner of a concave polygon from its plane, as a fraction of its extent: what the six digits of a
/// text file leave of a plane face, with a margin.
const FLATNESS: f64 = 1e-3;

/// Area below which a polygon has none, as a fraction of its squared extent.
const LITTLE: f64 = 1e-12;

/// Largest number of corners of a concave polygon, whose edges are compared in pairs.
const MOST_CORNERS: usize = 5000;

/// Splits a polygon, given by indices of vertices that exist, into triangles with its corners and its sense.
///
/// # Errors
/// What is wrong with it.
pub(super) fn triangles(corners: &[u32], vertices: &[Point3<f64>]) -> Result<Vec<[u32; 3]>, String> {
    let places: Vec<Point3<f64>> = corners.iter().map(|c| vertices[*c as usize]).collect();
    let normal = area_vector(&places);
    let fan = || {
        let pairs = corners.windows(2).skip(1);
        Ok(pairs.map(|pair| [corners[0], pair[0], pair[1]]).collect())
    };
    if corners.len() == 3 {
        return fan();
    }
    let extent = places.iter().map(|p| (p - places[0]).norm()).fold(0.0, f64::max);
    // Without area, or next to none, it has no side to be hit, unless its parts have turned against each other.
    if normal.norm() <= LITTLE * extent * extent {
        let (_, of_part) = (2..places.len())
            .map(|k| (places[k - 1] - places[0]).cross(&(places[k] - places[0])))
            .map(|part| (part.norm(), part))
            .fold(
                (0.0, Vector3::zeros()),
                |most, part| if part.0 > most.0 { part } else { most },
            );
        if of_part.norm() > LITTLE * extent * extent && crosses_itself(&projected(&places, &of_part)) {
            return Err("a face crosses itself, so that its surface is undefined".to_owned());
        }
        return fan();
    }
    if !normal.norm().is_finite() {
        return fan();
    }
    let flat = projected(&places, &normal);
    if is_convex(&flat) {
        return fan();
    }
    if corners.len() > MOST_CORNERS {
        return Err(format!(
            "a concave face has {} corners; {MOST_CORNERS} at most can be split",
            corners.len()
        ));
    }
    let unit = normal.normalize();
    let off = |p: &Point3<f64>| unit.dot(&(p - places[0])).abs();
    if places.iter().map(off).fold(0.0, f64::max) > FLATNESS * extent {
        return Err("a concave face is not flat, so that its surface is undefined".to_owned());
    }
    if crosses_itself(&flat) {
        return Err("a face crosses itself, so that its surface is undefined".to_owned());
    }
    clipped(&flat)
        .map(|found| found.into_iter().map(|t| t.map(|k| corners[k])).collect())
        .ok_or_else(|| "a face touches itself, so that its surface is undefined".to_owned())
}

/// Twice the vector area (Newell), relative to the first corner so that large coordinates cancel.
fn area_vector(places: &[Point3<f64>]) -> Vector3<f64> {
    let seen: Vec<Vector3<f64>> = places.iter().map(|p| p - places[0]).collect();
    let next = seen.iter().cycle().skip(1);
    seen.iter().zip(next).map(|(a, b)| a.cross(b)).sum()
}

/// The corners without the coordinate along which the polygon faces most; counterclockwise.
fn projected(places: &[Point3<f64>], normal: &Vector3<f64>) -> Vec<Point2<f64>> {
    let axis = normal.iamax();
    let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
    if normal[axis] < 0.0 {
        std::mem::swap(&mut u, &mut v);
    }
    let seen = places.iter().map(|p| p - places[0]);
    seen.map(|p| Point2::new(p[u], p[v])).collect()
}

/// Twice the signed area of a triangle: positive if it turns left.
fn turn(a: &Point2<f64>, b: &Point2<f64>, c: &Point2<f64>) -> f64 {
    (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x)
}

/// Whether all corners turn left, and all of them together once around.
fn is_convex(flat: &[Point2<f64>]) -> bool {
    let count = flat.len();
    let at = |k: usize| &flat[k % count];
    let extent = flat.iter().map(|p| p.coords.amax()).fold(0.0, f64::max);
    // Corners on a straight edge are off it by rounding.
    let slack = 1e-9 * extent * extent;
    let left = (0..count).all(|k| turn(at(k), at(k + 1), at(k + 2)) >= -slack);
    let rises: Vec<bool> = (0..count)
        .map(|k| at(k + 1).y - at(k).y)
        .filter(|rise| *rise != 0.0)
        .map(|rise| rise > 0.0)
        .collect();
    let changes = rises
        .iter()
        .zip(rises.iter().cycle().skip(1))
        .filter(|(a, b)| a != b)
        .count();
    left && changes <= 2
}

/// Whether two edges that are not neighbors cross.
fn crosses_itself(flat: &[Point2<f64>]) -> bool {
    let count = flat.len();
    let at = |k: usize| &flat[k % count];
    (0..count).any(|i| {
        let (a, b) = (at(i), at(i + 1));
        (i + 2..count).filter(|j| (j + 1) % count != i).any(|j| {
            let (c, d) = (at(j), at(j + 1));
            let apart = |p: f64, q: f64| p > 0.0 && q < 0.0 || p < 0.0 && q > 0.0;
            apart(turn(a, b, c), turn(a, b, d)) && apart(turn(c, d, a), turn(c, d, b))
        })
    })
}

/// The triangles of a simple polygon, by indices of its corners; `None` if no ear is left.
fn clipped(flat: &[Point2<f64>]) -> Option<Vec<[usize; 3]>> {
    let mut left: Vec<usize> = (0..flat.len()).collect();
    let mut found = Vec::with_capacity(flat.len() - 2);
    while left.len() > 3 {
        let count = left.len();
        let around = |k: usize| [left[(k + count - 1) % count], left[k], left[(k + 1) % count]];
        let ear = (0..count).find(|k| is_ear(flat, &left, around(*k)));
        // A corner on a straight edge has no area to clip.
        let straight = || (0..count).find(|k| turns(flat, around(*k)) == 0.0);
        let clip = match ear {
            Some(ear) => {
                found.push(around(ear));
                ear
            }
            None => straight()?,
        };
        left.remove(clip);
    }
    if turns(flat, [left[0], left[1], left[2]]) > 0.0 {
        found.push([left[0], left[1], left[2]]);
    }
    Some(found)
}

fn turns(flat: &[Point2<f64>], [a, b, c]: [usize; 3]) -> f64 {
    turn(&flat[a], &flat[b], &flat[c])
}

/// Whether a corner turns left, and no other corner is in its triangle.
fn is_ear(flat: &[Point2<f64>], left: &[usize], [a, b, c]: [usize; 3]) -> bool {
    if turns(flat, [a, b, c]) <= 0.0 {
        return false;
    }
    let corners = [flat[a], flat[b], flat[c]];
    let inside = |k: &&usize| {
        let p = flat[**k];
        // A corner at the same place touches, and is not in the way.
        !corners.contains(&p)
            && turn(&corners[0], &corners[1], &p) >= 0.0
            && turn(&corners[1], &corners[2], &p) >= 0.0
            && turn(&corners[2], &corners[0], &p) >= 0.0
    };
    !left.iter().any(|k| inside(&k))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn place(flat: &[[f64; 2]]) -> Vec<Point3<f64>> {
        flat.iter()
            .map(|[x, y]| Point3::new(*x, *y, 0.5 * x - 0.25 * y + 3.0))
            .collect()
    }

    fn split(flat: &[[f64; 2]]) -> Result<Vec<[u32; 3]>, String> {
        let corners: Vec<u32> = (0..u32::try_from(flat.len()).expect("few")).collect();
        triangles(&corners, &place(flat))
    }

    /// Whether a point is inside a polygon, by the parity of the edges to its right.
    fn is_inside(flat: &[[f64; 2]], [x, y]: [f64; 2]) -> bool {
        let next = flat.iter().cycle().skip(1);
        let crossed = flat.iter().zip(next).filter(|([ax, ay], [bx, by])| {
            (ay > &y) != (by > &y) && x < (bx - ax) * (y - ay) / (by - ay) + ax
        });
        crossed.count() % 2 == 1
    }

    fn covering(flat: &[[f64; 2]], found: &[[u32; 3]], [x, y]: [f64; 2]) -> usize {
        let p = Point2::new(x, y);
        let corner = |k: u32| Point2::from(flat[k as usize]);
        let holds = |t: &&[u32; 3]| {
            let [a, b, c] = t.map(corner);
            turn(&a, &b, &p) > 0.0 && turn(&b, &c, &p) > 0.0 && turn(&c, &a, &p) > 0.0
        };
        found.iter().filter(holds).count()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]

        /// Stars about the origin, concave almost always, are covered once inside and not at all outside.
        #[test]
        fn stars_are_covered_as_the_parity_of_crossings_says(
            radii in prop::collection::vec(0.1_f64..1.0, 4..40), points in prop::collection::vec([-1.0_f64..1.0, -1.0_f64..1.0], 50)
        ) {
            let angle = |k: usize| std::f64::consts::TAU * k as f64 / radii.len() as f64;
            let star: Vec<[f64; 2]> =
                radii.iter().enumerate().map(|(k, r)| [r * libm::cos(angle(k)), r * libm::sin(angle(k))]).collect();
            let found = split(&star).expect("it is simple");
            prop_assert_eq!(found.len(), star.len() - 2);
            for point in points {
                prop_assert_eq!(covering(&star, &found, point), usize::from(is_inside(&star, point)));
            }
        }

        #[test]
        fn convex_polygons_are_fans(count in 3_usize..30, turned in 0.0_f64..6.0) {
            let angle = |k: usize| turned + std::f64::consts::TAU * k as f64 / count as f64;
            let flat: Vec<[f64; 2]> = (0..count).map(|k| [libm::cos(angle(k)), libm::sin(angle(k))]).collect();
            let found = split(&flat).expect("it is convex");
            prop_assert!(found.iter().enumerate().all(|(k, t)| t[0] == 0 && t[1] as usize == k + 1));
        }
    }

    #[test]
    fn the_notch_of_a_u_stays_open() {
        let u = [
            [0.0, 0.0],
            [6.0, 0.0],
            [6.0, 4.0],
            [4.0, 4.0],
            [4.0, 1.0],
            [2.0, 1.0],
            [2.0, 4.0],
            [0.0, 4.0],
        ];
        let found = split(&u).expect("it is simple");
        assert_eq!(covering(&u, &found, [3.0, 2.5]), 0);
        assert_eq!(covering(&u, &found, [1.01, 2.52]), 1);
        // The other sense gives the same surface, seen from behind.
        let mut reversed = u;
        reversed.reverse();
        assert_eq!(split(&reversed).expect("simple").len(), found.len());
    }

    #[test]
    fn what_encloses_no_surface_is_refused() {
        // The two halves of a bow tie cancel.
        let tie = split(&[[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
        assert!(tie.is_err_and(|e| e.contains("crosses itself")));
        let bow = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 2.5]];
        assert!(split(&bow).expect_err("refused").contains("crosses itself"));
        let bent = [
            Point3::new(0.0, 0.0, 0.0),
            Point3::new(4.0, 0.0, 0.0),
            Point3::new(1.0, 1.0, 0.8),
            Point3::new(0.0, 4.0, 0.0),
        ];
        assert!(
            triangles(&[0, 1, 2, 3], &bent)
                .expect_err("refused")
                .contains("not flat")
        );
    }
}
