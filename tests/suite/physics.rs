//! Closed-form scenes, and an oracle that never reflects a ray but unfolds the mirrors instead.
//!
//! These prove the geometry of the simulator and the readings of a detector. They do not prove that the error tables
//! are those of a real sensor; `paper` compares with those.

use crate::scenes::{BARE, scene, set_board_ahead};
use catoptric::cast::Ray;
use catoptric::cast::{Polygon, Shape};
use catoptric::model::{MirrorPlane, beam};
use catoptric::sim::build::Structure;
use catoptric::sim::build::color;
use catoptric::sim::light::{End, Mirrors, RayPath, Role, Setting, Target};
use catoptric::sim::noise::{Draws, Purpose};
use catoptric::sim::scene::{ErrorModel, Facet, FacetShape, PolygonShape};
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use nalgebra::{Matrix4, Point3, Unit, Vector3};

/// A direction drawn uniformly on the sphere.
fn random_direction(draws: &mut Draws) -> Unit<Vector3<f64>> {
    Unit::new_normalize(draws.normal3())
}

/// A convex quadrilateral around a point, its front facing the origin, rotated randomly by up to about 60°.
fn random_quad(draws: &mut Draws, center: Point3<f64>, size: f64) -> Vec<Point3<f64>> {
    let towards = -center.coords.normalize();
    let normal = Unit::new_normalize(towards + random_direction(draws).into_inner() * 0.8);
    let x = Unit::new_normalize(normal.cross(&random_direction(draws)));
    let y = normal.cross(&x);
    // Corners of increasing angle on a circle form a convex polygon.
    (0..4)
        .map(|k| {
            let angle = std::f64::consts::FRAC_PI_2 * (f64::from(k) + 0.8 * draws.uniform());
            center + (x.into_inner() * libm::cos(angle) + y * libm::sin(angle)) * size
        })
        .collect()
}

/// The intersection of a straight line from the origin with a polygon, by fans of triangles, and its clearance.
///
/// The clearance is the smallest distance of the point from the line of an edge, negative outside.
fn intersect(corners: &[Point3<f64>], direction: &Vector3<f64>) -> Option<(f64, f64)> {
    let normal = (corners[1] - corners[0])
        .cross(&(corners[2] - corners[0]))
        .normalize();
    let t = normal.dot(&corners[0].coords) / normal.dot(direction);
    if !t.is_finite() {
        return None;
    }
    let point = direction * t;
    let closed = corners.iter().zip(corners.iter().cycle().skip(1));
    let clearance = closed
        .map(|(a, b)| normal.dot(&(b - a).cross(&(point - a.coords))) / (b - a).norm())
        .fold(f64::INFINITY, f64::min);
    // An odd number of reflections reverses the order of the corners.
    let other = corners.iter().zip(corners.iter().cycle().skip(1));
    let reversed = other
        .map(|(a, b)| -normal.dot(&(b - a).cross(&(point - a.coords))) / (b - a).norm())
        .fold(f64::INFINITY, f64::min);
    Some((t, clearance.max(reversed)))
}

/// The reflection of space in a plane, as a matrix.
fn reflection(plane: &MirrorPlane) -> Matrix4<f64> {
    let n = plane.normal.into_inner();
    let mut m = Matrix4::identity();
    m.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(nalgebra::Matrix3::identity() - n * n.transpose() * 2.0));
    m.fixed_view_mut::<3, 1>(0, 3)
        .copy_from(&(n * (2.0 * plane.offset)));
    m
}

/// Follows a straight line through space unfolded at every mirror it crosses; returns the facets hit and the length.
///
/// `None` if a decision depends on less than `clear` meters.
fn unfold(
    facets: &[Vec<Point3<f64>>],
    board: &[Point3<f64>],
    direction: &Vector3<f64>,
    clear: f64,
) -> Option<(Vec<usize>, Option<f64>)> {
    let mut unfolded = Matrix4::identity();
    let (mut met, mut before) = (Vec::new(), 0.0);
    loop {
        let place = |corners: &[Point3<f64>]| -> Vec<Point3<f64>> {
            corners.iter().map(|c| unfolded.transform_point(c)).collect()
        };
        let mut nearest: Option<(f64, usize)> = None;
        for (index, corners) in facets.iter().map(Vec::as_slice).chain([board]).enumerate() {
            if met.last() == Some(&index) {
                continue;
            }
            let Some((t, clearance)) = intersect(&place(corners), direction) else {
                continue;
            };
            if t <= before {
                continue;
            }
            if clearance.abs() < clear {
                return None;
            }
            if clearance > 0.0 && nearest.is_none_or(|(best, _)| t < best) {
                nearest = Some((t, index));
            }
        }
        let Some((t, index)) = nearest else {
            return Some((met, None));
        };
        if index == facets.len() {
            return Some((met, Some(t)));
        }
        let corners = place(&facets[index]);
        let normal = Unit::new_normalize((corners[1] - corners[0]).cross(&(corners[2] - corners[0])));
        // The face is the side from which the corners are counterclockwise, in space mirrored `met.len()` times.
        let handed = if met.len() % 2 == 0 { 1.0 } else { -1.0 };
        if handed * normal.dot(direction) > 0.0 || met.len() == 4 {
            return Some((met, Some(t)));
        }
        unfolded = reflection(&MirrorPlane::through(corners[0], normal)) * unfolded;
        met.push(index);
        before = t;
    }
}

/// The traced path of a ray from the origin among facets and a board.
fn traced(
    facets: &[Vec<Point3<f64>>],
    board: &[Point3<f64>],
    direction: Unit<Vector3<f64>>,
) -> (RayPath, Vec<usize>) {
    let mut scene = scene(BARE);
    scene.superstructure.facet = facets
        .iter()
        .enumerate()
        .map(|(i, corners)| Facet {
            name: format!("facet-{i}"),
            curve: None,
            bow_um: 0.0,
            two_sided: false,
            reflectivity: None,
            coating: None,
            shape: FacetShape::Polygon(PolygonShape {
                corners_mm: corners.iter().map(|c| (c.coords * 1e3).into()).collect(),
            }),
        })
        .collect();
    let structure = Structure::nominal(&scene).expect("the facets are polygons");
    let target = Target {
        name: "board".to_owned(),
        shape: Shape::Polygon(Polygon::new(board.to_vec()).expect("the board has an area")),
        role: Role::Board,
        paint: color::paint(&scene, "white").expect("white is built in"),
    };
    let setting =
        Setting::new(&scene, &structure, Mirrors::Attached, vec![target]).expect("colors are built in");
    let path = setting.trace(&Ray {
        origin: Point3::origin(),
        direction,
    });
    let facets = path.facets().to_vec();
    (path, facets)
}

#[test]
fn unfolded_mirrors_agree_with_the_tracer() {
    let mut draws = Draws::new(11, Purpose::Placement, 0);
    let (mut compared, mut by_bounces, mut near_edges) = (0, [0; 6], 0);
    for shots in 0.. {
        if compared >= 10_000 {
            break;
        }
        let facets: Vec<_> = (0..1 + shots % 6)
            .map(|_| {
                let center =
                    Point3::from(random_direction(&mut draws).into_inner() * (0.06 + 0.04 * draws.uniform()));
                random_quad(&mut draws, center, 0.05)
            })
            .collect();
        let center = Point3::from(random_direction(&mut draws).into_inner() * (0.5 + 3.0 * draws.uniform()));
        let board = random_quad(&mut draws, center, 2.5);
        for shot in 0..8 {
            // Half of the rays pass an edge of the first facet at 1 mm down to 1 nm, on either side.
            let near_edge = shot % 2 == 1;
            let direction = if near_edge {
                let (a, b) = (facets[0][shot / 2 % 4], facets[0][(shot / 2 + 1) % 4]);
                let on_edge = a + (b - a) * draws.uniform();
                let aside = libm::pow(10.0, -3.0 - 6.0 * draws.uniform());
                Unit::new_normalize(on_edge.coords + random_direction(&mut draws).into_inner() * aside)
            } else {
                let inside = facets[0].iter().map(|c| c.coords).sum::<Vector3<f64>>() / 4.0;
                Unit::new_normalize(inside + draws.normal3() * 0.02)
            };
            // Millimeters in the scene file round the corners: edges closer than this are not decided.
            let Some((met, length)) = unfold(&facets, &board, &direction, 1e-12) else {
                continue;
            };
            if met.is_empty() && length.is_none() {
                continue;
            }
            let (path, facets_met) = traced(&facets, &board, direction);
            assert_eq!(facets_met, met, "facets met, in order");
            match (length, path.end) {
                (Some(expected), End::Hit(_)) => {
                    assert!(
                        (path.length - expected).abs() < 1e-12,
                        "{} against {expected}",
                        path.length
                    );
                }
                (Some(_), End::Trapped) => assert_eq!(met.len(), 4),
                (None, End::Escaped) => {}
                (expected, end) => panic!("unfolded {expected:?}, traced {end:?}"),
            }
            compared += 1;
            by_bounces[met.len().min(5)] += 1;
            near_edges += usize::from(near_edge);
        }
    }
    // The random scenes contain the intended cases.
    assert!(
        by_bounces[1] > 2000 && by_bounces[2] > 300 && by_bounces[3] > 20,
        "{by_bounces:?}"
    );
    assert!(near_edges > 2000, "{near_edges}");
}

/// A scene with one white board facing along −x at a distance in front of the scanner, recorded once.
fn board_ahead(distance: f64, mut edit: impl FnMut(&mut Scene)) -> Laboratory {
    let mut scene = scene(BARE);
    set_board_ahead(&mut scene, distance);
    scene.experiment.scans_per_pose = 5;
    scene.experiment.room_scans = 1;
    scene.experiment.bare_scans = 1;
    edit(&mut scene);
    Laboratory::new(&scene, 1).expect("the scene is valid")
}

/// Number of the stretch with the board.
const BOARD: usize = 2;

#[test]
fn a_45_degree_mirror_and_a_wall_add_their_two_legs() {
    let mut scene = scene(BARE);
    scene.superstructure.facet.push(Facet {
        name: "fold".to_owned(),
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
        shape: FacetShape::Polygon(PolygonShape {
            corners_mm: vec![
                [1270.0, 20.0, -50.0],
                [1230.0, -20.0, -50.0],
                [1230.0, -20.0, 50.0],
                [1270.0, 20.0, 50.0],
            ],
        }),
    });
    // The corners are ordered so that the face looks back at the scanner and to the left.
    let laboratory = Laboratory::new(&scene, 1).expect("the scene is valid");
    let returns = laboratory.returns(1).expect("colors are built in");
    let found = returns[ust20lx::FORWARD].as_ref().expect("the wall is bright");
    assert_eq!(
        (found.role, found.facets.as_slice()),
        (Role::Wall, [0].as_slice())
    );
    assert!((found.range() - (1.25 + 5.0)).abs() < 1e-12, "{}", found.range());
}

#[test]
fn a_static_wall_without_noise_never_varies() {
    let laboratory = board_ahead(2.0, |_| {});
    let stretch = laboratory.stretch(BOARD).expect("it is recorded");
    let scans: Vec<&[f64]> = stretch.ranges.chunks(ust20lx::COUNT).collect();
    assert!(scans.iter().all(|scan| scan == &scans[0]));
}

#[test]
fn every_point_of_a_flat_wall_is_on_it() {
    let laboratory = board_ahead(3.0, |_| {});
    let stretch = laboratory.stretch(BOARD).expect("it is recorded");
    let room = [5.0, 5.0];
    for (index, range) in stretch.ranges[..ust20lx::COUNT].iter().enumerate() {
        let point = beam::direction(ust20lx::azimuth(index)).into_inner() * *range;
        let to_walls = (room[0] - point.x.abs())
            .abs()
            .min((room[1] - point.y.abs()).abs());
        let to_board = if point.y.abs() <= 0.5 + 0.05 {
            (point.x - 3.0).abs()
        } else {
            f64::INFINITY
        };
        assert!(
            to_walls.min(to_board) < 1e-9 || mixed(&laboratory, index),
            "beam {index} at {point:?}"
        );
    }
}

/// Whether a beam's light falls on more than one surface.
fn mixed(laboratory: &Laboratory, index: usize) -> bool {
    let returns = laboratory.returns(BOARD).expect("colors are built in");
    returns[index]
        .as_ref()
        .is_some_and(|r| (r.share - 1.0).abs() > 1e-12)
}

#[test]
fn a_board_edge_shares_the_beam_with_the_wall_behind() {
    let laboratory = board_ahead(4.7, |scene| scene.board[0].width_mm = 800.0);
    let returns = laboratory.returns(BOARD).expect("colors are built in");
    // Ahead of the scanner; elsewhere beams are shared by two walls.
    let ahead = &returns[ust20lx::FORWARD - 40..ust20lx::FORWARD + 40];
    let shares: Vec<_> = ahead.iter().flatten().filter(|r| r.share < 1.0 - 1e-12).collect();
    assert!(!shares.is_empty(), "some beams meet the edge");
    for found in &shares {
        assert!(found.share > 0.0 && found.mixed != 0.0);
        // 0.3 m to the wall is less than the pulse length: one echo, between the two surfaces.
        let range = found.range();
        assert!(
            range > 4.7 - 1e-6 && range < 5.0 / libm::cos(0.1) + 1e-6,
            "{range}"
        );
    }
}

#[test]
fn a_chief_ray_that_misses_does_not_lose_the_beam() {
    // A strip narrower than the spot, next to the forward beam: the spot is 16 mrad · 2 m = 32 mm wide.
    let laboratory = board_ahead(2.0, |scene| {
        scene.board[0].width_mm = 10.0;
        scene.board[0].marker = vec![
            marker("a", [-4.0, 400.0]),
            marker("b", [4.0, 400.0]),
            marker("c", [0.0, -400.0]),
        ];
        scene.experiment.pose[0].center_m[1] = 0.011;
    });
    let returns = laboratory.returns(BOARD).expect("colors are built in");
    let forward = returns[ust20lx::FORWARD].as_ref().expect("there is an echo");
    assert_eq!(forward.role, Role::Board);
    assert!(
        forward.share < 0.5 && (forward.range() - 2.0).abs() < 0.01,
        "{forward:?}"
    );
}

fn marker(name: &str, [x, y]: [f64; 2]) -> catoptric::sim::scene::Marker {
    catoptric::sim::scene::Marker {
        name: name.to_owned(),
        position_mm: [x, y, 0.0],
    }
}

#[test]
fn light_grows_continuously_through_face_on() {
    let power = |tilt: f64| {
        let laboratory = board_ahead(2.0, |scene| {
            scene.experiment.pose[0].normal = [-libm::cos(tilt), libm::sin(tilt), 0.0];
        });
        let returns = laboratory.returns(BOARD).expect("colors are built in");
        returns[ust20lx::FORWARD].as_ref().expect("it is bright").power
    };
    let face_on = power(0.0);
    for tilt in [1e-9, 1e-7, -1e-7] {
        assert!((power(tilt) / face_on - 1.0).abs() < 1e-9, "at {tilt}");
    }
    // Eq. (1) in closed form: the board fills the spot.
    let expected = 0.9 * 0.02 * 0.02 * 0.9 * 10.0 / (4.0 * std::f64::consts::PI);
    assert!(
        (face_on / expected - 1.0).abs() < 1e-4,
        "{face_on} against {expected}"
    );
}

#[test]
fn the_leading_edge_walks_as_in_its_closed_form() {
    // Only the physical model shows it: a gray board at 2 m against the white one for which the walk error is
    // calibrated out.
    let read = |color: &str| {
        let laboratory = board_ahead(2.0, |scene| {
            scene.errors.model = ErrorModel::Physical;
            scene.board[0].color = color.to_owned();
            scene.scanner.sub_rays = 1;
        });
        let returns = laboratory.returns(BOARD).expect("colors are built in");
        returns[ust20lx::FORWARD].as_ref().expect("it is bright").range()
    };
    let sd = 0.5 * 299_792_458.0 * 4e-9 / (8.0 * std::f64::consts::LN_2).sqrt();
    let height = |reflectivity: f64| reflectivity / 4.0 / (0.1 / 64.0);
    let walk = |reflectivity: f64| sd * (2.0 * height(reflectivity).ln()).sqrt();
    assert!((read("white") - 2.0).abs() < 1e-9);
    let expected = 2.0 + walk(0.9) - walk(0.4);
    assert!(
        (read("pencil_grey") - expected).abs() < 1e-9,
        "{} against {expected}",
        read("pencil_grey")
    );
}

#[test]
fn codes_are_never_turned_into_ranges() {
    let laboratory = board_ahead(0.03, |scene| {
        scene.errors.model = ErrorModel::Empirical;
        scene.room.size_m = [90.0, 90.0, 4.0];
        scene.experiment.scans_per_pose = 50;
    });
    let stretch = laboratory.stretch(BOARD).expect("it is recorded");
    let scans: Vec<&[f64]> = stretch.ranges.chunks(ust20lx::COUNT).collect();
    // The walls are out of range; the board is nearer than the minimum range most of the time.
    assert!(scans.iter().all(|scan| scan[0] == f64::INFINITY));
    assert!(
        scans
            .iter()
            .all(|scan| scan[ust20lx::FORWARD] == f64::NEG_INFINITY || scan[ust20lx::FORWARD] >= 0.021)
    );
}
