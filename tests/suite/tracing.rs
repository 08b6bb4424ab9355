//! `trace`: chains of mirrors in any attitude, glass, two-sided mirrors, meshes, and its files.
//!
//! Proven are the paths of light and its remaining power; the readings of detectors are covered elsewhere.

use crate::common::{catoptric, run, stderr, stdout};
use crate::traps::{file, forward, path, ray, traced_path, trap};
use catoptric::cast::Ray;
use catoptric::files::{mesh, npy, scene};
use catoptric::sim::light::Role;
use catoptric::sim::noise::{Draws, Purpose};
use catoptric::sim::scene::{Glass, PlanePolygon, PlaneRectangle, PlaneShape, RoomMirror};
use catoptric::sim::trace::Fate;
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use nalgebra::{Matrix3, Point3, Unit, Vector3};

fn mirror(name: &str, corners: &[Point3<f64>]) -> RoomMirror {
    RoomMirror {
        name: name.to_owned(),
        shape: PlaneShape::Polygon(PlanePolygon {
            corners_m: corners.iter().map(|c| c.coords.into()).collect(),
        }),
        position_m: [0.0; 3],
        yaw_deg: 0.0,
        pitch_deg: 0.0,
        roll_deg: 0.0,
        two_sided: false,
        thickness_mm: 0.0,
        glass: None,
    }
}

/// A chain of tilted rectangles along a polyline: each mirror is at a knee and bisects the two legs.
fn chain(knees: &[Point3<f64>], draws: &mut Draws) -> Vec<Vec<Point3<f64>>> {
    knees
        .windows(3)
        .map(|k| {
            let normal = Unit::new_normalize((k[0] - k[1]).normalize() + (k[2] - k[1]).normalize());
            let across = Unit::new_normalize(normal.cross(&draws.normal3()));
            let (x, y) = (across.into_inner() * 0.05, normal.cross(&across) * 0.03);
            vec![k[1] - x - y, k[1] + x - y, k[1] + x + y, k[1] - x + y]
        })
        .collect()
}

/// The image of a point behind successive mirrors, each a 3 × 3 reflection in a plane: no ray is followed.
fn unfolded(corners: &[Vec<Point3<f64>>], end: &Point3<f64>) -> Point3<f64> {
    corners.iter().rev().fold(*end, |p, c| {
        let n = (c[1] - c[0]).cross(&(c[2] - c[0])).normalize();
        let fold = Matrix3::identity() - n * n.transpose() * 2.0;
        c[0] + fold * (p - c[0])
    })
}

#[test]
fn chains_of_tilted_mirrors_agree_with_their_images() {
    let mut draws = Draws::new(23, Purpose::Placement, 0);
    for length in 4..=9 {
        // A zigzag with random knees: the legs are about one meter long and do not cross the other mirrors.
        let knees: Vec<Point3<f64>> = (0..length + 2)
            .map(|i| {
                let side = if i % 2 == 0 { -0.5 } else { 0.5 };
                Point3::new(0.4 * f64::from(i), side, 0.0) + draws.normal3() * 0.05
            })
            .collect();
        let corners = chain(&knees, &mut draws);
        let mut scene = trap("mirror-and-wall");
        scene.room.surface.clear();
        scene.room.mirror = corners
            .iter()
            .enumerate()
            .map(|(i, c)| mirror(&format!("m{i}"), c))
            .collect();
        for _ in 0..20 {
            let aim = knees[1] + draws.normal3() * 0.0005;
            let start = Ray {
                origin: knees[0],
                direction: Unit::new_normalize(aim - knees[0]),
            };
            let (vertices, met, fate) = traced_path(&scene, &start);
            assert_eq!(fate, Fate::Escaped);
            assert_eq!(met, (0..length).map(|i| format!("m{i}")).collect::<Vec<_>>());
            for (i, vertex) in vertices.iter().enumerate() {
                // In unfolded space, the path is the straight line from its origin to the image of the vertex.
                let image = unfolded(&corners[..i], &vertex.point);
                let straight = image - start.origin;
                assert!((vertex.path - straight.norm()).abs() < 1e-12);
                let off = straight - start.direction.into_inner() * straight.dot(&start.direction);
                assert!(off.norm() < 1e-12, "mirror {i}: {} off", off.norm());
                let n = (corners[i][1] - corners[i][0])
                    .cross(&(corners[i][2] - corners[i][0]))
                    .normalize();
                assert!(n.dot(&(vertex.point - corners[i][0])).abs() < 1e-12);
            }
        }
    }
}

/// Rz(yaw)·Ry(pitch)·Rx(roll), written out.
fn attitude([yaw, pitch, roll]: [f64; 3]) -> Matrix3<f64> {
    let ([sy, cy], [sp, cp], [sr, cr]) = (sin_cos(yaw), sin_cos(pitch), sin_cos(roll));
    Matrix3::new(
        cy * cp,
        cy * sp * sr - sy * cr,
        cy * sp * cr + sy * sr,
        sy * cp,
        sy * sp * sr + cy * cr,
        sy * sp * cr - cy * sr,
        -sp,
        cp * sr,
        cp * cr,
    )
}

fn sin_cos(angle: f64) -> [f64; 2] {
    [libm::sin(angle), libm::cos(angle)]
}

#[test]
fn chains_of_rectangles_turned_by_yaw_pitch_and_roll_agree_with_matrices() {
    // The corners of a mirror 0.2 m wide, meters from the origin, determine its normal to about 1e-14; seven mirrors
    // hit at up to 60° increase that to about 1e-13 m.
    let mut draws = Draws::new(29, Purpose::Placement, 0);
    let mut compared = 0;
    for round in 0..300 {
        let length = 4 + round % 4;
        let mut scene = trap("mirror-and-wall");
        scene.room.surface.clear();
        scene.room.mirror.clear();
        let origin = draws.normal3();
        let first = draws.normal3().normalize();
        // The expected chain: points, outgoing directions, and path lengths.
        let (mut at, mut along, mut total) = (origin, first, 0.0);
        let mut expected = Vec::new();
        while scene.room.mirror.len() < length {
            let angles = [0; 3].map(|_| draws.within(3.1));
            let turned = attitude(angles);
            let normal = draws.normal3().normalize();
            let normal_in_room = turned * normal;
            if normal_in_room.dot(&along) > -0.5 {
                continue;
            }
            let leg = 0.5 + draws.uniform();
            at += along * leg;
            total += leg;
            along -= normal_in_room * (2.0 * normal_in_room.dot(&along));
            // The ray hits the rectangle off its center.
            let center = draws.normal3();
            let beside = normal.cross(&draws.normal3()).normalize() * 0.05;
            scene.room.mirror.push(RoomMirror {
                shape: PlaneShape::Rectangle(PlaneRectangle {
                    center_m: center.into(),
                    normal: (normal * 2.5).into(),
                    width_m: 0.2,
                    height_m: 0.14,
                }),
                position_m: (at - turned * (center + beside)).into(),
                yaw_deg: angles[0].to_degrees(),
                pitch_deg: angles[1].to_degrees(),
                roll_deg: angles[2].to_degrees(),
                ..mirror(&format!("m{}", expected.len()), &[])
            });
            expected.push((at, along, total));
        }
        let (vertices, met, fate) = traced_path(&scene, &ray(origin.into(), first.into()));
        if met.iter().enumerate().any(|(i, name)| *name != format!("m{i}")) || met.len() < length {
            // Another mirror of the chain is in between.
            continue;
        }
        compared += 1;
        for (vertex, (point, direction, path)) in vertices.iter().zip(&expected) {
            assert!(
                (vertex.point.coords - point).norm() < 1e-12,
                "{vertex:?} against {point:?}"
            );
            assert!((vertex.path - path).abs() < 1e-12);
            assert!((vertex.direction.unwrap().into_inner() - direction).norm() < 1e-12);
        }
        assert_eq!(fate, Fate::Escaped);
    }
    assert!(compared > 200, "{compared} of 300 chains");
}

/// The path through a glass plate by Snell's law in angles: the offset along the plate where it leaves, and its optical
/// length.
fn plate(angle: f64, index: f64, thickness: f64) -> (f64, f64) {
    let inside = libm::asin(libm::sin(angle) / index);
    // Down at the angle inside, and up again after the silvering.
    let down = thickness * libm::tan(inside);
    let leg = libm::hypot(down, thickness);
    (2.0 * down, 2.0 * index * leg)
}

#[test]
fn a_glass_mirror_lengthens_and_shifts_but_does_not_rotate() {
    let mut scene = trap("mirror-and-wall");
    for (thickness_mm, longer_mm, walk_mm) in [(1.0, 3.4, 1.1), (2.0, 6.8, 2.1), (3.0, 10.3, 3.2)] {
        scene.room.mirror[0].glass = Some(Glass {
            index: 1.51,
            thickness_mm,
            ghost: false,
        });
        let (vertices, met, _) = traced_path(&scene, &ray([0.0; 3], [1.0, 0.0, 0.0]));
        assert_eq!(met, ["fold", "fold", "fold", "wall"]);
        let (walk, longer) = plate(std::f64::consts::FRAC_PI_4, 1.51, thickness_mm * 1e-3);
        assert!(((vertices[2].point - vertices[0].point).norm() - walk).abs() < 1e-15);
        // The light leaves farther along the mirror, which is closer to the wall by walk/√2.
        let expected = 3.75 + longer - walk * 0.5_f64.sqrt();
        assert!((path(&vertices) - expected).abs() < 1e-12);
        assert!((longer * 1e3 - longer_mm).abs() < 0.05 && (walk * 1e3 - walk_mm).abs() < 0.05);
        let out = vertices[2].direction.unwrap();
        assert!((out.into_inner() - Vector3::y()).norm() < 1e-15);
        // Snell's law at both passages of the front, with the direction in the glass from the vertices.
        let normal = Vector3::new(-1.0, 1.0, 0.0).normalize();
        for (direction, sign) in [(vertices[0].direction, -1.0), (vertices[1].direction, 1.0)] {
            let cos = sign * normal.dot(&direction.unwrap());
            assert!((1.51 * (1.0 - cos * cos).sqrt() - 0.5_f64.sqrt()).abs() < 1e-12);
        }
    }
}

#[test]
fn a_ghost_and_dust_take_their_energy_from_the_beam() {
    let mut scene = trap("label");
    scene.superstructure.mirror.thickness_mm = 3.0;
    let power = |scene: &Scene| forward(scene).power;
    let glass = |ghost| {
        Some(Glass {
            index: 1.51,
            thickness_mm: 3.0,
            ghost,
        })
    };
    scene.superstructure.mirror.glass = glass(false);
    let alone = forward(&scene);
    scene.superstructure.mirror.glass = glass(true);
    let found = forward(&scene);
    // Fresnel's equations at 45°, for the two polarizations: sin² and tan² of the difference of the angles over their
    // sum.
    let (a, b) = (std::f64::consts::FRAC_PI_4, libm::asin(0.5_f64.sqrt() / 1.51));
    let square = |x: f64| x * x;
    let front =
        0.5 * (square(libm::sin(a - b) / libm::sin(a + b)) + square(libm::tan(a - b) / libm::tan(a + b)));
    // A single return: both paths end on the ceiling via the same facet.
    assert!((found.share - (square(1.0 - front) + front)).abs() < 1e-12 && found.share < 1.0);
    let (walk, longer) = plate(a, 1.51, 3e-3);
    let far = alone.geometric;
    assert!((far - (3.0 + longer - walk * 0.5_f64.sqrt())).abs() < 1e-12);
    // The mirror's reflectivity is 0.9; the ghost loses nothing to it, and its path of 3 m has no glass.
    let ghost = alone.power * square(front / 0.9) * square(far / 3.0);
    let expected = alone.power * square(square(1.0 - front)) + ghost;
    assert!((found.power / expected - 1.0).abs() < 1e-12);
    scene.superstructure.mirror.glass = None;
    let clean = power(&scene);
    scene.superstructure.mirror.diffuse_reflectivity = 0.1;
    // Dust 1 m away at 45° is the first echo; the ceiling, 3 m away and face on, is another.
    let dusty = forward(&scene);
    let on_mirror = clean / square(0.9) * (0.1 / 0.9) * 9.0 * 0.5_f64.sqrt();
    assert_eq!(dusty.role, Role::Facet(0));
    assert!((dusty.power / on_mirror - 1.0).abs() < 1e-12 && (dusty.share - 0.1).abs() < 1e-15);
    assert!((dusty.range() - 1.0).abs() < 1e-9, "{dusty:?}");
}

#[test]
fn two_sided_mirrors_reflect_with_their_backs_too_at_their_thickness() {
    let mut scene = trap("facet-edge");
    let back = ray([2.5, 0.02, 0.0], [-1.0, 0.0, 0.0]);
    let (vertices, met, _) = traced_path(&scene, &back);
    assert_eq!((met, path(&vertices)), (vec!["plate".to_owned()], 1.5));
    assert_eq!(vertices[0].direction, None, "an opaque back");
    for thickness_mm in [0.0, 4.0] {
        scene.room.mirror[0].two_sided = true;
        scene.room.mirror[0].thickness_mm = thickness_mm;
        let (vertices, met, _) = traced_path(&scene, &back);
        assert_eq!(met, ["plate", "ahead"]);
        let to_back = 1.5 - thickness_mm * 1e-3;
        assert!((path(&vertices) - (to_back + to_back + 0.5)).abs() < 1e-14);
        let (_, met, _) = traced_path(&scene, &ray([0.0; 3], [1.0, 0.0, 0.0]));
        assert_eq!(met, ["plate", "behind"]);
    }
    // The rim of the body is opaque.
    let (vertices, met, _) = traced_path(&scene, &ray([1.002, 1.0, 0.0], [0.0, -1.0, 0.0]));
    assert_eq!((met, vertices[0].direction), (vec!["plate".to_owned()], None));
    assert!((path(&vertices) - 0.9).abs() < 1e-14);
}

/// A cube with a given edge around the origin as STL text.
fn cube_stl(edge: f64) -> String {
    let h = 0.5 * edge;
    let mut text = "solid cube\n".to_owned();
    for axis in 0..3 {
        for side in [-h, h] {
            let corner = |a: f64, b: f64| {
                let mut p = [0.0; 3];
                (p[axis], p[(axis + 1) % 3], p[(axis + 2) % 3]) = (side, a, b);
                format!("vertex {} {} {}\n", p[0], p[1], p[2])
            };
            let mut square = [corner(-h, -h), corner(h, -h), corner(h, h), corner(-h, h)];
            if side < 0.0 {
                square.reverse();
            }
            for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                let corners = [&square[a], &square[b], &square[c]].map(String::as_str).concat();
                text.push_str(&format!(
                    "facet normal 0 0 0\nouter loop\n{corners}endloop\nendfacet\n"
                ));
            }
        }
    }
    text + "endsolid cube\n"
}

#[test]
fn a_mesh_is_read_next_to_its_scene_and_kept_with_the_truth() {
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(file("label")).unwrap();
    let text = format!(
        "{text}\n[[superstructure.post]]\nname = \"block\"\ncenter_mm = [300, 300, 0]\n\
         shape.mesh = {{ file = \"parts/cube.stl\" }}\n\
         [[superstructure.post]]\nname = \"rod\"\ncenter_mm = [-300, 300, 0]\n\
         shape.cylinder = {{ diameter_mm = 50, height_mm = 100 }}\n"
    );
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let missing = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(missing.status.code(), Some(3));
    assert!(
        stderr(&missing).contains("`superstructure.post[0].shape.mesh.file`")
            && stderr(&missing).contains("cube.stl: cannot be read"),
        "{}",
        stderr(&missing)
    );
    std::fs::create_dir(folder.path().join("parts")).unwrap();
    let cube = folder.path().join("parts/cube.stl");
    std::fs::write(&cube, "solid\nfacet\nvertex 1 2 x\n").unwrap();
    let damaged = run(folder.path(), &["check", "scene.toml"]);
    assert_eq!(damaged.status.code(), Some(2));
    assert!(
        stderr(&damaged).contains("cube.stl:3:1: \"x\" is not a number"),
        "{}",
        stderr(&damaged)
    );
    std::fs::write(&cube, cube_stl(100.0)).unwrap();
    let output = run(folder.path(), &["simulate", "scene.toml", "--out", "a"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    // The dataset can be recreated without the file.
    std::fs::remove_file(&cube).unwrap();
    let output = run(folder.path(), &["simulate", "a/truth/scene.toml", "--out", "b"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    for name in ["observations.mcap", "truth/truth.json", "truth/scene.toml"] {
        let read = |dataset: &str| std::fs::read(folder.path().join(dataset).join(name)).unwrap();
        assert!(read("a") == read("b"), "{name}");
    }
    // The beam at 45° hits the edge of the cube, 0.25·√2 m away; the one at 135° the side of the rod.
    let kept = scene::load(&folder.path().join("b/truth/scene.toml"), &[]).unwrap();
    let returns = Laboratory::new(&kept, 1).unwrap().returns(1).unwrap();
    let at = |degrees: f64| {
        returns[ust20lx::nearest(degrees.to_radians()).unwrap()]
            .as_ref()
            .unwrap()
            .range()
    };
    assert!((at(45.0) - 0.25 * 2.0_f64.sqrt()).abs() < 1e-12, "{}", at(45.0));
    assert!(
        (at(135.0) - (0.3 * 2.0_f64.sqrt() - 0.025)).abs() < 1e-12,
        "{}",
        at(135.0)
    );
}

#[test]
fn trace_reads_and_writes_both_formats_identically() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let scene = file("mirror-and-wall");
    let scene = scene.to_str().unwrap();
    std::fs::write(
        at("in.csv"),
        "dx,dy,dz,x_m,y_m,z_m\n2,0,0,0,0,0\n0,1,0,0,0,0\n-1,0,0,0,0,0\n",
    )
    .unwrap();
    let output = run(
        folder.path(),
        &["trace", scene, "--rays", "in.csv", "--out", "out.csv", "--json"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let figures: serde_json::Value = serde_json::from_str(&stdout(&output)).unwrap();
    assert_eq!((&figures["rays"], &figures["hits"]), (&3.into(), &2.into()));
    assert!(
        figures["build_s"].is_number() && figures["trace_s"].is_number() && figures["threads"].is_number()
    );
    let text = std::fs::read_to_string(at("out.csv")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 4, "{text}");
    assert_eq!(lines[0], "ray,vertex,surface,x_m,y_m,z_m,dx,dy,dz,path_m");
    assert!(
        lines[1].starts_with("0,0,fold,1.25,0,0,") && lines[1].ends_with(",1.25"),
        "{text}"
    );
    assert!(
        lines[2].starts_with("0,1,wall,1.25") && lines[2].ends_with(",2.5,0,,,,3.75"),
        "{text}"
    );
    assert!(lines[3].starts_with("1,0,wall,0,2.5,0,,,,2.5"), "{text}");
    // As arrays of 64 and of 32 bits.
    let numbers = [
        0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0_f32,
    ];
    let mut wide = npy::header(3, 6);
    wide.extend(numbers.iter().flat_map(|n| f64::from(*n).to_le_bytes()));
    let narrow = String::from_utf8_lossy(&npy::header(3, 6)[10..]).replace("<f8", "<f4");
    let mut narrow = [&npy::header(3, 6)[..10], narrow.as_bytes()].concat();
    narrow.extend(numbers.iter().flat_map(|n| n.to_le_bytes()));
    for (name, bytes) in [("wide.npy", wide), ("narrow.npy", narrow)] {
        std::fs::write(at(name), bytes).unwrap();
        let output = run(
            folder.path(),
            &["trace", scene, "--rays", name, "--out", "again.csv"],
        );
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert_eq!(std::fs::read_to_string(at("again.csv")).unwrap(), text);
    }
    let output = run(
        folder.path(),
        &["trace", scene, "--rays", "in.csv", "--out", "out.npy"],
    );
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    let bytes = std::fs::read(at("out.npy")).unwrap();
    assert_eq!(bytes[..npy::HEADER_LENGTH], npy::header(3, 3));
    let found: Vec<f64> = bytes[npy::HEADER_LENGTH..]
        .chunks_exact(8)
        .map(|b| f64::from_le_bytes(b.try_into().unwrap()))
        .collect();
    let inf = f64::INFINITY;
    assert_eq!(found, [1.25, 1.0, 3.75, 2.5, 1.0, 2.5, inf, -1.0, inf]);
}

#[test]
fn invalid_rays_are_refused_with_their_location() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file("mirror-and-wall");
    let refuse = |name: &str, bytes: &[u8], what: &str| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        let scene = scene.to_str().unwrap();
        let output = run(
            folder.path(),
            &["trace", scene, "--rays", name, "--out", "out.csv"],
        );
        let said = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.contains(what), "{said}");
        assert!(!folder.path().join("out.csv").exists());
    };
    let header = "x_m,y_m,z_m,dx,dy,dz\n";
    refuse("a.csv", b"x_m,y_m,z_m,dx,dy,dz,w\n", "no column \"w\"");
    refuse("a.csv", b"x_m,y_m,z_m,dx,dy\n", "column dz is missing");
    refuse(
        "a.csv",
        format!("{header}0,0,0,1,0,0\n0,nan,0,1,0,0\n").as_bytes(),
        "a.csv:3:3: y_m is NaN",
    );
    refuse(
        "a.csv",
        format!("{header}0,0,0,0,0,0\n").as_bytes(),
        "a.csv:2:7: its direction is (0, 0, 0)",
    );
    refuse(
        "a.csv",
        format!("{header}0,0,zero,0,0,1\n").as_bytes(),
        "z_m is \"zero\"",
    );
    refuse(
        "a.csv",
        format!("{header}0,0,1\n").as_bytes(),
        "the row has 3 fields",
    );
    refuse("a.npy", b"no array", "does not begin");
    refuse("a.npy", &npy::header(1, 5), "its shape is (1, 5)");
    refuse("a.npy", &npy::header(2, 6), "it ends after ray 0");
    refuse("a.txt", b"", "neither .csv nor .npy");
}

#[test]
fn trace_gives_the_same_bytes_on_any_number_of_threads() {
    let folder = tempfile::tempdir().unwrap();
    let mut rays = "x_m,y_m,z_m,dx,dy,dz\n".to_owned();
    let mut draws = Draws::new(2, Purpose::Placement, 0);
    for _ in 0..70_000 {
        let d = draws.normal3();
        rays.push_str(&format!("0,0,0,{},{},{}\n", d.x, d.y, d.z));
    }
    std::fs::write(folder.path().join("in.csv"), rays).unwrap();
    let scene = file("nearest-first");
    let bytes = ["1", "2", "7"].map(|threads| {
        let arguments = [
            "trace",
            scene.to_str().unwrap(),
            "--rays",
            "in.csv",
            "--out",
            "out.csv",
        ];
        let output = run(folder.path(), &[&arguments[..], &["--threads", threads]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        std::fs::read(folder.path().join("out.csv")).unwrap()
    });
    assert!(bytes[0].len() > 1_000_000 && bytes[0] == bytes[1] && bytes[0] == bytes[2]);
}

#[test]
fn a_scene_without_a_laboratory_is_traced_and_not_recorded() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file("mirror-and-wall");
    let scene = scene.to_str().unwrap();
    let output = run(folder.path(), &["simulate", scene, "--out", "data"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        stderr(&output).contains("the scene has no laboratory"),
        "{}",
        stderr(&output)
    );
    let output = run(folder.path(), &["check", scene]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    assert!(stdout(&output).contains("1 mirror, 1 surface"));
}

#[cfg(target_os = "linux")]
#[test]
fn trace_reports_full_disks_and_closed_pipes() {
    let folder = tempfile::tempdir().unwrap();
    let row = "0,0,0,1,0,0\n".repeat(20_000);
    std::fs::write(
        folder.path().join("in.csv"),
        format!("x_m,y_m,z_m,dx,dy,dz\n{row}"),
    )
    .unwrap();
    let scene = file("mirror-and-wall");
    let link =
        |target: &str, name: &str| std::os::unix::fs::symlink(target, folder.path().join(name)).unwrap();
    link("/dev/full", "full.csv");
    link("/dev/stdout", "stdout.csv");
    let arguments = ["trace", scene.to_str().unwrap(), "--rays", "in.csv", "--out"];
    let output = run(folder.path(), &[&arguments[..], &["full.csv"]].concat());
    assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
    assert!(
        stderr(&output).contains("the disk is full"),
        "{}",
        stderr(&output)
    );
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let output = catoptric()
        .args(arguments)
        .arg("stdout.csv")
        .current_dir(folder.path())
        .stdout(writer)
        .stderr(std::process::Stdio::piped())
        .output()
        .unwrap();
    assert_eq!((output.status.code(), stderr(&output).as_str()), (Some(0), ""));
}

#[test]
fn a_mesh_round_trips_without_loss() {
    let cube = mesh::parse_mesh(cube_stl(0.3).as_bytes(), "cube.stl").unwrap();
    assert_eq!((cube.vertices().len(), cube.triangles().len()), (8, 12));
    assert_eq!(mesh::parse_mesh(&mesh::to_ply(&cube), "cube.ply").unwrap(), cube);
}
