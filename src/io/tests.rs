//! Recordings and datasets there and back. These tests do not prove that others can read what we write:
//! `tests/mcap_peers.py` does, on the dataset of the last test here.

use super::dataset::{MANIFEST, OBSERVATIONS, RETURNS, SESSION, read_stretches};
use super::error::IoError;
use super::playback::parse_recording;
use super::*;
use catoptric_model::frame::{PoseData, yaw_pitch_roll};
use catoptric_model::session::*;
use catoptric_model::{Pose, PoseKind, PoseLabel, RangeBias, Session, Stretch, Track, TrackedFrame};
use nalgebra::{Point3, Translation3};
use proptest::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

const NAME: &str = "x.mcap";

/// A session with a rig, two boards and a scanner of so many beams.
fn session(beams: usize) -> Session {
    let marker = |name: &str, position_mm| Marker {
        name: name.to_owned(),
        position_mm,
    };
    let corners = [("a", -1.0, -1.0), ("b", 1.0, -1.0), ("c", -1.0, 1.0)];
    let board = |name: &str, color: &str| BoardSheet {
        name: name.to_owned(),
        width_mm: 600.0,
        height_mm: 400.0,
        color: color.to_owned(),
        markers: corners
            .map(|(n, x, y)| marker(n, [x * 280.0, y * 180.0, 0.0]))
            .into(),
    };
    Session {
        schema_version: SCHEMA_VERSION,
        name: "there and back".to_owned(),
        scanner: ScannerSheet {
            preset: "test".to_owned(),
            beams,
            step_deg: 0.25,
            scan_rate_hz: 40.0,
            range_min_m: 0.023,
            range_max_m: 60.0,
            divergence_full_mrad: 3.0,
        },
        nominal_rig_from_sensor: PoseData {
            translation_m: [0.01, 0.0, -0.1],
            rotation_xyzw: [0.0, 0.0, 0.6, 0.8],
        },
        mount_tolerance: MountTolerance {
            rotation_sd_deg: [0.5; 3],
            translation_sd_mm: [2.0; 3],
        },
        room: RoomSurvey {
            min_m: [-5.0, -4.0, 0.0],
            max_m: [5.0, 4.0, 3.0],
            color: "white".to_owned(),
        },
        believed: Beliefs {
            range_noise_sd_mm: 10.0,
            drift_sd_mm: 1.0,
            marker_sd_mm: 0.2,
            bias: RangeBias::default(),
            distance_bias_sd_mm: 1.0,
            angle_gain_sd_mm: 0.5,
            color_bias_sd_mm: 0.5,
        },
        bare_structure: BareStructure {
            mirror_thickness_mm: 3.0,
            distance_sd_mm: 1.0,
            first_beam: 2,
            distance_m: vec![0.1, 0.0, 0.12],
        },
        rig_markers: vec![
            marker("top", [0.0, 0.0, 120.0]),
            marker("left", [0.0, 90.0, 40.0]),
            marker("right", [0.0, -90.0, 40.0]),
            marker("nose", [100.0, 0.0, 60.0]),
        ],
        facets: Vec::new(),
        boards: vec![board("white", "white"), board("black", "matte black")],
    }
}

/// A stream of numbers in 0…1 (Lehmer's generator with Park and Miller's multiplier).
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48_271 % 2_147_483_647;
        self.0 as f64 / 2_147_483_647.0
    }
}

/// Readings in whole millimetres as 32-bit numbers, with every code in between.
fn ranges(numbers: &mut Numbers, count: usize) -> Vec<f64> {
    let code = |r: f64| match r {
        r if r < 0.02 => f64::NEG_INFINITY,
        r if r < 0.2 => f64::INFINITY,
        r if r < 0.21 => f64::NAN,
        r => f64::from(super::messages::single((r * 1e4).round() / 1e3)),
    };
    (0..count).map(|_| code(numbers.next())).collect()
}

/// What motion capture sees of a body: now and then neither pose nor every marker.
fn track(numbers: &mut Numbers, subject: &str, template: &[Marker], start_s: f64, frames: usize) -> Track {
    let mut centre = || 2.0 * numbers.next() - 1.0;
    let turn = yaw_pitch_roll(centre(), centre(), centre());
    let place = Translation3::new(centre(), centre(), 1.0 + centre());
    let frames = (0..frames).map(|k| {
        let pose = Pose::from_parts(place, turn);
        let mut see = |m: &Marker| {
            let error = (numbers.next() - 0.5) * 1e-3;
            (numbers.next() > 0.1).then(|| pose * m.position() + nalgebra::Vector3::repeat(error))
        };
        let markers: Vec<Option<Point3<f64>>> = template.iter().map(&mut see).collect();
        TrackedFrame {
            time_s: start_s + k as f64 * 0.01,
            pose: (markers.iter().flatten().count() > 2).then_some(pose),
            markers,
        }
    });
    Track {
        subject: subject.to_owned(),
        frames: frames.collect(),
    }
}

/// A stretch with a rig and the white board.
fn stretch(session: &Session, pose: usize, scans: usize, frames: usize, seed: u64) -> Stretch {
    let mut numbers = Numbers(seed + 1);
    let start_s = 10.0 * pose as f64;
    // A sum of decimals is not always the nearest number to its decimal, which times are read back as.
    let whole = |t: f64| (t * 1e9).round() / 1e9;
    let mut tracks = vec![
        track(&mut numbers, "rig", &session.rig_markers, start_s, frames),
        track(&mut numbers, "white", &session.boards[0].markers, start_s, frames),
    ];
    for frame in tracks.iter_mut().flat_map(|t| &mut t.frames) {
        frame.time_s = whole(frame.time_s);
    }
    tracks.retain(|t| !t.frames.is_empty());
    Stretch {
        label: PoseLabel {
            pose,
            kind: PoseKind::Facet,
            scans,
            board: Some("white".to_owned()),
            color: Some("white".to_owned()),
            facet: Some("port".to_owned()),
            beams: Some([1, 3]),
        },
        start_s,
        scan_period_s: 0.025,
        beams: session.scanner.beams,
        ranges: ranges(&mut numbers, scans * session.scanner.beams),
        echoes: None,
        tracks,
    }
}

fn record(session: &Session, stretches: &[Stretch]) -> Vec<u8> {
    let mut recording = RecordingWriter::create(Vec::new(), Path::new(NAME), session).expect("begun");
    for stretch in stretches {
        recording.write_stretch(stretch).expect("written");
    }
    recording.finish().expect("ended")
}

fn play(session: &Session, bytes: &[u8]) -> Result<Vec<Stretch>, IoError> {
    parse_recording(bytes, Path::new(NAME), session)
}

/// Equality that takes NaN for equal to NaN.
fn same(a: &[Stretch], b: &[Stretch]) -> bool {
    format!("{a:?}") == format!("{b:?}")
}

#[test]
fn echoes_come_back_and_other_recordings_know_nothing_of_them() {
    let session = session(5);
    let plain = stretch(&session, 0, 2, 3, 5);
    let mut several = stretch(&session, 1, 3, 3, 6);
    let ranges = several.ranges.iter();
    let beams = ranges.map(|r| match r.is_finite() {
        true => vec![*r, r + 2.0, r + 4.5]
            .into_iter()
            .map(|r| f64::from(messages::single(r)))
            .collect(),
        false => Vec::new(),
    });
    several.echoes = Some(beams.collect());
    let stretches = [plain, several];
    let bytes = record(&session, &stretches);
    assert!(same(&play(&session, &bytes).expect("read"), &stretches));
    let topic = |bytes: &[u8]| bytes.windows(7).any(|w| w == b"/echoes");
    assert!(topic(&bytes) && !topic(&record(&session, &stretches[..1])));
}

fn provenance() -> Provenance {
    Provenance {
        seed: 7,
        command_line: "catoptric simulate scene.toml --seed 7".to_owned(),
        rng_rule: "test".to_owned(),
    }
}

fn write_dataset(out: &Path, replace: bool, session: &Session, stretches: &[Stretch]) -> Result<(), IoError> {
    let mut writer = DatasetWriter::create(out, replace, session)?;
    for stretch in stretches {
        writer.write_stretch(stretch)?;
    }
    writer.write_scene("name = \"truth\"\n")?;
    writer.write_truth(&BTreeMap::from([("beams", vec![1.0, f64::NAN])]))?;
    let mut returns = writer.open_file(RETURNS)?;
    returns.write_all(b"beam,range_m\n0,1.0\n").expect("row");
    returns.finish()?;
    writer.finish(provenance()).map(|_| ())
}

/// Every path below a folder, relative to it.
fn tree(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        let name = PathBuf::from(path.file_name().expect("name"));
        if path.is_dir() {
            found.extend(tree(&path).iter().map(|below| name.join(below)));
        }
        found.push(name);
    }
    found.sort();
    found
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    #[test]
    fn stretches_come_back_as_they_were(
        beams in 1_usize..20, scans in 0_usize..6, frames in 0_usize..6, count in 0_usize..4, seed in 0_u64..1000
    ) {
        let session = session(beams);
        let stretches: Vec<_> = (0..count).map(|i| stretch(&session, i, scans, frames, seed + i as u64)).collect();
        let back = play(&session, &record(&session, &stretches));
        prop_assert!(same(&back.expect("whole"), &stretches));
    }
}

#[test]
fn equal_stretches_are_equal_bytes() {
    let session = session(11);
    let stretches = [stretch(&session, 0, 4, 9, 1), stretch(&session, 1, 3, 7, 2)];
    assert_eq!(record(&session, &stretches), record(&session, &stretches));
}

#[test]
fn a_recording_cut_anywhere_is_an_error() {
    let session = session(3);
    let whole = record(&session, &[stretch(&session, 0, 2, 3, 5)]);
    for length in 0..whole.len() {
        let error = play(&session, &whole[..length]).expect_err("cut off");
        assert!(error.to_string().starts_with(NAME), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
}

/// What a flipped bit may do: be noticed, or stand where nothing of ours is, as in an index or a schema's text.
#[test]
fn a_flipped_bit_never_changes_a_reading_and_never_panics() {
    let session = session(3);
    let stretches = [stretch(&session, 0, 2, 3, 5)];
    let mut bytes = record(&session, &stretches);
    let mut noticed = 0;
    for i in 0..bytes.len() {
        bytes[i] ^= 1 << (i % 8);
        match play(&session, &bytes) {
            Err(_) => noticed += 1,
            Ok(back) => assert!(same(&back, &stretches), "byte {i}"),
        }
        bytes[i] ^= 1 << (i % 8);
    }
    assert!(noticed > bytes.len() * 9 / 10, "{noticed} of {}", bytes.len());
}

#[test]
fn a_writer_that_is_dropped_leaves_no_whole_recording() {
    let session = session(3);
    let mut bytes = Vec::new();
    let mut recording = RecordingWriter::create(&mut bytes, Path::new(NAME), &session).expect("begun");
    recording
        .write_stretch(&stretch(&session, 0, 2, 3, 5))
        .expect("written");
    drop(recording);
    assert!(play(&session, &bytes).is_err());
}

#[test]
fn a_full_disk_is_recognised_wherever_it_fills_up() {
    struct Small(usize);
    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room = self.0.min(bytes.len());
            self.0 -= room;
            match room {
                0 if !bytes.is_empty() => Err(io::ErrorKind::StorageFull.into()),
                _ => Ok(room),
            }
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let session = session(400);
    let stretches = [stretch(&session, 0, 900, 3, 5)];
    let whole = record(&session, &stretches).len();
    for room in [0, 5, 60, 3000, whole / 2, whole - 100, whole - 1] {
        let attempt = || {
            let mut recording = RecordingWriter::create(Small(room), Path::new(NAME), &session)?;
            recording.write_stretch(&stretches[0])?;
            recording.finish().map(|_| ())
        };
        let error = attempt().expect_err("no room");
        assert!(matches!(error, IoError::DiskFull { .. }), "{room}: {error}");
    }
}

#[test]
fn what_does_not_fit_the_session_is_refused() {
    let session = session(3);
    let good = stretch(&session, 4, 2, 3, 5);
    let refuse = |change: &dyn Fn(&mut Stretch), what: &str| {
        let mut bad = good.clone();
        change(&mut bad);
        let mut recording = RecordingWriter::create(Vec::new(), Path::new(NAME), &session).expect("begun");
        let error = recording.write_stretch(&bad).expect_err("refused").to_string();
        assert!(
            error.starts_with("x.mcap: pose 4: ") && error.contains(what),
            "{error}"
        );
    };
    refuse(&|s| s.ranges.push(1.0), "7 readings, 6 expected");
    refuse(&|s| s.beams = 4, "4 beams");
    refuse(&|s| s.start_s = f64::NAN, "starts at NaN");
    refuse(&|s| s.scan_period_s = -1.0, "lasts -2 s");
    refuse(&|s| s.tracks[1].subject = "gray".to_owned(), "\"gray\"");
    refuse(
        &|s| s.tracks[0].frames[1].markers.truncate(2),
        "2 markers of \"rig\", it has 4",
    );
    refuse(&|s| s.tracks[0].frames[1].time_s = -1.0, "frame at -1 s");

    let mut clash = session.clone();
    clash.boards[1].name = "markers".to_owned();
    assert!(RecordingWriter::create(Vec::new(), Path::new(NAME), &clash).is_err());
    clash.boards[1].name = "white".to_owned();
    assert!(RecordingWriter::create(Vec::new(), Path::new(NAME), &clash).is_err());
}

#[test]
fn another_sessions_recording_is_refused() {
    let ours = session(5);
    let bytes = record(&ours, &[stretch(&ours, 0, 2, 3, 5)]);
    let error = play(&session(7), &bytes).expect_err("other beams").to_string();
    assert!(error.contains("5 beams, session.toml has 7"), "{error}");
    let mut coarser = session(5);
    coarser.scanner.step_deg = 0.5;
    let error = play(&coarser, &bytes).expect_err("other angles").to_string();
    assert!(error.contains("in steps of"), "{error}");
}

#[test]
fn a_dataset_is_read_without_its_truth_and_without_its_manifest() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("new/folder/set");
    let session = session(5);
    let stretches = [stretch(&session, 0, 2, 3, 5), stretch(&session, 1, 3, 3, 6)];
    write_dataset(&out, false, &session, &stretches).expect("written");
    let files = [
        "manifest.json",
        "observations.mcap",
        "session.toml",
        "truth",
        RETURNS,
        "truth/scene.toml",
        "truth/truth.json",
    ];
    assert_eq!(tree(&out), files.map(PathBuf::from));
    assert_eq!(tree(out.parent().expect("parent")).len(), files.len() + 1);
    let (session_back, back) = read_stretches(&out).expect("read");
    assert_eq!(session_back, session);
    assert!(same(&back, &stretches));
    let manifest: Manifest = read_json(out.join(MANIFEST)).expect("manifest");
    assert_eq!(
        manifest.scene_sha256.as_ref(),
        manifest.files.get("truth/scene.toml")
    );
    assert_eq!(manifest.files.len(), 5);

    fs::remove_dir_all(out.join("truth")).expect("blind");
    let dataset = read_dataset(&out).expect("blind dataset");
    assert_eq!(dataset.poses.len(), 2);
    fs::remove_file(out.join(MANIFEST)).expect("foreign");
    assert_eq!(
        format!("{dataset:?}"),
        format!("{:?}", read_dataset(&out).expect("read"))
    );
}

#[test]
fn two_datasets_of_one_experiment_are_equal() {
    let place = tempfile::tempdir().expect("folder");
    let session = session(5);
    let stretches = [stretch(&session, 0, 2, 3, 5)];
    let [a, b] = ["a", "b"].map(|n| place.path().join(n));
    write_dataset(&a, false, &session, &stretches).expect("written");
    write_dataset(&b, false, &session, &stretches).expect("written");
    for file in tree(&a).iter().filter(|f| a.join(f).is_file()) {
        let [a, b] = [&a, &b].map(|d| fs::read(d.join(file)).expect("file"));
        assert!(a == b, "{}", file.display());
    }
}

#[test]
fn a_changed_file_is_named() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    write_dataset(&out, false, &session, &[stretch(&session, 0, 2, 3, 5)]).expect("written");
    let text = fs::read_to_string(out.join(SESSION)).expect("session");
    fs::write(
        out.join(SESSION),
        text.replace("there and back", "there, and back"),
    )
    .expect("edited");
    let error = read_dataset(&out).expect_err("changed");
    assert!(
        error.to_string().contains("session.toml: changed since"),
        "{error}"
    );
    assert_eq!(error.exit_code(), 2);

    // Somebody else's dataset, with a slip in it.
    fs::remove_file(out.join(MANIFEST)).expect("foreign");
    fs::write(
        out.join(SESSION),
        text.replace("step_deg = 0.25", "step_deg = \"fine\""),
    )
    .expect("edited");
    let error = read_dataset(&out).expect_err("not a number").to_string();
    assert!(
        error.contains("session.toml:") && error.contains("scanner.step_deg"),
        "{error}"
    );
    fs::remove_file(out.join(SESSION)).expect("removed");
    let error = read_dataset(&out).expect_err("missing");
    assert_eq!(error.exit_code(), 3);
    assert!(error.to_string().contains("session.toml"), "{error}");
}

#[test]
fn an_interrupted_writer_leaves_nothing() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    let mut writer = DatasetWriter::create(&out, false, &session).expect("begun");
    writer
        .write_stretch(&stretch(&session, 0, 2, 3, 5))
        .expect("written");
    assert!(!out.exists());
    drop(writer);
    assert_eq!(tree(place.path()), Vec::<PathBuf>::new());

    // One that is refused in the middle leaves the dataset that was there.
    let old = [stretch(&session, 0, 2, 3, 5)];
    write_dataset(&out, false, &session, &old).expect("written");
    let before = tree(place.path());
    let mut bad = old[0].clone();
    bad.beams = 4;
    write_dataset(&out, true, &session, &[bad]).expect_err("refused");
    assert_eq!(tree(place.path()), before);
    assert!(same(&read_stretches(&out).expect("still there").1, &old));
}

#[test]
fn only_datasets_are_replaced_and_only_on_request() {
    let place = tempfile::tempdir().expect("folder");
    let out = place.path().join("set");
    let session = session(3);
    let [first, second] = [5, 6].map(|seed| [stretch(&session, 0, 2, 3, seed)]);
    fs::create_dir(&out).expect("an empty folder is fine");
    write_dataset(&out, false, &session, &first).expect("written");
    let error = write_dataset(&out, false, &session, &second).expect_err("exists");
    assert!(matches!(error, IoError::Exists { .. }), "{error}");
    write_dataset(&out, true, &session, &second).expect("replaced");
    assert!(same(&read_stretches(&out).expect("read").1, &second));
    assert_eq!(fs::read_dir(place.path()).expect("folder").count(), 1);
    for notes in [out.join("notes.txt"), out.join("truth/notes.txt")] {
        fs::write(&notes, "not ours").expect("notes");
        let error = write_dataset(&out, true, &session, &first).expect_err("notes would be lost");
        assert!(matches!(error, IoError::Foreign { .. }), "{error}");
        fs::remove_file(&notes).expect("still there");
    }

    let theirs = place.path().join("theirs");
    fs::create_dir(&theirs).expect("folder");
    for content in ["{}", "{\"name\": \"web page\"}"] {
        fs::write(theirs.join(MANIFEST), content).expect("a manifest of another kind");
        let error = write_dataset(&theirs, true, &session, &first).expect_err("foreign");
        assert!(matches!(error, IoError::Foreign { .. }), "{error}");
        assert_eq!(error.exit_code(), 3);
        assert_eq!(tree(&theirs), [PathBuf::from(MANIFEST)]);
    }
    let file = theirs.join(MANIFEST);
    let error = write_dataset(&file, true, &session, &first).expect_err("a file");
    assert!(matches!(error, IoError::Foreign { .. }), "{error}");
}

/// Bodies that are never seen at one time, and no markers: the recording of a laboratory without labelled markers.
#[test]
fn frames_without_markers_have_none() {
    let session = session(3);
    let mut lab = stretch(&session, 0, 2, 4, 5);
    for (i, track) in lab.tracks.iter_mut().enumerate() {
        for frame in &mut track.frames {
            frame.markers.clear();
            frame.pose = Some(Pose::translation(1.0, 2.0, 3.0));
            frame.time_s += [0.0, 0.001][i];
            frame.time_s = (frame.time_s * 1e9).round() / 1e9;
        }
    }
    let back = play(&session, &record(&session, std::slice::from_ref(&lab))).expect("read");
    assert!(same(&back, &[lab]));
}

/// Writes the dataset that `tests/mcap_peers.py` reads: to the folder that `CATOPTRIC_PEER_DATASET` names, or for
/// a moment.
#[test]
fn a_dataset_for_other_readers() {
    let place = tempfile::tempdir().expect("folder");
    let out = std::env::var_os("CATOPTRIC_PEER_DATASET").map_or(place.path().join("set"), PathBuf::from);
    let session = session(1081);
    let mut stretches: Vec<_> = (0..3)
        .map(|i| stretch(&session, i, 20, 50, 40 + i as u64))
        .collect();
    stretches[0].label.kind = PoseKind::Room;
    stretches[0].label.board = None;
    stretches[0].label.facet = None;
    stretches[0].label.beams = None;
    stretches[0].tracks.truncate(1);
    write_dataset(&out, true, &session, &stretches).expect("written");
    let recorded = fs::read(out.join(OBSERVATIONS)).expect("observations");
    assert!(same(&play(&session, &recorded).expect("read"), &stretches));
    read_dataset(&out).expect("a dataset");
}
