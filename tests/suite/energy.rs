//! Energy balance: no light is lost or created, and the received power is continuous through face-on.
//!
//! This proves the energy balance, not the paths: those are covered by `physics` and `tracing`.

use crate::scenes::{BARE, scene};
use catoptric::cast::{Polygon, Shape};
use catoptric::sim::Scene;
use catoptric::sim::build::Structure;
use catoptric::sim::build::color;
use catoptric::sim::light::{Mirrors, Role, Setting, Target};
use catoptric::sim::noise::{Draws, Purpose};
use catoptric::sim::receive::phase;
use catoptric::sim::receive::{Return, Sensor, SubRayEnd, SubRayStop};
use catoptric::sim::scene::{
    Detector, ErrorModel, Facet, FacetShape, Glass, Post, PostCylinder, PostShape, Principle, RectangleShape,
};
use catoptric_fixtures::ust20lx;
use nalgebra::{Point3, Vector3};

/// A white rectangle at a position, facing along its normal.
fn rectangle(scene: &Scene, center: Point3<f64>, normal: Vector3<f64>, half: [f64; 2]) -> Target {
    let normal = normal.normalize();
    let across = normal.cross(&Vector3::z()).normalize();
    let (x, y) = (across * half[0], normal.cross(&across) * half[1]);
    Target {
        name: "board".to_owned(),
        shape: Shape::Polygon(
            Polygon::new(vec![
                center - x - y,
                center + x - y,
                center + x + y,
                center - x + y,
            ])
            .unwrap(),
        ),
        role: Role::Board,
        paint: color::paint(scene, "white").unwrap(),
    }
}

fn rectangle_facet(name: String, center_mm: Vector3<f64>, normal: Vector3<f64>, size_mm: [f64; 2]) -> Facet {
    Facet {
        name,
        curve: None,
        bow_um: 0.0,
        two_sided: false,
        reflectivity: None,
        coating: None,
        shape: FacetShape::Rectangle(RectangleShape {
            center_mm: center_mm.into(),
            normal: normal.into(),
            width_mm: size_mm[0],
            height_mm: size_mm[1],
        }),
    }
}

/// Facets, posts and boards at random positions: some with glass, some with two sides.
fn random_scene(draws: &mut Draws, round: usize) -> Scene {
    let mut scene = scene(BARE);
    scene.scanner.sub_rays = 61;
    scene.scanner.housing = round.is_multiple_of(3);
    scene.superstructure.mirror.thickness_mm = 3.0;
    scene.superstructure.mirror.glass = (round % 2 == 1).then_some(Glass {
        index: 1.51,
        thickness_mm: 3.0,
        ghost: false,
    });
    scene.superstructure.facet = (0..5)
        .map(|k| {
            let at = draws.normal3().normalize() * (60.0 + 40.0 * draws.uniform());
            let facing = -at.normalize() + draws.normal3() * 0.4;
            let center = Vector3::new(at.x, at.y, 0.1 * at.z);
            Facet {
                curve: None,
                bow_um: 0.0,
                two_sided: k % 2 == 0,
                reflectivity: None,
                coating: None,
                ..rectangle_facet(format!("facet {k}"), center, facing, [30.0, 20.0])
            }
        })
        .collect();
    scene.superstructure.post = (0..3)
        .map(|k| {
            let at = draws.normal3().normalize() * 130.0;
            let rod = PostShape::Cylinder(PostCylinder {
                diameter_mm: 12.0,
                height_mm: 80.0,
            });
            Post {
                name: format!("post {k}"),
                center_mm: [at.x, at.y, 0.2 * at.z],
                size_mm: (k > 0).then_some([10.0, 20.0, 60.0]),
                shape: (k == 0).then_some(rod),
                yaw_deg: draws.within(180.0),
                pitch_deg: draws.within(40.0),
                roll_deg: draws.within(40.0),
                color: "structure".to_owned(),
            }
        })
        .collect();
    scene
}

/// Power that a path returns.
fn power(end: &SubRayEnd) -> f64 {
    match end.stop {
        SubRayStop::Hit { power, .. } => power,
        SubRayStop::Escaped | SubRayStop::Trapped => 0.0,
    }
}

#[test]
fn the_energy_of_a_beam_is_fully_accounted_for() {
    let mut draws = Draws::new(17, Purpose::Placement, 0);
    let (mut compared, mut split, mut escaped, mut trapped) = (0, 0, 0, 0);
    for round in 0..60 {
        let scene = random_scene(&mut draws, round);
        let structure = Structure::nominal(&scene).unwrap();
        // A wall on one side, a few boards; everything else is open.
        let mut targets = vec![rectangle(
            &scene,
            Point3::new(4.0, 0.0, 0.0),
            -Vector3::x(),
            [9.0, 9.0],
        )];
        for _ in 0..4 {
            let at = draws.normal3() * 1.5;
            targets.push(rectangle(&scene, Point3::from(at), draws.normal3(), [0.4, 0.3]));
        }
        let setting = Setting::new(&scene, &structure, Mirrors::Attached, targets).unwrap();
        let sensor = Sensor::new(&scene).unwrap();
        for index in (0..ust20lx::COUNT).step_by(9) {
            let ends = sensor.sub_ray_ends(&setting, index);
            let weight: f64 = ends.iter().map(|e| e.sub_ray.weight).sum();
            assert!((weight - 1.0).abs() < 1e-12, "beam {index}: {weight}");
            let shares = sensor.shares(&setting, index);
            let energy: f64 = shares.iter().map(|s| s.energy).sum();
            assert!((energy - 1.0).abs() < 1e-12, "beam {index}: {shares:?}");
            let (sum, of_shares): (f64, f64) =
                (ends.iter().map(power).sum(), shares.iter().map(|s| s.power).sum());
            assert!(
                (sum - of_shares).abs() <= 1e-12 * sum,
                "beam {index}: {sum} W against {of_shares} W"
            );
            compared += 1;
            split += usize::from(shares.len() > 1);
            escaped += ends.iter().filter(|e| e.stop == SubRayStop::Escaped).count();
            trapped += ends.iter().filter(|e| e.stop == SubRayStop::Trapped).count();
        }
    }
    // The random scenes contain the intended cases.
    assert!(
        compared > 7000 && split > 300,
        "{split} of {compared} beams are split"
    );
    assert!(
        escaped > 10_000 && trapped > 100,
        "{escaped} sub-rays escape, {trapped} are trapped"
    );
}

/// What the forward beam returns in a setting.
fn forward(scene: &Scene, targets: Vec<Target>) -> (Option<Return>, Vec<SubRayEnd>) {
    let structure = Structure::nominal(scene).unwrap();
    let setting = Setting::new(scene, &structure, Mirrors::Attached, targets).unwrap();
    let sensor = Sensor::new(scene).unwrap();
    let ends = sensor.sub_ray_ends(&setting, ust20lx::FORWARD);
    (sensor.observe(&setting, ust20lx::FORWARD), ends)
}

#[test]
fn light_and_range_are_continuous_through_face_on() {
    for detector in Detector::ALL {
        for folded in [false, true] {
            let mut scene = scene(BARE);
            scene.errors.model = ErrorModel::Physical;
            scene.detection.detector = detector;
            scene.scanner.sub_rays = 61;
            // A mirror that lifts the forward beam by 90°, or none: the board is 2 m farther.
            let (at, towards) = if folded {
                let facet = rectangle_facet(
                    "lift".to_owned(),
                    Vector3::new(100.0, 0.0, 0.0),
                    Vector3::new(-1.0, 0.0, 1.0),
                    [40.0, 40.0],
                );
                scene.superstructure.facet = vec![facet];
                (Point3::new(0.1, 0.0, 2.0), -Vector3::z())
            } else {
                (Point3::new(2.1, 0.0, 0.0), -Vector3::x())
            };
            for side in [Vector3::y(), towards.cross(&Vector3::y())] {
                let read = |tilt: f64| {
                    let normal: Vector3<f64> = towards * libm::cos(tilt) + side * libm::sin(tilt);
                    // Its size does not depend on the tilt: it fills the spot.
                    let mut target = rectangle(&scene, at, Vector3::x(), [1.0, 1.0]);
                    let x = normal.cross(&Vector3::new(0.3, 0.5, 0.7)).normalize();
                    let y = normal.cross(&x);
                    let corners = [-x - y, x - y, x + y, y - x].map(|c| at + c).to_vec();
                    target.shape = Shape::Polygon(Polygon::new(corners).unwrap());
                    forward(&scene, vec![target]).0.expect("it is bright")
                };
                let face_on = read(0.0);
                assert!((face_on.share - 1.0).abs() < 1e-12 && face_on.cos_incidence == 1.0);
                for tilt in [1e-12, 1e-9, 1e-7, 1e-6, 1e-5] {
                    for tilt in [tilt, -tilt] {
                        let found = read(tilt);
                        // A tilt of 1e-5 reduces the light by 5e-11, its cosine.
                        assert!(
                            (found.power / face_on.power - 1.0).abs() < 1e-9,
                            "{detector:?} at {tilt}"
                        );
                        assert!(
                            (found.range() - face_on.range()).abs() < 1e-9,
                            "{detector:?} at {tilt}"
                        );
                    }
                }
            }
        }
    }
}

#[test]
fn ranging_by_phase_is_the_phasor_sum_of_the_listed_light() {
    let mut draws = Draws::new(31, Purpose::Placement, 0);
    let mut outside = 0;
    for _ in 0..200 {
        let mut scene = scene(BARE);
        scene.detection.principle = Principle::Phase;
        scene.detection.modulation_hz = 46.55e6;
        scene.errors.model = ErrorModel::Physical;
        scene.scanner.sub_rays = 127;
        // One board covers part of the spot, another is behind it.
        let (near, gap) = (0.8 + draws.uniform(), 0.1 + 1.8 * draws.uniform());
        let edge = draws.within(0.004) * near;
        let targets = vec![
            rectangle(
                &scene,
                Point3::new(near, edge + 1.0, 0.0),
                -Vector3::x(),
                [1.0, 1.0],
            ),
            rectangle(
                &scene,
                Point3::new(near + gap, 0.0, 0.0),
                -Vector3::x(),
                [5.0, 5.0],
            ),
        ];
        let (found, ends) = forward(&scene, targets);
        let ambiguity = 0.5 * 299_792_458.0 / 46.55e6;
        let wave = std::f64::consts::TAU / ambiguity;
        let (x, y) = ends.iter().fold((0.0, 0.0), |(x, y), e| {
            (
                x + power(e) * libm::cos(wave * e.path),
                y + power(e) * libm::sin(wave * e.path),
            )
        });
        let Some(found) = found else { continue };
        let expected = libm::atan2(y, x) / wave;
        // Where the two nearly cancel, their phase is less accurate.
        let light: f64 = ends.iter().map(power).sum();
        let worth = 1e-14 * light / libm::hypot(x, y) + 1e-13;
        assert!(
            phase::wrap(found.range() - expected, ambiguity).abs() < worth,
            "{} against {expected}",
            found.range()
        );
        assert!((0.0..=ambiguity).contains(&found.range()));
        outside += usize::from(found.range() < near - 1e-3 || found.range() > near + gap + 1e-3);
    }
    assert!(outside > 10, "{outside} readings are outside the two surfaces");
}
