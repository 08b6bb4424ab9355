//! Reflections, deflections, and ray paths under motions and in any order of the surfaces.

use super::{cases, direction, vector};
use crate::scenes::scene;
use catoptric::cast::Ray;
use catoptric::model::frame::yaw_pitch_roll;
use catoptric::model::{BoardPlane, Deflection, MirrorPlane, Pose, PoseData, beam, cloud, mirror, range};
use catoptric::sim::Scene;
use catoptric::sim::scene::{PlanePolygon, PlaneShape, RoomBox, RoomMirror, RoomSurface, SurfaceShape};
use catoptric::sim::trace::{Fate, Scenery, Vertex};
use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};
use proptest::collection::vec;
use proptest::prelude::*;

/// A mirror 5 to 15 cm from the origin that faces it.
fn mirror_plane() -> impl Strategy<Value = MirrorPlane> {
    (direction(), 0.05..0.15_f64).prop_map(|(normal, h)| MirrorPlane { normal, offset: -h })
}

fn pose() -> impl Strategy<Value = Pose> {
    (vector(), vector()).prop_map(|(shift, turn)| {
        Pose::from_parts(
            Translation3::from(shift * 3.0),
            UnitQuaternion::from_scaled_axis(turn * 3.0),
        )
    })
}

proptest! {
    #![proptest_config(cases(500))]

    #[test]
    fn reflecting_twice_is_the_identity(u in direction(), m in direction()) {
        let once = mirror::reflect(&u, &m);
        let twice = mirror::reflect(&once, &m);
        prop_assert!((twice.into_inner() - u.into_inner()).norm() < 2e-15);
        // Equal angles, and the component in the plane of the mirror is preserved.
        prop_assert!((once.dot(&m) + u.dot(&m)).abs() < 1e-15);
        prop_assert!((once.cross(&m) - u.cross(&m)).norm() < 1e-15);
    }

    #[test]
    fn rotating_a_mirror_by_e_rotates_the_ray_by_2_e(u in direction(), m in direction(), e in 1e-6..0.5_f64) {
        prop_assume!(u.cross(&m).norm() > 0.1);
        let axis = Unit::new_normalize(u.cross(&m));
        let turned = UnitQuaternion::from_axis_angle(&axis, e) * m;
        let angle = beam::angle_between(&mirror::reflect(&u, &m), &mirror::reflect(&u, &turned));
        let expected = if 2.0 * e > std::f64::consts::PI { std::f64::consts::TAU - 2.0 * e } else { 2.0 * e };
        prop_assert!((angle - expected).abs() < 1e-14, "{} against {}", angle, expected);
    }

    #[test]
    fn a_bounce_keeps_the_length_of_the_unfolded_path(plane in mirror_plane(), u in direction(), s in 0.0..20.0_f64) {
        prop_assume!(plane.normal.dot(&u) < -0.05);
        let to_mirror = plane.offset / plane.normal.dot(&u);
        let at = Point3::from(u.into_inner() * to_mirror);
        let end = at + mirror::reflect(&u, &plane.normal).into_inner() * s;
        let image = plane.mirror_point(&end);
        // The image is straight ahead, at the length of the folded path; 20 m have 4e-15 m of rounding each.
        prop_assert!((image - u.into_inner() * (to_mirror + s)).coords.norm() < 5e-14);
        prop_assert!((plane.mirror_point(&image) - end).norm() < 5e-14);
    }

    #[test]
    fn apply_undoes_deflect(
        plane in mirror_plane(),
        azimuth in -2.35..2.35_f64,
        board in (vector(), direction()),
    ) {
        let u = beam::direction(azimuth);
        prop_assume!(plane.normal.dot(&u) < -0.1);
        let deflection = plane.deflect(u).expect("it faces the beam");
        let exit = deflection.exit_direction(azimuth);
        let again = Deflection::from_exit(azimuth, &exit, deflection.distance);
        prop_assert!(beam::angle_between(&exit, &again.exit_direction(azimuth)) < 2e-15);
        let board = BoardPlane::new(Point3::from(board.0 * 4.0), board.1);
        prop_assume!(board.normal.dot(&exit).abs() > 0.2);
        let Some(r) = range::predict(&deflection, azimuth, &board) else { return Ok(()) };
        let point = cloud::lift(&deflection, azimuth, r);
        // A tilt of up to 0.2 and paths of up to 35 m make rounding errors a few times 1e-14.
        prop_assert!(board.normal.dot(&(point - board.point)).abs() < 5e-14);
        // Unfolded, the point is on the beam, at its range.
        prop_assert!((plane.mirror_point(&point) - u.into_inner() * r).coords.norm() < 5e-14);
    }

    #[test]
    fn a_pose_survives_its_file_and_its_inverse(pose in pose(), p in vector()) {
        let p = Point3::from(p * 10.0);
        let back = Pose::from(&PoseData::from(&pose));
        prop_assert!((back * p - pose * p).norm() < 2e-14);
        prop_assert!((pose.inverse() * (pose * p) - p).norm() < 2e-14);
    }

    #[test]
    fn yaw_pitch_and_roll_are_three_turns_in_this_order(
        yaw in -3.1..3.1_f64, pitch in -1.5..1.5_f64, roll in -3.1..3.1_f64, v in vector(),
    ) {
        let about = |axis: Unit<Vector3<f64>>, angle: f64| UnitQuaternion::from_axis_angle(&axis, angle);
        let z = about(Vector3::z_axis(), yaw);
        let y = about(z * Vector3::y_axis(), pitch);
        let x = about(y * (z * Vector3::x_axis()), roll);
        prop_assert!((yaw_pitch_roll(yaw, pitch, roll) * v - x * (y * (z * v))).norm() < 1e-14);
    }
}

/// A square at a position, facing along its normal, as corners.
fn square(center: Vector3<f64>, normal: &Unit<Vector3<f64>>, half: f64) -> Vec<[f64; 3]> {
    let across = Unit::new_normalize(normal.cross(&Vector3::new(0.3, -0.5, 0.8)));
    let (x, y) = (across.into_inner() * half, normal.cross(&across) * half);
    [-x - y, x - y, x + y, y - x]
        .map(|corner| (center + corner).into())
        .to_vec()
}

/// Six mirrors around the origin and four boards and a box farther out.
#[derive(Debug, Clone)]
struct Place {
    mirrors: Vec<(Vector3<f64>, Unit<Vector3<f64>>)>,
    boards: Vec<(Vector3<f64>, Unit<Vector3<f64>>)>,
}

fn place() -> impl Strategy<Value = Place> {
    let around = |radius: f64| {
        (direction(), vector()).prop_map(move |(at, off)| {
            let normal = Unit::new_normalize(-at.into_inner() + off * 0.7);
            (at.into_inner() * radius, normal)
        })
    };
    (vec(around(1.0), 6), vec(around(3.0), 4)).prop_map(|(mirrors, boards)| Place { mirrors, boards })
}

impl Place {
    /// The scene after a motion, with its parts in an order that starts at a given number.
    fn scene(&self, motion: &Pose, first: usize) -> Scene {
        let mut scene: Scene = scene("schema_version = 1\nname = \"place\"\n");
        let moved = |corners: Vec<[f64; 3]>| PlanePolygon {
            corners_m: corners
                .into_iter()
                .map(|c| (motion * Point3::from(c)).coords.into())
                .collect(),
        };
        let mirrors = self
            .mirrors
            .iter()
            .enumerate()
            .map(|(i, (at, normal))| RoomMirror {
                name: format!("mirror {i}"),
                shape: PlaneShape::Polygon(moved(square(*at, normal, 0.5))),
                position_m: [0.0; 3],
                yaw_deg: 0.0,
                pitch_deg: 0.0,
                roll_deg: 0.0,
                two_sided: false,
                thickness_mm: 0.0,
                glass: None,
            });
        scene.room.mirror = mirrors.collect();
        let surface = |name: String, shape, position_m, [yaw, pitch, roll]: [f64; 3]| RoomSurface {
            name,
            shape,
            position_m,
            yaw_deg: yaw,
            pitch_deg: pitch,
            roll_deg: roll,
            color: "white".to_owned(),
        };
        let boards = self.boards.iter().enumerate().map(|(i, (at, normal))| {
            let shape = SurfaceShape::Polygon(moved(square(*at, normal, 2.0)));
            surface(format!("board {i}"), shape, [0.0; 3], [0.0; 3])
        });
        scene.room.surface = boards.collect();
        let (roll, pitch, yaw) = motion.rotation.euler_angles();
        scene.room.surface.push(surface(
            "box".to_owned(),
            SurfaceShape::Box(RoomBox {
                size_m: [0.3, 0.4, 0.5],
            }),
            motion.translation.vector.into(),
            [yaw, pitch, roll].map(f64::to_degrees),
        ));
        let (mirrors, surfaces) = (scene.room.mirror.len(), scene.room.surface.len());
        scene.room.mirror.rotate_left(first % mirrors);
        scene.room.surface.rotate_left(first % surfaces);
        if first % 2 == 1 {
            scene.room.mirror.reverse();
            scene.room.surface.reverse();
        }
        scene
    }
}

/// The vertices of a ray's path, with the names of the surfaces.
fn path(scene: &Scene, ray: &Ray) -> (Vec<(String, Vertex)>, Fate) {
    let scenery = Scenery::new(scene).expect("it has shapes");
    let tracer = scenery.tracer(20).expect("colors are built in");
    let names = tracer.surfaces();
    let mut vertices = Vec::new();
    let fate = tracer.follow(ray, &mut vertices);
    (
        vertices
            .into_iter()
            .map(|v| (names[v.surface].to_owned(), v))
            .collect(),
        fate,
    )
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn paths_move_with_the_scene(place in place(), motion in pose(), from in vector(), to in direction()) {
        let ray = Ray { origin: Point3::from(from * 0.4 + Vector3::repeat(0.35)), direction: to };
        let moved = Ray { origin: motion * ray.origin, direction: motion * ray.direction };
        let (before, fate) = path(&place.scene(&Pose::identity(), 0), &ray);
        let (after, fate_after) = path(&place.scene(&motion, 0), &moved);
        prop_assert_eq!(fate, fate_after);
        prop_assert_eq!(before.len(), after.len());
        for ((name, v), (other, w)) in before.iter().zip(&after) {
            prop_assert_eq!(name, other);
            // Coordinates of up to 10 m are rounded to 2e-15 m at every step, and a bounce doubles an angular error.
            prop_assert!((motion * v.point - w.point).norm() < 1e-13, "{} against {}", v.point, w.point);
            prop_assert!((v.path - w.path).abs() < 1e-13);
        }
    }

    #[test]
    fn the_order_of_surfaces_changes_no_bit(place in place(), first in 1..30_usize, from in vector(), to in direction()) {
        let ray = Ray { origin: Point3::from(from * 0.4 + Vector3::repeat(0.35)), direction: to };
        let (before, fate) = path(&place.scene(&Pose::identity(), 0), &ray);
        let (after, fate_after) = path(&place.scene(&Pose::identity(), first), &ray);
        prop_assert_eq!(fate, fate_after);
        let plain = |path: Vec<(String, Vertex)>| -> Vec<_> {
            path.into_iter().map(|(name, v)| (name, v.point, v.direction, v.path)).collect()
        };
        prop_assert_eq!(plain(before), plain(after));
    }
}

#[test]
fn the_random_places_have_chains_in_them() {
    // The two properties above are not vacuous.
    use proptest::strategy::ValueTree;
    use proptest::test_runner::TestRunner;
    let mut runner = TestRunner::new(cases(1));
    let mut lengths = [0; 4];
    for _ in 0..300 {
        let drawn = (place(), vector(), direction())
            .new_tree(&mut runner)
            .expect("drawn")
            .current();
        let ray = Ray {
            origin: Point3::from(drawn.1 * 0.4 + Vector3::repeat(0.35)),
            direction: drawn.2,
        };
        let (met, _) = path(&drawn.0.scene(&Pose::identity(), 0), &ray);
        lengths[met.len().min(3)] += 1;
    }
    assert!(
        lengths[1] > 50 && lengths[2] > 20 && lengths[3] > 5,
        "{lengths:?}"
    );
}
