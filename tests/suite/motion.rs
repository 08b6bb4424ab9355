//! Flights: the sensor moves while it scans, and every beam is cast from where it is at its own time.
//!
//! Proven against closed forms and mirror images that know nothing of the tracer's frames: the range of each step's own
//! time, with walls, mirrors and meshes; that a rig which hovers reads what one at rest does, to the bit; that the way
//! through waypoints is smooth; that apply undoes the motion. Not proven is that a real rig's motion between two frames of
//! motion capture is as smooth as these.

use crate::common::{folder_with, run, stderr, stdout};
use crate::scenes::{BARE, PROTOTYPE, TWO_MIRROR, scene, without_errors};
use catoptric::apply::{CloudFrame, apply};
use catoptric::calib::{self, Method, Options};
use catoptric::io;
use catoptric::io::scene::load;
use catoptric::model::calibration::{self, MountEstimate};
use catoptric::model::frame::yaw_pitch_roll;
use catoptric::model::{BeamEstimate, Calibration, Dataset, Pose, PoseData, PoseKind, Status, beam};
use catoptric::sim::laboratory::Returns;
use catoptric::sim::optics::Role;
use catoptric::sim::reading::Return;
use catoptric::sim::scene::{Attitude, ErrorModel, Flight, Waypoint};
use catoptric::sim::trajectory::Trajectory;
use catoptric::sim::truth::BeamClass;
use catoptric::sim::{Laboratory, Scene};
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

/// What every beam of every scan of the only flight meets.
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

/// Planes of the room in the frame of a sensor at a place with an attitude.
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

/// Planes behind a mirror m·x = c, as the mirror shows them.
fn mirrored(planes: &[(Vector3<f64>, f64)], (m, c): (&Vector3<f64>, f64)) -> Vec<(Vector3<f64>, f64)> {
    let planes = planes.iter();
    planes
        .map(|(n, h)| (n - m * (2.0 * m.dot(n)), h - 2.0 * c * m.dot(n)))
        .collect()
}

/// Where a ray from the origin leaves a convex body.
fn leaves(planes: &[(Vector3<f64>, f64)], direction: &Vector3<f64>) -> f64 {
    let ahead = planes.iter().filter(|(n, _)| n.dot(direction) > 0.0);
    ahead
        .map(|(n, h)| h / n.dot(direction))
        .fold(f64::INFINITY, f64::min)
}

/// Compares every beam of every scan with the box of [`BARE`] seen from a closed form of the sensor's way.
fn compare_with_room(laboratory: &Laboratory, way: impl Fn(f64) -> (Vector3<f64>, Matrix3<f64>)) {
    let room = walls(laboratory.scene().room.size_m);
    let mut compared = 0;
    for (scan, returns) in flown(laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let (place, attitude) = way(time(scan, b));
            let direction = beam::direction(beam::azimuth(b)).into_inner();
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
    assert!(compared >= 8 * beam::COUNT, "{compared}");
}

/// [`BARE`] with one thin ray for a beam, flying.
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
fn a_pure_turn_at_a_constant_rate_reads_its_closed_form() {
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
fn the_scene_past_a_wall_gives_what_its_first_comment_says() {
    let scene = load(&file("flight-past-a-wall"), &[]).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    // Nothing but the flight: no structure to measure, no room to know.
    assert_eq!((laboratory.stretches(), laboratory.scans()), (1, 40));
    let mut near = 0;
    for (scan, returns) in flown(&laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let (sin, cos) = libm::sincos(beam::azimuth(b));
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
fn the_scene_through_a_duct_gives_what_its_first_comment_says() {
    let scene = load(&file("flight-through-a-duct"), &[]).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    let mut near = 0;
    for (scan, returns) in flown(&laboratory).iter().enumerate() {
        for (b, found) in returns.iter().enumerate() {
            let t = time(scan, b);
            let (x, roll) = (3.0 + t, (90.0 * t).to_radians());
            let (sin, cos) = libm::sincos(beam::azimuth(b));
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

/// A scene with everything around and before the sensor: mirrors with glass that scatter a little themselves, posts, and
/// in the room mirrors, a box and a cylinder. All echoes are told, since a mirror's own comes first.
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
fn a_rig_that_hovers_reads_what_one_at_rest_does_to_the_bit() {
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
        // What is compared holds structure, its mirrors, mirrors of the room behind them, walls and objects.
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
    for scan in flight.chunks(beam::COUNT) {
        assert_eq!(bits(scan), bits(&room[..beam::COUNT]));
    }
}

/// The two-mirror layout, as built, moving and turning about the vertical; the way of the rig in closed form.
fn moving_mirrors() -> (Scene, impl Fn(f64) -> (Vector3<f64>, f64)) {
    let mut scene = without_errors(scene(TWO_MIRROR));
    let (start, velocity) = (Vector3::new(-0.9, -0.6, 1.7), Vector3::new(1.7, 1.0, 0.2));
    let (yaw, rate) = (-20.0, 120.0);
    let at = |t: f64| waypoint(t, (start + velocity * t).into(), [yaw + rate * t, 0.0, 0.0]);
    scene.flight = vec![flight(Attitude::Slerp, vec![at(0.0), at(0.11), at(0.2)])];
    let way = move |t: f64| (start + velocity * t, (yaw + rate * t).to_radians());
    (scene, way)
}

/// Compares beams that go by given mirrors with the walls as those mirrors show them; how many there are.
fn compare_with_images(
    laboratory: &Laboratory,
    way: impl Fn(f64) -> (Vector3<f64>, f64),
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
            let (place, yaw) = way(time(scan, b));
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
            let direction = beam::direction(beam::azimuth(b)).into_inner();
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
fn mirrors_move_along() {
    let (scene, way) = moving_mirrors();
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let compared = compare_with_images(&laboratory, way, &walls(scene.room.size_m), None);
    assert!(compared > 8 * 200, "{compared}");
}

#[test]
fn a_moving_mirror_and_one_that_stands_still_take_turns() {
    let (mut scene, way) = moving_mirrors();
    // All over the floor, tilted by some degrees, and clear of it.
    let mirror = "{ name = \"floor\", position_m = [0, 0, 0.5], yaw_deg = 25, pitch_deg = 6, roll_deg = -4,
                    shape.rectangle = { width_m = 3.0, height_m = 2.6 } }";
    scene.room.mirror = toml::from_str::<catoptric::sim::scene::Room>(&format!("mirror = [{mirror}]"))
        .unwrap()
        .mirror;
    let normal = matrix(25.0_f64.to_radians(), 6.0_f64.to_radians(), -4.0_f64.to_radians()) * Vector3::z();
    let plane = (normal, 0.5 * normal.z);
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let compared = compare_with_images(&laboratory, way, &walls(scene.room.size_m), Some(plane));
    assert!(compared > 400, "{compared}");
}

/// The way through waypoints that agree on no axis, at unequal intervals.
fn winding(attitude: Attitude) -> (Vec<(f64, Pose)>, Trajectory) {
    let pose = |x: f64, y: f64, z: f64, turn: [f64; 3]| {
        let [yaw, pitch, roll] = turn.map(f64::to_radians);
        Pose::from_parts(Translation3::new(x, y, z), yaw_pitch_roll(yaw, pitch, roll))
    };
    let waypoints = vec![
        (1.0, pose(0.0, 0.5, 1.0, [170.0, 3.0, -5.0])),
        (1.7, pose(1.0, 0.2, 1.4, [-150.0, 20.0, 10.0])),
        (2.0, pose(1.6, -0.6, 1.2, [-120.0, -15.0, 40.0])),
        (3.1, pose(3.0, 0.0, 2.0, [-30.0, 30.0, 0.0])),
    ];
    let way = Trajectory::through(&waypoints, attitude).unwrap();
    (waypoints, way)
}

#[test]
fn a_way_passes_through_its_waypoints_and_rests_beyond_them() {
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        let (waypoints, way) = winding(attitude);
        for (t, pose) in &waypoints {
            let found = way.room_from_rig(t - 1.0);
            assert!((found.translation.vector - pose.translation.vector).norm() < 1e-14);
            assert!(found.rotation.angle_to(&pose.rotation) < 1e-14);
        }
        assert_eq!(way.room_from_rig(5.0), way.room_from_rig(way.duration_s()));
        assert_eq!(way.first_from_rig(0.0), Pose::identity());
    }
    assert_eq!(
        Trajectory::through(&[(0.0, Pose::identity())], Attitude::Slerp),
        None
    );
    let still = [(1.0, Pose::identity()), (1.0, Pose::identity())];
    assert_eq!(Trajectory::through(&still, Attitude::Squad), None);
}

#[test]
fn uniform_motion_is_reproduced() {
    let (place, velocity) = (Vector3::new(3.0, -2.0, 1.0), Vector3::new(0.7, 2.1, -0.4));
    let acceleration = Vector3::new(-1.5, 0.3, 0.9);
    let (begin, rate) = (yaw_pitch_roll(2.9, 0.3, -0.7), Vector3::new(0.4, -1.3, 0.8));
    let times = [5.0, 5.3, 6.1, 6.2, 7.0];
    let turned = |t: f64| begin * UnitQuaternion::from_scaled_axis(rate * t);
    for attitude in [Attitude::Slerp, Attitude::Squad] {
        for acceleration in [Vector3::zeros(), acceleration] {
            let moved = |t: f64| place + velocity * t + acceleration * (0.5 * t * t);
            let pose = |t: f64| Pose::from_parts(moved(t).into(), turned(t));
            let waypoints = times.map(|t| (t, pose(t - 5.0)));
            let way = Trajectory::through(&waypoints, attitude).unwrap();
            for k in 0..=400 {
                let t = f64::from(k) * 0.005;
                let found = way.room_from_rig(t);
                assert!((found.translation.vector - moved(t)).norm() < 1e-12, "{t}");
                assert!(found.rotation.angle_to(&turned(t)) < 1e-12, "{t}");
            }
        }
    }
}

#[test]
fn velocity_is_continuous_and_with_squad_the_rate_of_turning_too() {
    // The derivative of a cubic at one end, exact, from four values.
    let slope =
        |f: [Vector3<f64>; 4], h: f64| (f[0] * -11.0 + f[1] * 18.0 - f[2] * 9.0 + f[3] * 2.0) / (6.0 * h);
    let jump = |way: &Trajectory, t: f64| {
        let at = |k: usize, h: f64| way.first_from_rig(t + k as f64 * h);
        let velocity = |h: f64| slope([0, 1, 2, 3].map(|k| at(k, h).translation.vector), h);
        let turn = |k: usize, h: f64| (at(0, h).rotation.inverse() * at(k, h).rotation).scaled_axis();
        let rate = |h: f64| slope([0, 1, 2, 3].map(|k| turn(k, h)), h);
        let h = 1e-3;
        (
            (velocity(h) - velocity(-h)).norm(),
            (rate(h) - rate(-h)).norm(),
            velocity(h).norm(),
        )
    };
    for t in [0.7, 1.0] {
        let (_, squad) = winding(Attitude::Squad);
        let (velocity, rate, speed) = jump(&squad, t);
        assert!(speed > 0.5 && velocity < 1e-10, "{t}: {velocity}");
        // The turns are no cubics: what is left is of third order in the step of a millisecond.
        assert!(rate < 1e-6, "{t}: {rate}");
        let (_, slerp) = winding(Attitude::Slerp);
        let (velocity, rate, _) = jump(&slerp, t);
        assert!(velocity < 1e-10 && rate > 0.3, "{t}: {velocity} {rate}");
    }
}

#[test]
fn threads_and_order_change_nothing() {
    let mut scene = crowded();
    scene.experiment.poses_per_group = 3;
    scene.flight = vec![flight(
        Attitude::Squad,
        vec![
            waypoint(0.0, [0.0, 0.0, 1.5], [0.0; 3]),
            waypoint(0.08, [0.1, 0.05, 1.5], [10.0, 2.0, 0.0]),
            waypoint(0.15, [0.2, 0.05, 1.55], [15.0, 0.0, -4.0]),
        ],
    )];
    let fly = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(|| {
            let laboratory = Laboratory::new(&scene, 11).unwrap();
            let number = flight_number(&laboratory);
            (laboratory.stretch(number).unwrap(), flown(&laboratory))
        })
    };
    let (stretch, scans) = fly(1);
    assert_eq!((stretch.label.kind, stretch.label.scans), (PoseKind::Flight, 6));
    assert_eq!(stretch.label.flight.as_deref(), Some("flight"));
    for threads in [2, 7] {
        let again = fly(threads);
        let bits = |s: &catoptric::model::Stretch| s.ranges.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&again.0), bits(&stretch));
        assert_eq!(again.0.tracks, stretch.tracks);
        assert_eq!(again.1, scans);
    }
    // A scan alone is the scan in turn, and no two are alike.
    let laboratory = Laboratory::new(&scene, 11).unwrap();
    let sight = laboratory.sight(flight_number(&laboratory)).unwrap();
    assert_eq!(sight.returns(4), scans[4]);
    assert_ne!(scans[3], scans[4]);
}

#[test]
fn truth_and_motion_capture_tell_where_the_rig_was() {
    let (scene, way) = moving_mirrors();
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let number = flight_number(&laboratory);
    let truth = laboratory.truth().unwrap();
    let mount = Pose::from(&truth.rig_from_sensor);
    let flown = &truth.poses[number];
    assert_eq!((flown.kind, flown.room_from_sensor.len()), (PoseKind::Flight, 8));
    assert!(
        truth.poses[..number]
            .iter()
            .all(|p| p.room_from_sensor.is_empty())
    );
    let rig = |t: f64| {
        let (place, yaw) = way(t);
        Pose::from_parts(Translation3::from(place), yaw_pitch_roll(yaw, 0.0, 0.0))
    };
    let off = |a: &Pose, b: &Pose| {
        (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
    };
    for (scan, pose) in flown.room_from_sensor.iter().enumerate() {
        assert!(off(&Pose::from(pose), &(rig(time(scan, 0)) * mount)) < 1e-12);
    }
    // Frames every 10 ms from the start of the flight on, exact with the ideal profile.
    let stretch = laboratory.stretch(number).unwrap();
    let frames = &stretch.tracks[0].frames;
    assert_eq!(frames.len(), 20);
    for frame in frames {
        let solved = frame.pose.expect("nothing drops out");
        assert!(off(&solved, &rig(frame.time_s - stretch.start_s)) < 1e-12);
    }
    let motion = stretch.into_record().unwrap().motion.expect("it is a flight");
    assert_eq!(motion.frames.len(), 20);
}

/// A calibration that knows a scanner without mirrors and where it sits.
fn undeflected(rig_from_sensor: Pose) -> Calibration {
    let mount = PoseData::from(&rig_from_sensor);
    Calibration {
        schema_version: calibration::SCHEMA_VERSION,
        method: "known".to_owned(),
        frame: "sensor".to_owned(),
        beams: (0..beam::COUNT)
            .map(|b| BeamEstimate::without_angles(b, Status::Direct, None))
            .collect(),
        facets: Vec::new(),
        rig_from_sensor: Some(MountEstimate {
            translation_m: mount.translation_m,
            rotation_xyzw: mount.rotation_xyzw,
            covariance: None,
        }),
        bias: None,
    }
}

/// Distance of a point from the nearest of the planes.
fn off_planes(planes: &[(Vector3<f64>, f64)], p: &Point3<f64>) -> f64 {
    let planes = planes.iter();
    planes
        .map(|(n, h)| (n.dot(&p.coords) - h).abs())
        .fold(f64::INFINITY, f64::min)
}

fn dataset_of_flight(laboratory: &Laboratory) -> Dataset {
    laboratory.dataset().unwrap()
}

#[test]
fn apply_puts_every_reading_of_a_flight_onto_the_walls() {
    // Uniform motion, so that the rule between two frames of motion capture is the truth itself.
    let at = |t: f64| {
        waypoint(
            t,
            [-1.0 + 1.8 * t, 0.3 + 0.8 * t, 1.8],
            [30.0 + 90.0 * t, 0.0, 0.0],
        )
    };
    let laboratory = bare_flight(Attitude::Slerp, vec![at(0.0), at(0.2)]);
    let dataset = dataset_of_flight(&laboratory);
    let number = flight_number(&laboratory);
    let room = walls(laboratory.scene().room.size_m);
    let worst = |dataset: &Dataset| {
        let cloud = apply(
            dataset,
            &undeflected(Pose::identity()),
            Some(number),
            CloudFrame::Room,
        )
        .unwrap();
        assert_eq!(cloud.points.len(), 8 * beam::COUNT);
        let off = cloud.points.iter().map(|p| off_planes(&room, &p.position));
        off.fold(0.0, f64::max)
    };
    // The last steps lie beyond the last frame.
    assert!(worst(&dataset) < 1e-12, "{}", worst(&dataset));
    // Were the rig where it was first seen, points would be off by decimetres.
    let mut frozen = dataset.clone();
    frozen.poses[number].motion = None;
    assert!(worst(&frozen) > 0.1, "{}", worst(&frozen));
}

#[test]
fn calibrations_are_not_made_from_flights() {
    let mut scene = scene(TWO_MIRROR);
    scene.experiment.scans_per_pose = 2;
    scene.experiment.poses_per_group = 3;
    scene.experiment.room_scans = 4;
    scene.experiment.bare_scans = 4;
    scene.scanner.sub_rays = 7;
    let without = Laboratory::new(&scene, 5).unwrap().dataset().unwrap();
    let at = |t: f64, x: f64| waypoint(t, [x, 0.0, 1.8], [0.0; 3]);
    scene.flight = vec![flight(Attitude::Slerp, vec![at(0.0, 0.0), at(0.1, 0.3)])];
    let with = Laboratory::new(&scene, 5).unwrap().dataset().unwrap();
    assert_eq!(with.poses.len(), without.poses.len() + 1);
    assert_eq!(with.poses[..without.poses.len()], without.poses[..]);
    let calibrate = |dataset: &Dataset| calib::calibrate(dataset, Method::Beam, &Options::default()).unwrap();
    let (a, b) = (calibrate(&without), calibrate(&with));
    assert_eq!(a, b);
    assert!(a.beams.iter().filter(|b| b.status == Status::Solved).count() > 200);
    let score = |d: &Dataset| {
        let score = catoptric::score::score(d, &a, None);
        serde_json::to_value(&score).unwrap()
    };
    assert_eq!(score(&without), score(&with));
}

/// Distance of a point from the nearest surface of the scene `flight`, in metres.
fn off_furniture(scene: &Scene, p: &Point3<f64>) -> f64 {
    use catoptric::sim::scene::SurfaceShape;
    let mut off = off_planes(&walls(scene.room.size_m), p);
    for surface in &scene.room.surface {
        let place = Pose::from_parts(
            Translation3::from(Vector3::from(surface.position_m)),
            yaw_pitch_roll(surface.yaw_deg.to_radians(), 0.0, 0.0),
        );
        let q = place.inverse() * p;
        let distance = match &surface.shape {
            SurfaceShape::Box(shape) => {
                let d = q.coords.abs() - Vector3::from(shape.size_m) * 0.5;
                let outside = d.sup(&Vector3::zeros()).norm();
                (outside + d.max().min(0.0)).abs()
            }
            SurfaceShape::Cylinder(shape) => {
                let radial = libm::hypot(q.x, q.y) - 0.5 * shape.diameter_m;
                let along = q.z.abs() - 0.5 * shape.height_m;
                (libm::hypot(radial.max(0.0), along.max(0.0)) + radial.max(along).min(0.0)).abs()
            }
            // The tent: four slopes from a square of 1.2 m to a point at 0.9 m, on the floor.
            SurfaceShape::Mesh(_) => {
                let slope = libm::hypot(0.6, 0.9);
                let side = q.x.abs().max(q.y.abs());
                ((0.9 * side + 0.6 * q.z - 0.54) / slope).abs()
            }
            _ => f64::INFINITY,
        };
        off = off.min(distance);
    }
    off
}

#[test]
fn a_calibrated_rig_maps_a_furnished_room_in_flight() {
    let sets = ["scans_per_pose=20", "room_scans=20", "bare_scans=20"].map(|s| format!("experiment.{s}"));
    let scene = load(&file("flight"), &sets).unwrap();
    let laboratory = Laboratory::new(&scene, scene.seed).unwrap();
    let dataset = laboratory.dataset().unwrap();
    let calibration = calib::calibrate(&dataset, Method::Beam, &Options::default()).unwrap();
    let number = flight_number(&laboratory);
    let cloud = apply(&dataset, &calibration, Some(number), CloudFrame::Room).unwrap();
    let mut off: Vec<f64> = cloud
        .points
        .iter()
        .map(|p| off_furniture(&scene, &p.position))
        .collect();
    off.sort_by(f64::total_cmp);
    let quantile = |q: usize| off[off.len() * q / 100] * 1e3;
    eprintln!(
        "flight: {} points, off by {:.1} / {:.1} / {:.1} mm (50, 90, 99 %)",
        off.len(),
        quantile(50),
        quantile(90),
        quantile(99)
    );
    assert!(off.len() > 100_000, "{}", off.len());
    // Range noise of 4.5 mm, and E_a, which apply cannot take off, of up to some centimetres at grazing incidence.
    assert!(
        quantile(50) < 10.0 && quantile(90) < 40.0,
        "{} {}",
        quantile(50),
        quantile(90)
    );
    // Furniture is there: points on none of the walls.
    let room = walls(scene.room.size_m);
    let inside = cloud
        .points
        .iter()
        .filter(|p| off_planes(&room, &p.position) > 0.2);
    assert!(inside.count() > 2000);
}

#[test]
fn a_flight_is_recorded_applied_and_told_by_the_program() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file("flight");
    let scene = scene.to_str().unwrap();
    let mut arguments = vec![
        "simulate",
        scene,
        "--out",
        "set",
        "--returns",
        "--readings",
        "--json",
    ];
    for set in [
        "experiment.scans_per_pose=4",
        "experiment.room_scans=8",
        "experiment.bare_scans=8",
        "experiment.poses_per_group=3",
        "scanner.sub_rays=7",
        "flight.0.scans=5",
    ] {
        arguments.extend(["--set", set]);
    }
    let output = run(folder.path(), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let dataset = io::read_dataset(&folder.path().join("set")).unwrap();
    let flown = dataset.poses.last().unwrap();
    assert_eq!((flown.label.kind, flown.label.scans), (PoseKind::Flight, 5));
    assert_eq!(flown.label.flight.as_deref(), Some("over the furniture"));
    let motion = flown.motion.as_ref().unwrap();
    // 125 ms at 100 Hz, fewer only for frames in which a marker too many dropped out.
    assert!(
        motion.frames.len() >= 11 && motion.frames.len() <= 12,
        "{}",
        motion.frames.len()
    );
    assert!((motion.scan_period_s - SCAN_S).abs() < 1e-12);

    let table = |name: &str| {
        let text = std::fs::read_to_string(folder.path().join("set/truth").join(name)).unwrap();
        let mut lines = text
            .lines()
            .map(|l| l.split(',').map(str::to_owned).collect::<Vec<_>>());
        let header = lines.next().unwrap();
        (header, lines.collect::<Vec<_>>())
    };
    let number = flown.label.pose.to_string();
    let (header, rows) = table("returns.csv");
    assert_eq!(header.last().map(String::as_str), Some("scan"));
    let scans = |rows: &[Vec<String>], flying: bool| {
        let rows = rows.iter().filter(|r| (r[0] == number) == flying);
        rows.map(|r| r.last().unwrap().clone())
            .collect::<std::collections::BTreeSet<_>>()
    };
    let numbers = ["0", "1", "2", "3", "4"].map(str::to_owned);
    assert_eq!(scans(&rows, true), numbers.into());
    assert_eq!(scans(&rows, false), [String::new()].into());
    // A reading of the flight is the return of its own scan plus its errors, rounded.
    let (_, readings) = table("readings.csv");
    let mut compared = 0;
    for r in readings
        .iter()
        .filter(|r| r[0] == number && r[3] == "0" && r[4] == "0")
    {
        let found = rows
            .iter()
            .find(|row| row[0] == number && row[1] == r[2] && row.last() == Some(&r[1]));
        let found = found.expect("it has an echo");
        let value = |row: &[String], i: usize| row[i].parse::<f64>().unwrap();
        let exact: f64 = [4, 8, 9, 10, 11, 12].iter().map(|i| value(found, *i)).sum();
        let errors: f64 = (5..10).map(|i| value(r, i)).sum();
        if let Some(reading) = Some(value(r, 10)).filter(|v| v.is_finite()) {
            assert!((reading - exact - errors).abs() < 0.5001e-3, "{r:?} {found:?}");
            compared += 1;
        }
        if compared == 500 {
            break;
        }
    }
    assert_eq!(compared, 500);

    let output = run(folder.path(), &["calibrate", "set", "--out", "calibration.json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let apply = [
        "apply",
        "set",
        "calibration.json",
        "--pose",
        &number,
        "--frame",
        "room",
        "--out",
        "cloud.ply",
    ];
    let output = run(folder.path(), &apply);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("points"), "{}", stdout(&output));
}

#[test]
fn flights_that_cannot_be_are_refused_where_they_stand() {
    let base = format!("{BARE}\n[[flight]]\nname = \"f\"\n");
    let two = "waypoint = [\n  { time_s = 1, position_m = [0, 0, 1] },\n  { time_s = 2, position_m = [1, 0, 1] },\n]\n";
    let cases = [
        (
            "waypoint = [{ time_s = 1, position_m = [0, 0, 1] }]\n".to_owned(),
            "waypoint",
            "2",
        ),
        (
            two.replace("time_s = 2", "time_s = 1"),
            "flight[0].waypoint[1].time_s",
            "strictly increasing",
        ),
        (
            two.replace("time_s = 2", "time_s = 1.02"),
            "flight[0].waypoint[1].time_s",
            "0.02 s",
        ),
        (format!("scans = 41\n{two}"), "flight[0].scans", "40 whole scans"),
        (
            two.replace("[1, 0, 1] }", "[1, 0, 1], yaw_deg = 180 }"),
            "flight[0].waypoint[1]",
            "which way round",
        ),
        (
            two.replace("[1, 0, 1]", "[7, 0, 1]"),
            "flight[0].waypoint[1].position_m",
            "beyond the +x wall",
        ),
        (
            two.replace("position_m = [1", "positon_m = [1"),
            "positon_m",
            "position_m",
        ),
        (format!("attitude = \"sqad\"\n{two}"), "sqad", "squad"),
        (
            format!("{two}[[flight]]\nname = \"f\"\n{two}"),
            "flight[1].name",
            "\"f\"",
        ),
    ];
    for (text, key, needed) in cases {
        let (folder, _) = folder_with(&format!("{base}{text}"));
        let output = run(folder.path(), &["check", "scene.toml"]);
        assert_eq!(output.status.code(), Some(2), "{text}");
        let said = stderr(&output);
        assert!(said.contains(key) && said.contains(needed), "{text}\n{said}");
        assert!(said.contains("scene.toml:"), "{said}");
    }
    // Markers are needed to know where it was.
    let text = format!("{base}{two}")
        .replace("[superstructure]", "[superstructure]\n#")
        .replace("\"b\"", "\"a\"");
    let (folder, _) = folder_with(&text);
    assert_eq!(
        run(folder.path(), &["check", "scene.toml"]).status.code(),
        Some(2)
    );
    let (folder, _) = folder_with(&format!("{base}{two}"));
    let output = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("1 flight"), "{}", stdout(&output));
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
            // A ray that grazes an edge may fall to either side.
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
