//! Recording as a stream: excerpts equal the stretch, nothing depends on threads, memory does not grow with the number of
//! scans, and a stopped run leaves no files; the compiled paths by the structure equal those traced in full.
//!
//! Memory is counted in readings in flight, as reported by the program. The overhead of the allocator is not measured
//! here.

use crate::common::{heeding_signals, run, stderr, stdout};
use crate::scenes::{PROTOTYPE, TWO_MIRROR, scene};
use catoptric::files::scene::load;
use catoptric::files::{DatasetWriter, Provenance};
use catoptric::model::{Excerpt, Pose};
use catoptric::sim::build::Structure;
use catoptric::sim::laboratory::Memory;
use catoptric::sim::light::{Mirrors, Setting};
use catoptric::sim::scene::{Coating, Correlated, Dust, EchoChoice, Interference, Stack};
use catoptric::sim::{Laboratory, Scene};
use catoptric_fixtures::ust20lx;
use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::time::{Duration, Instant};

fn file(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/{name}.toml"))
}

/// A few scans of the two-mirror layout with all random errors.
fn noisy() -> Scene {
    let mut scene = scene(TWO_MIRROR);
    scene.scanner.sub_rays = 5;
    scene.experiment.scans_per_pose = 7;
    scene.experiment.room_scans = 3;
    scene.experiment.bare_scans = 1;
    scene.detection.noise_over_threshold = 0.1;
    scene.detection.echo = EchoChoice::All;
    scene.errors.element_sd_mm = 0.5;
    scene.errors.dropout = 0.05;
    scene.errors.correlated = Some(Correlated {
        sd_mm: 1.0,
        time_constant_s: 0.1,
    });
    scene.errors.interference = Some(Interference {
        step_mm: 100.0,
        probability: 0.05,
    });
    scene
}

/// A stretch excerpt by excerpt, drawn in the wrong order and linked in the right one.
fn excerpts(laboratory: &Laboratory, number: usize, scans: usize) -> Vec<Excerpt> {
    let all = laboratory.scans_of(number);
    let starts: Vec<usize> = (0..all).step_by(scans).collect();
    let mut drawn: Vec<_> = starts
        .iter()
        .rev()
        .map(|from| laboratory.draw(number, *from..all.min(from + scans)))
        .collect();
    drawn.reverse();
    let mut memory = Memory::default();
    for drawn in &mut drawn {
        laboratory.link(drawn, &mut memory);
    }
    let sight = laboratory.sight(number).unwrap();
    let seen: Vec<_> = (0..all).map(|scan| sight.returns(scan)).collect();
    let first_seen = laboratory.first_seen(number);
    drawn
        .iter()
        .map(|drawn| {
            let mut recorder = laboratory.excerpt_recorder(drawn);
            for scan in drawn.scans() {
                recorder.add(&seen[scan], sight.changes_at(scan));
            }
            recorder.finish(&first_seen)
        })
        .collect()
}

#[test]
fn excerpts_are_the_stretch_whatever_their_length() {
    for frame_rate_hz in [100.0, 40.0, 37.0, 333.0] {
        let mut scene = noisy();
        scene.mocap.frame_rate_hz = frame_rate_hz;
        scene.mocap.dropout = 0.3;
        let laboratory = Laboratory::new(&scene, 5).unwrap();
        for number in [0, 1, 4] {
            let whole = laboratory.stretch(number).unwrap();
            for scans in [1, 2, 3, 7] {
                let mut joined = whole.clone();
                joined.ranges.clear();
                joined.echoes.iter_mut().for_each(Vec::clear);
                joined.tracks.iter_mut().for_each(|t| t.frames.clear());
                for excerpt in excerpts(&laboratory, number, scans) {
                    assert_eq!(excerpt.first_scan * ust20lx::COUNT, joined.ranges.len());
                    assert_eq!(excerpt.first_seen, whole.first_seen());
                    joined.ranges.extend(excerpt.part.ranges);
                    joined
                        .echoes
                        .as_mut()
                        .unwrap()
                        .extend(excerpt.part.echoes.unwrap());
                    for (track, part) in joined.tracks.iter_mut().zip(excerpt.part.tracks) {
                        track.frames.extend(part.frames);
                    }
                }
                // Lost readings are NaN.
                let bits = |ranges: &[f64]| ranges.iter().map(|r| r.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&joined.ranges), bits(&whole.ranges));
                assert_eq!(format!("{:?}", joined.echoes), format!("{:?}", whole.echoes));
                assert_eq!(joined.tracks, whole.tracks);
            }
        }
    }
}

#[test]
fn a_recording_of_excerpts_equals_that_of_the_stretches_byte_for_byte() {
    let laboratory = Laboratory::new(&noisy(), 5).unwrap();
    let session = laboratory.session().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let provenance = || Provenance {
        seed: 5,
        command_line: String::new(),
        rng_rule: String::new(),
    };
    let mut hashes = Vec::new();
    for scans in [0, 1, 3] {
        let out = folder.path().join(scans.to_string());
        let mut writer = DatasetWriter::create(&out, false, &session).unwrap();
        let encoder = writer.encoder();
        for number in 0..laboratory.stretches() {
            if scans == 0 {
                writer
                    .write_stretch(&laboratory.stretch(number).unwrap())
                    .unwrap();
                continue;
            }
            let encoded = excerpts(&laboratory, number, scans)
                .iter()
                .map(|excerpt| encoder.encode_excerpt(excerpt).unwrap())
                .collect();
            writer.append(encoded).unwrap();
        }
        hashes.push(writer.finish(provenance()).unwrap().files);
    }
    assert_eq!(hashes[0], hashes[1]);
    assert_eq!(hashes[0], hashes[2]);
}

#[test]
fn excerpts_that_are_missing_or_out_of_order_are_refused() {
    let laboratory = Laboratory::new(&noisy(), 5).unwrap();
    let session = laboratory.session().unwrap();
    let folder = tempfile::tempdir().unwrap();
    let excerpts = excerpts(&laboratory, 4, 3);
    for (order, said) in [
        (&[1][..], "pose 4: scan 3 follows"),
        (&[0, 2], "pose 4: scan 6 follows scan 3 of pose 4"),
        (&[0, 0], "pose 4: 3 scans, its label says 7"),
        (&[0, 1], "pose 4: 6 scans, its label says 7"),
    ] {
        let out = folder.path().join("out");
        let mut writer = DatasetWriter::create(&out, false, &session).unwrap();
        let encoder = writer.encoder();
        let encode = |i: &usize| encoder.encode_excerpt(&excerpts[*i]).unwrap();
        let result = writer.append(order.iter().map(encode).collect());
        let finished = result.and_then(|()| {
            let provenance = Provenance {
                seed: 5,
                command_line: String::new(),
                rng_rule: String::new(),
            };
            writer.finish(provenance).map(|_| ())
        });
        let error = finished.unwrap_err().to_string();
        assert!(error.contains(said), "{order:?}: {error}");
        assert!(!out.exists());
    }
}

fn simulate(folder: &Path, out: &str, scene: &str, more: &[&str]) -> serde_json::Value {
    let scene = file(scene);
    let arguments = [
        &["simulate", scene.to_str().unwrap(), "--out", out, "--json"],
        more,
    ]
    .concat();
    let output = run(folder, &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
    serde_json::from_str(&stdout(&output)).unwrap()
}

/// A stretch of many excerpts with correlated noise, a flight, and all tables of the truth.
#[test]
fn threads_change_no_file_of_long_stretches_and_flights() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = |out: &str| std::fs::read(folder.path().join(out).join("manifest.json")).unwrap();
    for (scene, set) in [
        (
            "static-10000",
            ["experiment.scans_per_pose=300", "scanner.sub_rays=3"],
        ),
        ("flight", ["experiment.scans_per_pose=2", "scanner.sub_rays=1"]),
    ] {
        let tables = match scene {
            "flight" => ["--returns", "--sub-rays"],
            _ => ["--returns", "--readings"],
        };
        for threads in ["1", "2", "7"] {
            let out = format!("{scene}-{threads}");
            let set = ["--set", set[0], "--set", set[1]];
            simulate(
                folder.path(),
                &out,
                scene,
                &[&set[..], &tables, &["--threads", threads]].concat(),
            );
            assert_eq!(
                manifest(&out),
                manifest(&format!("{scene}-1")),
                "{threads} threads"
            );
        }
    }
}

#[test]
fn ten_times_the_scans_need_no_more_memory() {
    let folder = tempfile::tempdir().unwrap();
    let held = |scans: usize| {
        let scans = format!("experiment.scans_per_pose={scans}");
        let more = [
            "--set",
            &scans,
            "--set",
            "scanner.sub_rays=1",
            "--threads",
            "2",
            "--replace",
        ];
        let figures = simulate(folder.path(), "data", "static-10000", &more);
        figures["readings_held"].as_u64().unwrap()
    };
    let few = held(1000);
    // Four excerpts of 64 scans are simulated by two threads while four more are written.
    assert_eq!(few, 8 * 64 * 1081);
    assert_eq!(held(10_000), few);
}

#[cfg(unix)]
#[test]
fn a_run_stopped_within_a_stretch_leaves_no_files() {
    let folder = tempfile::tempdir().unwrap();
    let scene = file("static-10000");
    let mut child = heeding_signals()
        .args(["simulate", scene.to_str().unwrap(), "--out", "data", "--readings"])
        .args(["--set", "experiment.scans_per_pose=1000000"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    // Until a chunk of the recording exists.
    let begin = Instant::now();
    let written = || {
        let staged = std::fs::read_dir(folder.path()).unwrap().flatten();
        let recording = |e: std::fs::DirEntry| e.path().join("new/observations.mcap");
        let size = |path: PathBuf| std::fs::metadata(path).map_or(0, |m| m.len());
        staged.map(recording).map(size).sum::<u64>()
    };
    while written() < 1 << 20 {
        assert!(begin.elapsed() < Duration::from_secs(120) && child.try_wait().unwrap().is_none());
        std::thread::sleep(Duration::from_millis(5));
    }
    let pid = child.id().to_string();
    let sent = std::process::Command::new("kill").args(["-INT", &pid]).status();
    assert!(sent.unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

/// Compares what every beam of a stretch returns, with the compiled rig and traced in full.
fn same_with_the_compiled_rig(laboratory: &Laboratory, number: usize) {
    let sight = laboratory.sight(number).unwrap();
    let returns = sight.returns(0);
    let sensor = laboratory.sensor();
    for (beam, found) in returns.iter().enumerate() {
        let traced = sensor.observe(sight.setting(), beam);
        assert_eq!(*found, traced, "stretch {number}, beam {beam}");
    }
}

/// Coated and dusty mirrors, seen by a lens with a view of its own.
fn lossy() -> Scene {
    let mut scene = scene(PROTOTYPE);
    let mirror = &mut scene.superstructure.mirror;
    mirror.coating = Some(Coating::Stack(Stack {
        n: 2.1,
        k: 8.4,
        film: vec![],
    }));
    mirror.dust = Some(Dust {
        cover: 0.01,
        reflectivity: 0.3,
    });
    scene.superstructure.facet[0].coating = None;
    scene.superstructure.facet[0].reflectivity = Some(0.5);
    scene.light.polarization_deg = Some(20.0);
    scene.light.receiver_field_of_view_mrad = Some(20.0);
    scene.light.receiver_offset_mm = [0.0, 12.0];
    scene.light.vignetting = true;
    scene
}

#[test]
fn the_compiled_rig_changes_no_bit() {
    let mut glass = scene(TWO_MIRROR);
    glass.superstructure.mirror.diffuse_reflectivity = 0.01;
    let mirrors = load(&file("traps/both-outputs"), &[]).unwrap();
    for mut scene in [scene(PROTOTYPE), glass, lossy(), mirrors] {
        scene.scanner.sub_rays = scene.scanner.sub_rays.min(6);
        let laboratory = Laboratory::new(&scene, 3).unwrap();
        for number in [0, 1, laboratory.stretches() - 1] {
            same_with_the_compiled_rig(&laboratory, number);
        }
    }
}

/// A box of the room between the sensor and a mirror: the compiled paths do not hold, and are not used.
#[test]
fn objects_inside_the_structure_are_seen() {
    let mut scene = scene(TWO_MIRROR);
    scene.scanner.sub_rays = 3;
    let intruder = r#"
name = "intruder"
shape.box = { size_m = [0.01, 0.01, 0.05] }
position_m = [0, 0.05, 1.76]
"#;
    scene.room.surface.push(toml::from_str(intruder).unwrap());
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let structure = Structure::as_built(&scene, 3).unwrap();
    let bare = Setting::new(&scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let rig = laboratory.sensor().compile(&bare);
    let sight = laboratory.sight(1).unwrap();
    assert!(!rig.holds_in(std::slice::from_ref(sight.setting())));
    assert!(rig.holds_in(&[
        bare.seen_from(&Pose::identity()),
        bare.seen_from(&Pose::translation(1.0, 0.0, 0.0))
    ]));
    same_with_the_compiled_rig(&laboratory, 1);
    let names = sight.setting().names();
    let left = ust20lx::nearest(std::f64::consts::FRAC_PI_2).unwrap();
    let ends = sight.sub_ray_ends(0, left);
    let hits_intruder = ends.iter().any(|end| match end.stop {
        catoptric::sim::receive::SubRayStop::Hit { surface, .. } => names[surface] == "intruder",
        _ => false,
    });
    assert!(hits_intruder, "{ends:?}");
}

/// A room that is one mesh surrounds the sensor: the compiled paths hold where none of it is near; elsewhere everything
/// is traced in full.
#[test]
fn flights_within_a_mesh_equal_those_without_the_compiled_rig() {
    let mut scene = load(&file("flight-through-a-duct"), &[]).unwrap();
    let mirrors = self::scene(TWO_MIRROR).superstructure.facet;
    scene.superstructure.facet = mirrors;
    scene.scanner.sub_rays = 7;
    // From the axis to the wall.
    let last = scene.flight[0].waypoint.last_mut().unwrap();
    last.position_m = [3.6, 0.0, 1.45];
    let laboratory = Laboratory::new(&scene, 3).unwrap();
    let structure = Structure::as_built(&scene, 3).unwrap();
    let bare = Setting::new(&scene, &structure, Mirrors::Attached, Vec::new()).unwrap();
    let rig = laboratory.sensor().compile(&bare);
    let number = laboratory.stretches() - 1;
    let sight = laboratory.sight(number).unwrap();
    assert!(sight.flies());
    assert!(rig.holds_in(std::slice::from_ref(sight.setting())));
    let ends = laboratory.scans_of(number) - 1;
    let gone = sight.setting().seen_from(&Pose::translation(0.6, 0.0, 1.45));
    let here = sight.setting().seen_from(&Pose::identity());
    assert!(!rig.holds_in(&[here, gone]));
    for scan in [0, ends] {
        let returns = sight.returns(scan);
        for beam in (0..ust20lx::COUNT).step_by(9) {
            let ends = sight.sub_ray_ends(scan, beam);
            // The chief ray is the first; its surface is that of the echo unless another path is brighter.
            let way: f64 = ends[0].path;
            if let Some(found) = &returns[beam]
                && found.share > 0.999
            {
                assert!((found.geometric - way).abs() < 1e-9, "scan {scan}, beam {beam}");
            }
        }
    }
}
