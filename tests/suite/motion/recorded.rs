//! Flights as recorded, listed in the truth, refused, and lifted into the room by `apply`.

use super::*;
use catoptric_fixtures::ust20lx;

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
    // A scan recorded alone equals the scan in sequence, and all scans differ.
    let laboratory = Laboratory::new(&scene, 11).unwrap();
    let sight = laboratory.sight(flight_number(&laboratory)).unwrap();
    assert_eq!(sight.returns(4), scans[4]);
    assert_ne!(scans[3], scans[4]);
}

#[test]
fn truth_and_motion_capture_report_where_the_rig_was() {
    let (scene, trajectory) = moving_mirrors();
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
        let (place, yaw) = trajectory(t);
        Pose::from_parts(Translation3::from(place), yaw_pitch_roll(yaw, 0.0, 0.0))
    };
    let off = |a: &Pose, b: &Pose| {
        (a.translation.vector - b.translation.vector).norm() + a.rotation.angle_to(&b.rotation)
    };
    for (scan, pose) in flown.room_from_sensor.iter().enumerate() {
        assert!(off(&Pose::from(pose), &(rig(time(scan, 0)) * mount)) < 1e-12);
    }
    // Frames every 10 ms from the start of the flight, exact with the ideal profile.
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

/// A calibration for a scanner without mirrors, with its mounting.
fn undeflected(rig_from_sensor: Pose) -> Calibration {
    let mount = PoseData::from(&rig_from_sensor);
    Calibration {
        schema_version: calibration::SCHEMA_VERSION,
        method: "known".to_owned(),
        frame: "sensor".to_owned(),
        scanner: None,
        dataset: None,
        beams: (0..ust20lx::COUNT)
            .map(|b| BeamEstimate::without_angles(b, Status::Direct, None))
            .collect(),
        facets: Vec::new(),
        rig_from_sensor: Some(MountEstimate {
            translation_m: mount.translation_m,
            rotation_xyzw: mount.rotation_xyzw,
            covariance: None,
        }),
        bias: None,
        warnings: Vec::new(),
        assessment: None,
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
    // Uniform motion, so that interpolation between motion-capture frames is exact.
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
        assert_eq!(cloud.points.len(), 8 * ust20lx::COUNT);
        let off = cloud.points.iter().map(|p| off_planes(&room, &p.position));
        off.fold(0.0, f64::max)
    };
    // The last steps are after the last frame.
    assert!(worst(&dataset) < 1e-12, "{}", worst(&dataset));
    // If the rig had stayed at its first pose, points would be off by decimeters.
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
        let score = catoptric::score::score(d, &a, None).expect("in memory");
        serde_json::to_value(&score).unwrap()
    };
    assert_eq!(score(&without), score(&with));
}

/// Distance of a point from the nearest surface of the scene `flight`, in meters.
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
            // The tent: four slopes from a square of 1.2 m on the floor to a point at 0.9 m.
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
    // Range noise of 4.5 mm, and E_a, which apply cannot subtract, of up to some centimeters at grazing incidence.
    assert!(
        quantile(50) < 10.0 && quantile(90) < 40.0,
        "{} {}",
        quantile(50),
        quantile(90)
    );
    // Furniture is present: points on none of the walls.
    let room = walls(scene.room.size_m);
    let inside = cloud
        .points
        .iter()
        .filter(|p| off_planes(&room, &p.position) > 0.2);
    assert!(inside.count() > 2000);
}

#[test]
fn a_flight_is_recorded_applied_and_reported_by_the_program() {
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
    let dataset = files::read_dataset(&folder.path().join("set")).unwrap();
    let flown = dataset.poses.last().unwrap();
    assert_eq!((flown.label.kind, flown.label.scans), (PoseKind::Flight, 5));
    assert_eq!(flown.label.flight.as_deref(), Some("over the furniture"));
    let motion = flown.motion.as_ref().unwrap();
    // 125 ms at 100 Hz, minus frames with too many dropped markers.
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
fn impossible_flights_are_refused_with_their_location() {
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
            "the direction of the turn is ambiguous",
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
    // Markers are needed to track the rig.
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
