//! Flights: the sensor moves while it scans, and every beam is cast from the pose at its own time.
//!
//! Proven with closed forms and mirror images that are independent of the tracer's frames: each range is that of its
//! step's own time, with walls, mirrors and meshes; a rig that hovers reads bit for bit what a rig at rest reads; the
//! trajectory through waypoints is smooth; apply undoes the motion. Not proven is that the motion of a real rig between
//! two motion-capture frames is as smooth as these.

mod recorded;
mod trajectory;

use crate::common::{folder_with, run, stderr, stdout};
use crate::scenes::{BARE, PROTOTYPE, TWO_MIRROR, scene, without_errors};
use catoptric::calib::{self, Method, Options};
use catoptric::files;
use catoptric::files::scene::load;
use catoptric::model::calibration::{self, MountEstimate};
use catoptric::model::frame::yaw_pitch_roll;
use catoptric::model::{BeamEstimate, Calibration, Dataset, Pose, PoseData, PoseKind, Status, beam};
use catoptric::sim::build::Trajectory;
use catoptric::sim::laboratory::Returns;
use catoptric::sim::light::Role;
use catoptric::sim::receive::Return;
use catoptric::sim::scene::{Attitude, ErrorModel, Flight, Waypoint};
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene};
use catoptric::{CloudFrame, apply};
use catoptric_fixtures::ust20lx;
use nalgebra::{Matrix3, Point3, Translation3, UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::path::{Path, PathBuf};

const SCAN_S: f64 = 0.025;
const STEP_S: f64 = SCAN_S / 1440.0;

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"))
}

fn waypoint(time_s: f64, position_m: [f64; 3], turn_deg: [f64; 3]) -> Waypoint {
    let [yaw_deg, pitch_deg, roll_deg] = turn_deg;
    Waypoint {
        time_s,
        position_m,
        yaw_deg,
        pitch_deg,
        roll_deg,
    }
}

fn flight(attitude: Attitude, waypoint: Vec<Waypoint>) -> Flight {
    Flight {
        name: "flight".to_owned(),
        attitude,
        scans: None,
        waypoint,
    }
}

/// The number of the only flight.
fn flight_number(laboratory: &Laboratory) -> usize {
    laboratory.stretches() - 1
}

/// What every beam of every scan of the only flight hits.
fn flown(laboratory: &Laboratory) -> Vec<Returns> {
    let number = flight_number(laboratory);
    let sight = laboratory.sight(number).unwrap();
    assert!(sight.moves());
    (0..laboratory.scans_of(number))
        .map(|scan| sight.returns(scan))
        .collect()
}

fn time(scan: usize, beam: usize) -> f64 {
    scan as f64 * SCAN_S + beam as f64 * STEP_S
}

/// The rotation by yaw, then pitch, then roll, in radians, as a product of three matrices.
fn matrix(yaw: f64, pitch: f64, roll: f64) -> Matrix3<f64> {
    let ((sy, cy), (sp, cp), (sr, cr)) = (libm::sincos(yaw), libm::sincos(pitch), libm::sincos(roll));
    Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0)
        * Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp)
        * Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr)
}

/// Outward planes n·x = h of the box around the room frame.
fn walls(size_m: [f64; 3]) -> Vec<(Vector3<f64>, f64)> {
    let [x, y, z] = size_m;
    vec![
        (Vector3::x(), 0.5 * x),
        (-Vector3::x(), 0.5 * x),
        (Vector3::y(), 0.5 * y),
        (-Vector3::y(), 0.5 * y),
        (Vector3::z(), z),
        (-Vector3::z(), 0.0),
    ]
}

/// Planes of the room in the frame of a sensor at a position with an attitude.
fn seen(
    planes: &[(Vector3<f64>, f64)],
    place: &Vector3<f64>,
    attitude: &Matrix3<f64>,
) -> Vec<(Vector3<f64>, f64)> {
    let planes = planes.iter();
    planes
        .map(|(n, h)| (attitude.transpose() * n, h - n.dot(place)))
        .collect()
}

/// Planes behind a mirror m·x = c, as seen in the mirror.
fn mirrored(planes: &[(Vector3<f64>, f64)], (m, c): (&Vector3<f64>, f64)) -> Vec<(Vector3<f64>, f64)> {
    let planes = planes.iter();
    planes
        .map(|(n, h)| (n - m * (2.0 * m.dot(n)), h - 2.0 * c * m.dot(n)))
        .collect()
}

/// Distance at which a ray from the origin leaves a convex body.
fn leaves(planes: &[(Vector3<f64>, f64)], direction: &Vector3<f64>) -> f64 {
    let ahead = planes.iter().filter(|(n, _)| n.dot(direction) > 0.0);
    ahead
        .map(|(n, h)| h / n.dot(direction))
        .fold(f64::INFINITY, f64::min)
}

/// Compares every beam of every scan with the box of [`BARE`], given the sensor's trajectory in closed form.
fn compare_with_room(laboratory: &Laboratory, trajectory: impl Fn(f64) -> (Vector3<f64>, Matrix3<f64>)) {
    let room = walls(laboratory.scene().room.size_m);
    let mut compared = 0;
    for (scan, returns) in flown(laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let (place, attitude) = trajectory(time(scan, b));
            let direction = beam::direction(ust20lx::azimuth(b)).into_inner();
            let expected = leaves(&seen(&room, &place, &attitude), &direction);
            let found = found.as_ref().expect("the room is white and near");
            assert_eq!(found.role, Role::Wall);
            assert!(
                (found.range() - expected).abs() < 1e-12,
                "scan {scan}, beam {b}: {} {expected}",
                found.range()
            );
            compared += 1;
        }
    }
    assert!(compared >= 8 * ust20lx::COUNT, "{compared}");
}

/// [`BARE`] in flight, with one thin ray per beam.
fn bare_flight(attitude: Attitude, waypoint: Vec<Waypoint>) -> Laboratory {
    let mut scene = scene(BARE);
    scene.scanner.sub_rays = 1;
    scene.flight = vec![flight(attitude, waypoint)];
    Laboratory::new(&scene, 1).unwrap()
}

#[test]
fn past_oblique_walls_every_range_is_that_of_its_own_time() {
    let (start, velocity) = (Vector3::new(-1.5, -0.8, 1.7), Vector3::new(1.6, 1.1, 0.5));
    let end = |t: f64| (start + velocity * t).into();
    let turn = [33.0, -12.0, 21.0];
    let fixed = turn.map(f64::to_radians);
    let laboratory = bare_flight(
        Attitude::Slerp,
        vec![waypoint(3.0, end(0.0), turn), waypoint(3.2, end(0.2), turn)],
    );
    assert!((velocity.norm() - 2.0).abs() < 0.1);
    compare_with_room(&laboratory, |t| {
        (start + velocity * t, matrix(fixed[0], fixed[1], fixed[2]))
    });
}

#[test]
fn a_pure_rotation_at_a_constant_rate_reads_its_closed_form() {
    let place = [0.7, -1.1, 1.2];
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        // 300°/s about the vertical, at intervals of different lengths.
        let at = |t: f64| waypoint(t, place, [10.0 + 300.0 * t, 0.0, 0.0]);
        let laboratory = bare_flight(attitude, vec![at(0.0), at(0.05), at(0.15), at(0.2)]);
        let rate = 300.0_f64.to_radians();
        compare_with_room(&laboratory, |t| {
            (
                Vector3::from(place),
                matrix(10.0_f64.to_radians() + rate * t, 0.0, 0.0),
            )
        });
    }
}

#[test]
fn the_scene_past_a_wall_gives_the_results_stated_in_its_first_comment() {
    let scene = load(&file("flight-past-a-wall"), &[]).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    // Only the flight: no structure to measure, no known room.
    assert_eq!((laboratory.stretches(), laboratory.scans()), (1, 40));
    let mut near = 0;
    for (scan, returns) in flown(&laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let (sin, cos) = libm::sincos(ust20lx::azimuth(b));
            let ahead = (6.0 - 2.0 * time(scan, b)) / cos;
            let ranges = [1.5 / sin, ahead];
            let expected = ranges
                .iter()
                .filter(|r| **r > 0.0)
                .fold(f64::INFINITY, |a, b| a.min(*b));
            if expected < 8.0 {
                near += 1;
                let found = found.as_ref().expect("white and near").range();
                assert!(
                    (found - expected).abs() < 1e-12,
                    "scan {scan}, beam {b}: {found} {expected}"
                );
            }
        }
    }
    assert!(near > 40 * 700, "{near}");
    let session = laboratory.session().unwrap();
    assert_eq!(session.room, None);
    // 37.5 mm, from the first beam to the last.
    assert!((2.0 * time(0, 1080) - 0.0375).abs() < 1e-15);
}

#[test]
fn the_scene_through_a_duct_gives_the_results_stated_in_its_first_comment() {
    let scene = load(&file("flight-through-a-duct"), &[]).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    let mut near = 0;
    for (scan, returns) in flown(&laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let t = time(scan, b);
            let (x, roll) = (3.0 + t, (90.0 * t).to_radians());
            let (sin, cos) = libm::sincos(ust20lx::azimuth(b));
            let v = Vector3::new(cos, sin * libm::cos(roll), sin * libm::sin(roll));
            let side = |k: u32| {
                let (sin, cos) = libm::sincos(f64::from(60 * k).to_radians());
                (Vector3::new(0.0, cos, sin), 1.5)
            };
            let mut planes: Vec<_> = (0..6).map(side).collect();
            planes.extend([(Vector3::x(), 16.0 - x), (-Vector3::x(), x)]);
            let expected = leaves(&planes, &v);
            if expected < 8.0 {
                near += 1;
                let found = found.as_ref().expect("white and near");
                assert_eq!(found.role, Role::Object);
                assert!(
                    (found.range() - expected).abs() < 1e-12,
                    "scan {scan}, beam {b}: {} {expected}",
                    found.range()
                );
            }
        }
    }
    assert!(near > 24 * 900, "{near}");
}

/// A scene with everything around and in front of the sensor: glass mirrors that scatter a little, posts, and in the room
/// mirrors, a box and a cylinder. All echoes are reported, since the mirror's own echo comes first.
fn crowded() -> Scene {
    let mut scene = scene(PROTOTYPE);
    scene.superstructure.mirror.glass = Some(catoptric::sim::scene::Glass {
        thickness_mm: 1.0,
        index: 1.51,
        ghost: true,
    });
    scene.superstructure.mirror.diffuse_reflectivity = 1e-6;
    scene.detection.echo = catoptric::sim::scene::EchoChoice::All;
    let room = r#"
        mirror = [
            { name = "tall", two_sided = true, thickness_mm = 4, position_m = [0.9, 0.2, 1.2], yaw_deg = 160, pitch_deg = 80,
              glass = { thickness_mm = 3, index = 1.5, ghost = true },
              shape.rectangle = { width_m = 1.5, height_m = 0.6 } },
            { name = "high", shape.rectangle = { center_m = [0.0, 0.0, 2.3], normal = [0.1, 0, -1], width_m = 2.5, height_m = 2.5 } },
        ]
        surface = [
            { name = "box", shape.box = { size_m = [0.3, 0.4, 0.5] }, position_m = [-0.6, -1.0, 0.4], yaw_deg = 30 },
            { name = "drum", shape.cylinder = { diameter_m = 0.3, height_m = 2.0 }, position_m = [0.6, -0.9, 1.0] },
        ]
    "#;
    let standing: catoptric::sim::scene::Room = toml::from_str(room).unwrap();
    scene.room.mirror = standing.mirror;
    scene.room.surface = standing.surface;
    scene.experiment.scans_per_pose = 1;
    scene
}

#[test]
fn a_hovering_rig_reads_bit_for_bit_what_one_at_rest_does() {
    let mut scene = crowded();
    let [position, yaw] = [scene.room.rig_position_m, [scene.room.rig_yaw_deg, 0.0, 0.0]];
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        let stay = |t: f64| waypoint(t, position, yaw);
        scene.flight = vec![flight(
            attitude,
            vec![stay(0.5), stay(0.52), stay(0.56), stay(0.6)],
        )];
        let laboratory = Laboratory::new(&scene, 7).unwrap();
        // The second stretch is the room.
        let rest = laboratory.returns(1).unwrap();
        let scans = flown(&laboratory);
        assert_eq!(scans.len(), 4);
        assert!(scans.iter().all(|returns| *returns == rest));
        // The comparison covers the structure, its mirrors, room mirrors seen by them, walls and objects.
        let met = |role: Role| rest.iter().flatten().filter(|r| r.role == role).count();
        assert!(met(Role::Wall) > 100 && met(Role::Object) > 20 && met(Role::Structure) > 20);
        let own = scene.superstructure.facet.len();
        let both = rest
            .iter()
            .flatten()
            .flat_map(Return::echoes)
            .filter(|r| r.facets.iter().any(|f| *f < own) && r.facets.iter().any(|f| *f >= own));
        let both = both.count();
        assert!(both > 50, "{both}");
    }
    scene.errors.model = ErrorModel::None;
    let laboratory = Laboratory::new(&scene, 7).unwrap();
    let room = laboratory.stretch(1).unwrap().ranges;
    let flight = laboratory.stretch(flight_number(&laboratory)).unwrap().ranges;
    let bits = |ranges: &[f64]| ranges.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
    for scan in flight.chunks(ust20lx::COUNT) {
        assert_eq!(bits(scan), bits(&room[..ust20lx::COUNT]));
    }
}

/// The two-mirror layout, as built, moving and rotating about the vertical; the trajectory of the rig in closed form.
fn moving_mirrors() -> (Scene, impl Fn(f64) -> (Vector3<f64>, f64)) {
    let mut scene = without_errors(scene(TWO_MIRROR));
    let (start, velocity) = (Vector3::new(-0.9, -0.6, 1.7), Vector3::new(1.7, 1.0, 0.2));
    let (yaw, rate) = (-20.0, 120.0);
    let at = |t: f64| waypoint(t, (start + velocity * t).into(), [yaw + rate * t, 0.0, 0.0]);
    scene.flight = vec![flight(Attitude::Slerp, vec![at(0.0), at(0.11), at(0.2)])];
    let trajectory = move |t: f64| (start + velocity * t, (yaw + rate * t).to_radians());
    (scene, trajectory)
}

/// Compares beams via given mirrors with the mirror images of the walls; returns their number.
fn compare_with_images(
    laboratory: &Laboratory,
    trajectory: impl Fn(f64) -> (Vector3<f64>, f64),
    room: &[(Vector3<f64>, f64)],
    in_room: Option<(Vector3<f64>, f64)>,
) -> usize {
    let truth = laboratory.truth().unwrap();
    let mount = Pose::from(&truth.rig_from_sensor);
    let turn = mount.rotation.to_rotation_matrix().into_inner();
    let own = truth.facets.len();
    let mut compared = 0;
    for (scan, returns) in flown(laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let whole = truth.beams[b].status == BeamClass::Deflected;
            let Some(found) = found.as_ref().filter(|f| whole && f.role == Role::Wall) else {
                continue;
            };
            let expected_way = if in_room.is_some() { vec![own] } else { Vec::new() };
            let (first, rest) = found.facets.split_first().expect("it is deflected");
            if rest != expected_way {
                continue;
            }
            let (place, yaw) = trajectory(time(scan, b));
            let rig = matrix(yaw, 0.0, 0.0);
            let place = place + rig * mount.translation.vector;
            let attitude = rig * turn;
            let mut planes = seen(room, &place, &attitude);
            if let Some(mirror) = in_room {
                let mirror = seen(&[mirror], &place, &attitude)[0];
                planes = mirrored(&planes, (&mirror.0, mirror.1));
            }
            let facet = &truth.facets[*first];
            let planes = mirrored(&planes, (&Vector3::from(facet.normal), facet.offset_m));
            let direction = beam::direction(ust20lx::azimuth(b)).into_inner();
            let expected = leaves(&planes, &direction);
            assert!(
                (found.range() - expected).abs() < 1e-12,
                "scan {scan}, beam {b}: {} {expected}",
                found.range()
            );
            compared += 1;
        }
    }
    compared
}

#[test]
fn mirrors_move_with_the_rig() {
    let (scene, trajectory) = moving_mirrors();
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let compared = compare_with_images(&laboratory, trajectory, &walls(scene.room.size_m), None);
    assert!(compared > 8 * 200, "{compared}");
}

#[test]
fn a_moving_and_a_fixed_mirror_reflect_alternately() {
    let (mut scene, trajectory) = moving_mirrors();
    // All over the floor, tilted by a few degrees, and not touching it.
    let mirror = "{ name = \"floor\", position_m = [0, 0, 0.5], yaw_deg = 25, pitch_deg = 6, roll_deg = -4,
                    shape.rectangle = { width_m = 3.0, height_m = 2.6 } }";
    scene.room.mirror = toml::from_str::<catoptric::sim::scene::Room>(&format!("mirror = [{mirror}]"))
        .unwrap()
        .mirror;
    let normal = matrix(25.0_f64.to_radians(), 6.0_f64.to_radians(), -4.0_f64.to_radians()) * Vector3::z();
    let plane = (normal, 0.5 * normal.z);
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let compared = compare_with_images(&laboratory, trajectory, &walls(scene.room.size_m), Some(plane));
    assert!(compared > 400, "{compared}");
}

/// A pose of a scene moved by another one.
fn moved(by: &Pose, position_m: [f64; 3], turn_deg: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let [yaw, pitch, roll] = turn_deg.map(f64::to_radians);
    let pose = by
        * Pose::from_parts(
            Translation3::from(Vector3::from(position_m)),
            yaw_pitch_roll(yaw, pitch, roll),
        );
    let (roll, pitch, yaw) = pose.rotation.euler_angles();
    (
        pose.translation.vector.into(),
        [yaw, pitch, roll].map(f64::to_degrees),
    )
}

/// Free surfaces, mirrors and a cylinder around a flight, without walls.
fn open_flight(attitude: Attitude, middle: [f64; 3], turn_deg: [f64; 3]) -> Scene {
    let mut scene = without_errors(scene(TWO_MIRROR));
    scene.room.size_m = [0.0; 3];
    scene.board.clear();
    let around = r#"
        mirror = [{ name = "m", position_m = [1.2, 0.4, 0.2], yaw_deg = 200, pitch_deg = 70,
                    shape.rectangle = { width_m = 1.2, height_m = 0.9 } }]
        surface = [
            { name = "ground", shape.rectangle = { center_m = [0, 0, -1.1], width_m = 30, height_m = 30 } },
            { name = "back", shape.rectangle = { center_m = [-3, 0, 0], normal = [1, 0.2, 0], width_m = 9, height_m = 9 } },
            { name = "box", shape.box = { size_m = [1, 2, 3] }, position_m = [3, -1.5, 0], yaw_deg = 25, roll_deg = 8 },
            { name = "drum", shape.cylinder = { diameter_m = 0.7, height_m = 2 }, position_m = [0.5, 1.8, 0.1], pitch_deg = 30 },
        ]
    "#;
    let around: catoptric::sim::scene::Room = toml::from_str(around).unwrap();
    scene.room.mirror = around.mirror;
    scene.room.surface = around.surface;
    scene.flight = vec![flight(
        attitude,
        vec![
            waypoint(0.0, [-0.4, 0.0, 0.0], [0.0, 5.0, 0.0]),
            waypoint(0.03, middle, turn_deg),
            waypoint(0.05, [-0.3, 0.1, 0.05], [10.0, -5.0, 15.0]),
        ],
    )];
    scene
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn moving_room_and_flight_together_changes_no_range(
        squad in any::<bool>(),
        middle in (-0.4..-0.3_f64, -0.1..0.1_f64, -0.05..0.05_f64),
        turn in (-40.0..40.0_f64, -20.0..20.0_f64, -20.0..20.0_f64),
        shift in (-5.0..5.0_f64, -5.0..5.0_f64, -5.0..5.0_f64),
        by in (-180.0..180.0_f64, -40.0..40.0_f64, -180.0..180.0_f64),
    ) {
        let attitude = if squad { Attitude::Squad } else { Attitude::Slerp };
        let scene = open_flight(attitude, middle.into(), turn.into());
        let by_rad = [by.0, by.1, by.2].map(f64::to_radians);
        let by = Pose::from_parts(
            Translation3::new(shift.0, shift.1, shift.2),
            yaw_pitch_roll(by_rad[0], by_rad[1], by_rad[2]),
        );
        let mut other = scene.clone();
        for w in &mut other.flight[0].waypoint {
            let (p, t) = moved(&by, w.position_m, [w.yaw_deg, w.pitch_deg, w.roll_deg]);
            *w = waypoint(w.time_s, p, t);
        }
        for s in &mut other.room.surface {
            let (p, t) = moved(&by, s.position_m, [s.yaw_deg, s.pitch_deg, s.roll_deg]);
            (s.position_m, [s.yaw_deg, s.pitch_deg, s.roll_deg]) = (p, t);
        }
        for m in &mut other.room.mirror {
            let (p, t) = moved(&by, m.position_m, [m.yaw_deg, m.pitch_deg, m.roll_deg]);
            (m.position_m, [m.yaw_deg, m.pitch_deg, m.roll_deg]) = (p, t);
        }
        let here = flown(&Laboratory::new(&scene, 2).unwrap());
        let there = flown(&Laboratory::new(&other, 2).unwrap());
        let (mut compared, mut torn) = (0, 0);
        for (a, b) in here.iter().flatten().zip(there.iter().flatten()) {
            // A ray that grazes an edge may hit either side.
            match (a, b) {
                (Some(a), Some(b)) if (a.role, &a.facets) == (b.role, &b.facets) && (a.range() - b.range()).abs() < 1e-9 => compared += 1,
                (None, None) => {}
                _ => torn += 1,
            }
        }
        prop_assert!(compared > 1000, "{compared}");
        prop_assert!(torn <= 2, "{torn} of {compared}");
    }
}
