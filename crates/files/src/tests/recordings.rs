//! Recordings: round trips, truncation, flipped bits, dropped writers, and a full disk.

use super::*;
use crate::messages::{decode_scan, encode_scan};
use proptest::prelude::*;

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
fn echoes_are_read_back_and_other_recordings_have_none() {
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

/// A flipped bit is either detected, or in a part that we do not read, such as an index or a schema's text.
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
fn a_full_disk_is_recognized_wherever_it_fills_up() {
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
fn stretches_inconsistent_with_the_session_are_rejected() {
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
fn another_sessions_recording_is_rejected() {
    let ours = session(5);
    let bytes = record(&ours, &[stretch(&ours, 0, 2, 3, 5)]);
    let error = play(&session(7), &bytes).expect_err("other beams").to_string();
    assert!(error.contains("5 beams, session.toml has 7"), "{error}");
    let mut coarser = session(5);
    coarser.scanner.scan = scan(0.5, 5);
    let error = play(&coarser, &bytes).expect_err("other angles").to_string();
    assert!(error.contains("in steps of"), "{error}");
}

#[test]
fn a_scan_without_angles_is_no_scan() {
    let session = session(3);
    let message = encode_scan(5, &session.scanner, 0.025, &[1.0, 2.0, 3.0], &[]);
    let read = decode_scan(&message).expect("a scan");
    #[allow(clippy::cast_possible_truncation)]
    let first = (read.angle_min as f32).to_le_bytes();
    let at = message
        .windows(4)
        .position(|w| w == first)
        .expect("it is in there");
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut spoiled = message.clone();
        spoiled[at..at + 4].copy_from_slice(&wrong.to_le_bytes());
        let error = decode_scan(&spoiled).expect_err("no angle").to_string();
        assert!(error.starts_with(&format!("angle_min is {wrong}")), "{error}");
    }
}

#[test]
fn a_label_names_beams_that_there_are() {
    let session = session(5);
    for beams in [[0, 5], [3, 2], [1000, 5000]] {
        let mut lab = stretch(&session, 0, 2, 3, 5);
        lab.label.beams = Some(beams);
        let error = play(&session, &record(&session, &[lab])).expect_err("no such beams");
        assert!(
            error.to_string().contains("the beams 0 to 4 are allowed"),
            "{error}"
        );
    }
}

/// Bodies that are never seen at the same time, and no markers: the recording of a laboratory without labeled markers.
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

#[test]
fn a_clockwise_scan_has_a_negative_increment() {
    let mut session = session(5);
    let angles = ScanAngles {
        first_deg: 60.0,
        direction: ScanDirection::Cw,
        ..ScanAngles::centered(0.5, 5)
    };
    session.scanner.scan = ScanGeometry::new(angles, 40.0, Some(12.5)).expect("a valid scan");
    let stretches = [stretch(&session, 0, 2, 3, 5)];
    let bytes = record(&session, &stretches);
    assert!(same(&play(&session, &bytes).expect("read"), &stretches));
    let scan = messages::encode_scan(0, &session.scanner, 0.025, &[1.0; 5], &[]);
    let number = |place: usize| {
        // After the encapsulation, the stamp, and the name of the frame with its length.
        let at = 4 + 8 + (4 + messages::LASER_FRAME.len() + 1).next_multiple_of(4) + 4 * place;
        f32::from_le_bytes(scan[at..at + 4].try_into().expect("four bytes"))
    };
    let expected = [60.0_f64, 58.0, -0.5].map(|degrees| messages::single(degrees.to_radians()));
    assert_eq!([0, 1, 2].map(number), expected);
    assert_eq!(number(3), 12.5e-6);
    // The same azimuths in reverse order belong to another scanner.
    let mut other = session.clone();
    let angles = ScanAngles {
        first_deg: 58.0,
        ..ScanAngles::centered(0.5, 5)
    };
    other.scanner.scan = ScanGeometry::new(angles, 40.0, None).expect("a valid scan");
    let error = play(&other, &bytes).expect_err("other angles").to_string();
    assert!(error.contains("in steps of"), "{error}");
}
