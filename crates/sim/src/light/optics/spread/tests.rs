//! The spread of light against Coddington's equations and neighboring rays.

use super::*;
use catoptric_model::Curve;
use catoptric_model::curve::{ConeCurve, CylinderCurve, RoundCurve};
use catoptric_model::mirror::reflect;

const LENS: f64 = 1e-12;

/// A surface that touches a plane through a point.
fn surface(curve: Curve, at: Point3<f64>, normal: [f64; 3]) -> CurvedSurface {
    let normal = Unit::new_normalize(Vector3::from(normal));
    let [x, y] = catoptric_model::curve::axes(&normal);
    let corners = [-x - y, x - y, x + y, y - x].map(|c| at + c * 0.01);
    curve.over(&corners, &normal, 0.0).expect("it has a radius")
}

fn turns<'a>(start: &Ray, mirrors: &'a [CurvedSurface]) -> Vec<Turn<'a>> {
    let mut ray = *start;
    let turn = |surface: &'a CurvedSurface| {
        let ahead = surface.roots(&ray.origin, &ray.direction).into_iter().flatten();
        let point = ray.origin + ray.direction.into_inner() * ahead.into_iter().find(|t| *t > 1e-9)?;
        let after = reflect(&ray.direction, &surface.normal_at(&point));
        ray = Ray {
            origin: point,
            direction: after,
        };
        Some(Turn {
            point,
            after,
            curved: Some((surface, 1.0)),
        })
    };
    let turns: Vec<_> = mirrors.iter().map_while(turn).collect();
    assert_eq!(turns.len(), mirrors.len());
    turns
}

fn round(radius_mm: f64) -> RoundCurve {
    RoundCurve {
        radius_mm,
        touches_mm: [0.0; 2],
    }
}

/// Coddington: 1/s' = 1/s + 2/(R·cos i) in the plane of incidence, 1/s + 2·cos i/R across it, for a convex mirror.
#[test]
fn a_sphere_spreads_light_as_coddington_says() {
    let mirror = surface(
        Curve::Sphere(round(-150.0)),
        Point3::new(0.07, 0.0, 0.0),
        [-1.0, 0.0, 0.8],
    );
    let start = Ray {
        origin: Point3::origin(),
        direction: Vector3::x_axis(),
    };
    let spread = Spread::after(&start, turns(&start, &[mirror]).into_iter()).expect("it is curved");
    let cos = 1.0 / 1.64_f64.sqrt();
    for leg in [0.1, 2.0, 7.0] {
        let within = 0.07 * (1.0 + leg * (1.0 / 0.07 + 2.0 / (0.15 * cos)));
        let across = 0.07 * (1.0 + leg * (1.0 / 0.07 + 2.0 * cos / 0.15));
        let exact = (0.07_f64 + leg).powi(2) / (within * across);
        let found = spread.gain(0.07 + leg, LENS);
        assert!((found / exact - 1.0).abs() < 1e-12, "{leg}: {found} {exact}");
    }
}

/// Against rays beside the path, traced themselves: the area that neighboring rays from the lens enclose at the target.
#[test]
fn light_spreads_as_neighboring_rays_do() {
    let cone = ConeCurve {
        radius_mm: 60.0,
        half_angle_deg: 30.0,
        axis_deg: 20.0,
        touches_mm: [1.0, 2.0],
    };
    let cylinder = CylinderCurve {
        radius_mm: -45.0,
        axis_deg: 70.0,
        touches_mm: [0.0; 2],
    };
    let first = [
        Curve::Cone(cone),
        Curve::Cylinder(cylinder),
        Curve::Paraboloid(round(-80.0)),
    ];
    for curve in first {
        let mirrors = [
            surface(curve, Point3::new(0.07, 0.004, 0.0), [-1.0, 0.1, 0.9]),
            surface(
                Curve::Sphere(round(400.0)),
                Point3::new(0.07, 0.0, 0.05),
                [0.4, 0.1, -1.0],
            ),
        ];
        let direction = Unit::new_normalize(Vector3::new(1.0, 0.03, 0.01));
        let start = Ray {
            origin: Point3::origin(),
            direction,
        };
        for count in [1, 2] {
            let own = turns(&start, &mirrors[..count]);
            let spread = Spread::after(&start, own.into_iter()).expect("it is curved");
            let leg = 1.3;
            let end = |direction: Unit<Vector3<f64>>| {
                let start = Ray {
                    origin: Point3::origin(),
                    direction,
                };
                let all = turns(&start, &mirrors[..count]);
                let last = all.last().expect("a mirror");
                (last.point, last.after)
            };
            let (from, along) = end(direction);
            let target = from + along.into_inner() * leg;
            const STEP: f64 = 1e-5;
            let [a, b] =
                [direction.cross(&Vector3::z()), direction.cross(&Vector3::y())].map(|v| v.normalize());
            let b = b - a * a.dot(&b);
            let side = |v: Vector3<f64>| {
                let places = [-STEP, STEP].map(|s| {
                    let (point, after) = end(Unit::new_normalize(direction.into_inner() + v * s));
                    point + after.into_inner() * (along.dot(&(target - point)) / along.dot(&after))
                });
                (places[1] - places[0]) / (2.0 * STEP)
            };
            let area = side(a).cross(&side(b.normalize())).norm();
            let range = spread.length + leg;
            let found = range * range / spread.gain(range, LENS);
            assert!(
                (found / area - 1.0).abs() < 1e-6,
                "{curve:?} {count}: {found} {area}"
            );
        }
    }
}

#[test]
fn in_a_focus_no_more_returns_than_the_mirror_lets_through() {
    // Head-on, a concave sphere shows a spot at its center where it is.
    let mirror = surface(
        Curve::Sphere(round(500.0)),
        Point3::new(1.0, 0.0, 0.0),
        [-1.0, 0.0, 0.0],
    );
    let start = Ray {
        origin: Point3::origin(),
        direction: Vector3::x_axis(),
    };
    let mirrors = [mirror];
    let mut all = turns(&start, &mirrors);
    all[0].curved = Some((&mirrors[0], 4e-4));
    let spread = Spread::after(&start, all.into_iter()).expect("it is curved");
    // The image of the lens is where 1/s' = 2/R − 1/s.
    let focus = 1.0 / (4.0 - 1.0);
    let most = spread.gain(1.0 + focus, 3e-4);
    let exact = (4e-4 / (focus * focus)) / (3e-4 / ((1.0 + focus) * (1.0 + focus)));
    assert!((most / exact - 1.0).abs() < 1e-12, "{most} {exact}");
    assert!(spread.gain(1.0 + 2.0 * focus, 3e-4) < most);
}

/// At its longest reach a target returns what a flat mirror would at the distance that was asked for.
#[test]
fn a_reach_is_where_as_much_light_comes_back() {
    for radius_mm in [-150.0, 700.0, 90.0] {
        let mirrors = [surface(
            Curve::Sphere(round(radius_mm)),
            Point3::new(0.07, 0.0, 0.0),
            [-1.0, 0.0, 0.8],
        )];
        let start = Ray {
            origin: Point3::origin(),
            direction: Vector3::x_axis(),
        };
        let spread = Spread::after(&start, turns(&start, &mirrors).into_iter()).expect("it is curved");
        let range = spread.reach(6.0);
        assert!(
            (range * range / spread.gain(range, LENS) / 36.0 - 1.0).abs() < 1e-11,
            "{range}"
        );
        assert!(spread.gain(1.001 * range, LENS) / (1.001 * range).powi(2) < 1.0 / 36.0);
        assert_eq!(spread.reach(f64::INFINITY), f64::INFINITY);
    }
}

#[test]
fn flat_mirrors_have_no_spread() {
    let start = Ray {
        origin: Point3::origin(),
        direction: Vector3::x_axis(),
    };
    let turn = Turn {
        point: Point3::new(0.1, 0.0, 0.0),
        after: Vector3::y_axis(),
        curved: None,
    };
    assert_eq!(Spread::after(&start, std::iter::once(turn)), None);
}
