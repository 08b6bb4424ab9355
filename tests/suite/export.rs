//! The output of `export` equals the drawing: closed, outward, of the right size.
//!
//! `tests/export_peers.py` opens the same files with third-party readers.

use crate::common::{run, stderr, stdout};
use catoptric::cast::volume;
use catoptric::export::{self, Part, Solid};
use catoptric::files::mesh::read_mesh;
use catoptric::files::scene as scenes;
use catoptric::layout::{Detail, Drawing, analyze};
use catoptric::sim::Scene;
use std::collections::BTreeMap;
use std::path::Path;

fn load(path: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(path);
    scenes::load(&path, &[]).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

const SCENES: [&str; 3] = ["prototype.toml", "two-mirror.toml", "reference-facet.toml"];

/// Every edge of a closed surface occurs once in each direction.
fn assert_closed(solid: &Solid) {
    let key = |p: &nalgebra::Point3<f64>| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()];
    let mut edges: BTreeMap<_, i32> = BTreeMap::new();
    for t in &solid.triangles {
        for i in 0..3 {
            *edges.entry((key(&t[i]), key(&t[(i + 1) % 3]))).or_default() += 1;
        }
    }
    for ((a, b), count) in &edges {
        assert_eq!((*count, edges.get(&(*b, *a))), (1, Some(&1)), "{}", solid.name);
    }
    assert!(volume(&solid.triangles) > 0.0, "{} is inside out", solid.name);
}

#[test]
fn solids_are_closed_and_outward() {
    for name in SCENES {
        let scene = load(name);
        for seed in [None, Some(5)] {
            let drawing = Drawing::new(&scene, seed).unwrap();
            let solids = export::solids(&scene, &drawing, Part::All);
            assert!(solids.len() > 2 * drawing.facets.len());
            solids.iter().for_each(assert_closed);
        }
    }
}

#[test]
fn mirror_plates_have_their_area_and_thickness() {
    for name in SCENES {
        let scene = load(name);
        let analysis = analyze(&scene, None, Detail::Coarse).unwrap();
        let drawing = Drawing::new(&scene, None).unwrap();
        let plates = export::solids(&scene, &drawing, Part::Mirrors);
        for (plate, facet) in plates.iter().zip(&analysis.facets) {
            // A mirror drawn without a thickness gets the minimum thickness that can be cut.
            let drawn = scene.superstructure.mirror.thickness_mm;
            let thickness_mm = if drawn > 0.0 { drawn } else { 1.0 };
            let by_hand = facet.area_mm2 * thickness_mm * 1e-9;
            assert!(
                (volume(&plate.triangles) / by_hand - 1.0).abs() < 1e-9,
                "{name} {}",
                plate.name
            );
        }
    }
}

#[test]
fn the_frame_blocks_no_view() {
    for name in SCENES {
        assert_eq!(
            export::shaded_by_frame(&load(name), None).unwrap(),
            Vec::<usize>::new(),
            "{name}"
        );
    }
}

#[test]
fn a_frame_in_the_view_is_detected() {
    // A mirror that deflects its fan back over the scanner, where it hits the hub above.
    let mut scene = load("two-mirror.toml");
    scene.superstructure.facet.truncate(1);
    scene.superstructure.facet[0].shape =
        catoptric::sim::scene::FacetShape::Rectangle(catoptric::sim::scene::RectangleShape {
            center_mm: [0.0, 90.0, 0.0],
            normal: [0.0, -1.0, 0.1926],
            width_mm: 40.0,
            height_mm: 20.0,
        });
    assert!(!export::shaded_by_frame(&scene, None).unwrap().is_empty());
}

#[test]
fn an_stl_is_read_back_in_millimeters() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("all.stl");
    let scene = load("prototype.toml");
    let drawing = Drawing::new(&scene, None).unwrap();
    let solids = export::solids(&scene, &drawing, Part::All);
    std::fs::write(&path, export::stl(&solids)).unwrap();
    let mesh = read_mesh(&path).unwrap();
    let count: usize = solids.iter().map(|s| s.triangles.len()).sum();
    assert_eq!(mesh.triangles().len(), count);
    let reach = |points: &mut dyn Iterator<Item = f64>| points.fold(0.0_f64, f64::max);
    let drawn = reach(
        &mut solids
            .iter()
            .flat_map(|s| s.triangles.iter().flatten())
            .map(|p| p.coords.norm()),
    );
    let read = reach(&mut mesh.vertices().iter().map(|p| p.coords.norm()));
    assert!((read / (1e3 * drawn) - 1.0).abs() < 1e-6, "{read} {drawn}");
}

/// A number of the JSON that is a count or an index.
fn whole(value: &serde_json::Value) -> usize {
    usize::try_from(value.as_u64().unwrap()).unwrap()
}

/// The JSON and the binary part of a GLB.
fn parts(glb: &[u8]) -> (serde_json::Value, Vec<u8>) {
    let number = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&glb[..4], number(4), number(8)), (&b"glTF"[..], 2, glb.len()));
    let length = number(12);
    assert_eq!((&glb[16..20], length % 4), (&b"JSON"[..], 0));
    let json = serde_json::from_slice(&glb[20..20 + length]).unwrap();
    let binary = 20 + length;
    assert_eq!(&glb[binary + 4..binary + 8], b"BIN\0");
    assert_eq!(number(binary), glb.len() - binary - 8);
    (json, glb[binary + 8..].to_vec())
}

#[test]
fn a_glb_matches_its_accessors_in_meters() {
    let scene = load("prototype.toml");
    let drawing = Drawing::new(&scene, None).unwrap();
    let (json, data) = parts(&export::glb(&scene, &drawing, 0.5));
    let accessors = json["accessors"].as_array().unwrap();
    for accessor in accessors {
        let view = &json["bufferViews"][whole(&accessor["bufferView"])];
        let (begin, length) = (whole(&view["byteOffset"]), whole(&view["byteLength"]));
        assert_eq!(length, 12 * whole(&accessor["count"]));
        let bytes = &data[begin..begin + length];
        let floats: Vec<f32> = bytes
            .chunks(4)
            .map(|c| f32::from_le_bytes(c.try_into().unwrap()))
            .collect();
        for axis in 0..3 {
            let values = || floats.iter().skip(axis).step_by(3).map(|v| f64::from(*v));
            assert_eq!(values().reduce(f64::min), accessor["min"][axis].as_f64());
            assert_eq!(values().reduce(f64::max), accessor["max"][axis].as_f64());
        }
    }
    let meshes = json["meshes"].as_array().unwrap();
    let find = |name: &str| {
        meshes
            .iter()
            .find(|m| m["name"] == name)
            .unwrap_or_else(|| panic!("no {name}"))
    };
    // Undeflected beams end half a meter from the scanner, the forward one on the x axis.
    let lines = &find("beams undeflected")["primitives"][0];
    assert_eq!(lines["mode"], 1);
    let accessor = &accessors[whole(&lines["attributes"]["POSITION"])];
    assert!((accessor["max"][0].as_f64().unwrap() - 0.5).abs() < 1e-6);
    for facet in &drawing.facets {
        assert_eq!(find(&facet.name)["primitives"][0]["mode"], 4);
        find(&format!("beams {}", facet.name));
    }
}

#[test]
fn a_drawing_table_reproduces_the_mirrors() {
    let scene = load("prototype.toml");
    let drawing = Drawing::new(&scene, None).unwrap();
    let table = export::drawing_table(&scene, &drawing).unwrap();
    let mut reader = csv::Reader::from_reader(table.as_slice());
    let header = reader.headers().unwrap().clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|h| h == name)
            .unwrap_or_else(|| panic!("no {name}"))
    };
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 8 * 4);
    let facets = drawing
        .facets
        .iter()
        .flat_map(|f| f.face.corners.iter().map(move |c| (f, c)));
    for (row, (facet, corner)) in rows.iter().zip(facets) {
        let number = |name: &str| -> f64 { row[column(name)].parse().unwrap() };
        assert_eq!(row[0], facet.name);
        for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
            assert!((number(name) - 1e3 * corner[axis]).abs() < 1e-6);
        }
        // The plane contains its corners.
        let normal = [number("normal_x"), number("normal_y"), number("normal_z")];
        let on_plane: f64 = normal.iter().zip(corner.iter()).map(|(m, c)| m * c * 1e3).sum();
        assert!((on_plane - number("plane_offset_mm")).abs() < 1e-3);
        assert_eq!(
            number("tilt_tolerance_sd_deg"),
            scene.superstructure.as_built.tilt_sd_deg
        );
    }
    // The corner angles of a quadrilateral.
    let of_first = rows
        .iter()
        .take(4)
        .map(|r| r[column("corner_angle_deg")].parse::<f64>().unwrap());
    assert!((of_first.sum::<f64>() - 360.0).abs() < 1e-4);
}

/// The three numbers of an attribute of the joint of a link.
fn joint(urdf: &str, child: &str, attribute: &str) -> [f64; 3] {
    let at = urdf
        .find(&format!("<child link=\"{child}\"/>"))
        .unwrap_or_else(|| panic!("no {child}"));
    let from = at + urdf[at..].find(&format!("{attribute}=\"")).unwrap() + attribute.len() + 2;
    let text = urdf[from..].split('"').next().unwrap();
    let numbers: Vec<f64> = text.split(' ').map(|n| n.parse().unwrap()).collect();
    numbers.try_into().unwrap()
}

#[test]
fn urdf_frames_are_located_on_the_mirrors() {
    let mut scene = load("prototype.toml");
    scene.scanner.mount.yaw_deg = 30.0;
    let drawing = Drawing::new(&scene, None).unwrap();
    let urdf = export::urdf(&scene, &drawing);
    assert_eq!(joint(&urdf, "laser", "xyz"), [0.0, 0.0, -0.04]);
    assert!((joint(&urdf, "laser", "rpy")[2] - 30.0_f64.to_radians()).abs() < 1e-9);
    for facet in &drawing.facets {
        let link = format!("mirror_{}", facet.name);
        let [roll, pitch, yaw] = joint(&urdf, &link, "rpy");
        // URDF: rotations about the fixed x, y and z axes, in this order.
        let turn = nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), yaw)
            * nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::y_axis(), pitch)
            * nalgebra::Rotation3::from_axis_angle(&nalgebra::Vector3::x_axis(), roll);
        let z = turn * nalgebra::Vector3::z();
        assert!((z - facet.face.normal.into_inner()).norm() < 1e-8, "{link}: {z}");
        let place = nalgebra::Point3::from(joint(&urdf, &link, "xyz"));
        assert!(
            facet.face.contains(&place) && facet.face.normal.dot(&(place - facet.face.origin)).abs() < 1e-8
        );
    }
}

#[test]
fn the_verb_writes_every_format_and_refuses_what_it_cannot_write() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{}/scenes/two-mirror.toml", env!("CARGO_MANIFEST_DIR"));
    for format in catoptric::ExportFormat::ALL.map(catoptric::ExportFormat::name) {
        let file = format!("two.{format}");
        let output = run(
            folder.path(),
            &["export", &scene, "--format", format, "--out", &file],
        );
        assert!(output.status.success(), "{}", stderr(&output));
        assert!(
            stdout(&output).starts_with(&format!("wrote {file}")),
            "{}",
            stdout(&output)
        );
        let first = std::fs::read(folder.path().join(&file)).unwrap();
        let again = run(
            folder.path(),
            &[
                "export",
                &scene,
                "--format",
                format,
                "--out",
                &file,
                "--threads",
                "1",
            ],
        );
        assert!(again.status.success());
        assert!(!first.is_empty() && first == std::fs::read(folder.path().join(&file)).unwrap());
    }
    for (arguments, said) in [
        (vec![".", "--format", "stl"], "is a folder"),
        (vec![".", "--format", "csv"], "no session.toml in it"),
        (
            vec![".", "--format", "csv", "--as-built"],
            "--as-built is for scenes",
        ),
        (
            vec![".", "--format", "csv", "--part", "all"],
            "--part is for scenes",
        ),
        (vec![scene.as_str(), "--format", "step"], "possible values"),
        (
            vec![scene.as_str(), "--format", "glb", "--reach-m=-1"],
            "positive number",
        ),
        (
            vec![
                scene.as_str(),
                "--format",
                "stl",
                "--set",
                "superstructure.facet=[]",
            ],
            "no such solids",
        ),
    ] {
        let arguments = [&["export", "--out", "x"], arguments.as_slice()].concat();
        let output = run(folder.path(), &arguments);
        // A folder that is not a dataset counts as not found.
        let code = if said.contains("session.toml") { 3 } else { 2 };
        assert_eq!(output.status.code(), Some(code), "{}", stderr(&output));
        assert!(
            stderr(&output).contains(said),
            "{arguments:?}: {}",
            stderr(&output)
        );
        assert!(!folder.path().join("x").exists());
    }
}

/// The columns and rows of a table.
fn parsed(table: &[u8]) -> (Vec<String>, Vec<csv::StringRecord>) {
    let mut reader = csv::Reader::from_reader(table);
    let header = reader.headers().unwrap().iter().map(str::to_owned).collect();
    (header, reader.records().map(Result::unwrap).collect())
}

#[test]
fn a_board_table_is_bit_identical_to_the_recording() {
    let sets = [
        "experiment.scans_per_pose=3",
        "scanner.sub_rays=1",
        "scanner.mount.yaw_deg=5",
    ];
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/two-mirror.toml");
    let scene = scenes::load(&path, &sets.map(str::to_owned)).unwrap();
    let dataset = catoptric::sim::Laboratory::new(&scene, 1)
        .unwrap()
        .dataset()
        .unwrap();
    let (header, rows) = parsed(&export::board_table(&dataset).unwrap());
    let mut rows = rows.iter();
    let column = |name: &str| {
        let at = header.iter().position(|h| h == name);
        at.unwrap_or_else(|| panic!("no {name}"))
    };
    let session = &dataset.session;
    let drawn = catoptric::model::Pose::from(&session.nominal_rig_from_sensor);
    let (mut facets, mut direct) = (0, 0);
    for record in dataset.poses.iter().filter(|p| p.label.board.is_some()) {
        let label = &record.label;
        let [first, last] = label.beams.unwrap();
        let beside = if label.facet.is_some() { export::BESIDE } else { 0 };
        *if label.facet.is_some() {
            &mut facets
        } else {
            &mut direct
        } += 1;
        for beam in first.saturating_sub(beside)..=(last + beside).min(1080) {
            let row = rows.next().unwrap();
            let text = |name: &str| &row[column(name)];
            let number = |name: &str| text(name).parse::<f64>().unwrap();
            assert_eq!(text("kind") == "facet", label.facet.is_some());
            assert_eq!(text("pose"), label.pose.to_string());
            assert_eq!(text("beam"), beam.to_string());
            assert_eq!(text("board"), "board");
            assert_eq!(text("color"), "white");
            assert_eq!(text("facet"), label.facet.as_deref().unwrap_or_default());
            assert_eq!(text("set_up_for") == "1", (first..=last).contains(&beam));
            assert_eq!(
                number("azimuth_rad"),
                catoptric::calib::observations::azimuth(session, beam)
            );
            match session.bare_structure.distance(beam) {
                Some(d) => assert_eq!(number("bare_distance_m"), d),
                None => assert_eq!(text("bare_distance_m"), ""),
            }
            if label.facet.is_some() {
                assert_eq!(text("inside_edge_m"), "");
            } else {
                // The nearest edge, as the smaller distance along the board's own axes.
                let pick = |name: &str| {
                    nalgebra::Vector3::from(["x", "y", "z"].map(|axis| number(&name.replace('*', axis))))
                };
                let (center, normal) = (pick("drawn_center_*_m"), pick("drawn_normal_*"));
                let along = pick("drawn_along_*");
                let azimuth = number("azimuth_rad");
                let u = nalgebra::Vector3::new(azimuth.cos(), azimuth.sin(), 0.0);
                let off = u * (normal.dot(&center) / normal.dot(&u)) - center;
                let [x, y] = [off.dot(&along), off.dot(&normal.cross(&along))];
                let inside = (0.45 - x.abs()).min(0.35 - y.abs());
                assert!((number("inside_edge_m") - inside).abs() < 1e-12);
            }
            let scans = record.scans().map(|scan| scan.unwrap()[beam]);
            let found: Vec<f64> = scans.filter(|r| r.is_finite()).collect();
            assert_eq!(text("readings"), found.len().to_string());
            assert_eq!(text("missing"), (3 - found.len()).to_string());
            if found.is_empty() {
                assert_eq!((text("mean_m"), text("sd_m")), ("", ""));
            } else {
                let mean = found.iter().sum::<f64>() / found.len() as f64;
                assert!((number("mean_m") - mean).abs() < 1e-14);
                assert_eq!(number("mean_m"), record.summarize()[beam].mean);
            }
            if found.len() > 1 {
                assert_eq!(number("sd_m"), record.summarize()[beam].sd);
            }
            // The board in the rig frame, and the same board through the drawn mounting.
            let triple = |name: &str| ["x", "y", "z"].map(|axis| number(&name.replace('*', axis)));
            let point = nalgebra::Point3::from(triple("rig_center_*_m"));
            let back = record.room_from_rig * point;
            assert!((back.coords - record.room_from_board.unwrap().translation.vector).norm() < 1e-12);
            let through = drawn * nalgebra::Point3::from(triple("drawn_center_*_m"));
            assert!((through - point).norm() < 1e-12);
            for (axis, name) in [
                (nalgebra::Vector3::<f64>::z(), "normal"),
                (nalgebra::Vector3::x(), "along"),
            ] {
                let in_rig = nalgebra::Vector3::from(triple(&format!("rig_{name}_*")));
                let in_room = record.room_from_rig * in_rig;
                assert!((in_room - record.room_from_board.unwrap() * axis).norm() < 1e-12);
                let in_drawn = nalgebra::Vector3::from(triple(&format!("drawn_{name}_*")));
                assert!((drawn * in_drawn - in_rig).norm() < 1e-12);
            }
        }
    }
    assert!(rows.next().is_none());
    assert_eq!((direct, facets), (9, 36));
}

#[test]
fn a_blind_dataset_gives_the_same_board_table() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = format!("{}/scenes/two-mirror.toml", env!("CARGO_MANIFEST_DIR"));
    let quick = [
        "--set",
        "experiment.scans_per_pose=2",
        "--set",
        "scanner.sub_rays=1",
    ];
    for (name, blind) in [("seen", None), ("blind", Some("--blind"))] {
        let mut arguments = vec!["simulate", &scene, "--out", name];
        arguments.extend(quick.iter().copied().chain(blind));
        assert!(run(at, &arguments).status.success());
        let table = format!("{name}.csv");
        let output = run(at, &["export", name, "--format", "csv", "--out", &table]);
        assert!(output.status.success(), "{}", stderr(&output));
        assert_eq!(stdout(&output), format!("wrote {table}: 45 boards\n"));
    }
    assert!(!at.join("blind/truth").exists());
    let read = |name: &str| std::fs::read(at.join(name)).unwrap();
    assert_eq!(read("seen.csv"), read("blind.csv"));
    // The file equals the data in memory: floats as stored in the recording.
    let dataset = catoptric::files::read_dataset(&at.join("seen")).unwrap();
    assert_eq!(read("seen.csv"), export::board_table(&dataset).unwrap());
    // Only the columns documented in chapter 5.
    let (header, _) = parsed(&read("seen.csv"));
    let guide = include_str!("../../docs/guide/5-files.md");
    let section = guide
        .split("## The board table")
        .nth(1)
        .unwrap()
        .split("\n## ")
        .next()
        .unwrap();
    let table = section
        .lines()
        .filter_map(|line| line.strip_prefix('|')?.split('|').next());
    let named: Vec<String> = table
        .flat_map(|cell| cell.split('`').skip(1).step_by(2))
        .map(str::to_owned)
        .collect();
    assert_eq!(named, header, "explained (left) and written (right)");
}
