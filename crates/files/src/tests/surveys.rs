//! Datasets whose readings stay in their recording: they equal datasets held in memory, and later changes to the
//! recording are detected.

use super::*;
use crate::capture::MOST_WAITING;
use crate::dataset::{OBSERVATIONS, parse_dataset};
use catoptric_model::{Dataset, PoseRecord, Readings};
use std::fs;

/// The records when everything is held in memory.
fn held(session: &Session, bytes: &[u8]) -> Vec<PoseRecord> {
    let stretches = play(session, bytes).expect("read").into_iter();
    stretches.map(|s| s.into_record().expect("tracked")).collect()
}

/// Compares a dataset with records that hold their readings.
fn assert_same(dataset: &Dataset, expected: &[PoseRecord]) {
    assert_eq!(dataset.poses.len(), expected.len());
    for (found, expected) in dataset.poses.iter().zip(expected) {
        assert_eq!(found.readings.held(), None);
        let scans: Vec<f64> = found
            .scans()
            .flat_map(|s| s.expect("there").into_owned())
            .collect();
        assert_eq!(found.readings.statistics(), expected.readings.statistics());
        let found = PoseRecord {
            readings: Readings::in_memory(found.beams(), scans),
            ..found.clone()
        };
        // NaN equals itself here.
        assert_eq!(
            format!("{:?}", found.readings.held()),
            format!("{:?}", expected.readings.held())
        );
        assert_eq!(found.watched, expected.watched);
        assert_eq!(
            (&found.label, &found.room_from_rig, &found.room_from_board),
            (
                &expected.label,
                &expected.room_from_rig,
                &expected.room_from_board
            )
        );
        assert_eq!(found.motion, expected.motion);
    }
}

/// Stretches of different lengths: some share a chunk, one has several.
fn stretches(session: &Session) -> Vec<Stretch> {
    let lengths = [(2, 3), (0, 2), (900, 60), (1, 9), (5, 3)];
    (0..)
        .zip(lengths)
        .map(|(i, (scans, frames))| stretch(session, i, scans, frames, 5 + i as u64))
        .collect()
}

#[test]
fn a_survey_equals_records_held_in_memory() {
    let session = session(400);
    let bytes = record(&session, &stretches(&session));
    let expected = held(&session, &bytes);
    let of_bytes = parse_dataset(session.clone(), bytes.clone()).expect("surveyed");
    assert_same(&of_bytes, &expected);
    // Again, in a different order, and from a file.
    for pose in of_bytes.poses.iter().rev() {
        assert_eq!(pose.scans().count(), pose.label.scans);
    }
    let folder = tempfile::tempdir().expect("folder");
    fs::write(folder.path().join(OBSERVATIONS), &bytes).expect("written");
    let text = toml::to_string(&session).expect("TOML");
    fs::write(folder.path().join("session.toml"), text).expect("written");
    let of_file = read_dataset(folder.path()).expect("surveyed");
    assert_same(&of_file, &expected);
    assert_eq!(of_file, of_bytes);
    assert_eq!(of_file.id, Some(file::sha256(&bytes)));
}

/// More frames than may wait: they are discarded in order, counted, and read again for their averages.
#[test]
fn a_long_stretch_of_motion_capture_is_averaged_as_a_short_one() {
    let session = session(3);
    let frames = MOST_WAITING;
    let mut flight = stretch(&session, 1, 4, frames, 8);
    flight.label = PoseLabel::of(1, PoseKind::Flight, 4);
    let long = [
        stretch(&session, 0, 4, frames, 7),
        flight,
        stretch(&session, 2, 4, 5, 9),
    ];
    let bytes = record(&session, &long);
    let dataset = parse_dataset(session.clone(), bytes.clone()).expect("surveyed");
    assert_same(&dataset, &held(&session, &bytes));
    assert_eq!(dataset.poses[0].watched.len(), 2);
    let path = dataset.poses[1].motion.as_ref().expect("it is a flight");
    assert!(path.frames.len() > frames / 2);
}

#[test]
fn motion_capture_in_any_order_is_sorted_unless_it_is_much_too_late() {
    let session = session(3);
    let bodies = bodies::Bodies::of(&session, Path::new(NAME)).expect("bodies");
    let mut capture = capture::Capture::default();
    for time in [30, 10, 20] {
        capture
            .pose(time, 0, Some(Pose::identity()))
            .expect("nothing was let go");
    }
    let mut times = Vec::new();
    capture.take(1, &bodies, &[0], 0, |_, frame| times.push(frame.time_s));
    assert_eq!(times, [10e-9, 20e-9]);
    capture
        .pose(21, 0, Some(Pose::identity()))
        .expect("it is in time");
    let late = capture
        .pose(19, 0, Some(Pose::identity()))
        .expect_err("it is late");
    assert!(late.contains("late"), "{late}");
}

/// Third-party recordings may have no chunks at all.
#[test]
fn a_recording_without_chunks_is_surveyed_too() {
    let session = session(400);
    let bytes = record(&session, &stretches(&session));
    let mut plain = io::Cursor::new(Vec::new());
    let options = mcap::WriteOptions::new().use_chunks(false).compression(None);
    let mut writer = options.create(&mut plain).expect("begun");
    for message in mcap::MessageStream::new(&bytes).expect("ours") {
        writer.write(&message.expect("whole")).expect("written");
    }
    writer.finish().expect("ended");
    drop(writer);
    let plain = plain.into_inner();
    let dataset = parse_dataset(session.clone(), plain).expect("surveyed");
    assert_same(&dataset, &held(&session, &bytes));
}

#[test]
fn a_recording_that_changes_or_disappears_is_a_separate_error() {
    let folder = tempfile::tempdir().expect("folder");
    let session = session(400);
    let bytes = record(&session, &stretches(&session));
    let path = folder.path().join(OBSERVATIONS);
    fs::write(&path, &bytes).expect("written");
    let text = toml::to_string(&session).expect("TOML");
    fs::write(folder.path().join("session.toml"), text).expect("written");
    let said = |change: &dyn Fn()| {
        fs::write(&path, &bytes).expect("written");
        let dataset = read_dataset(folder.path()).expect("surveyed");
        change();
        let mut scans = dataset.poses[2].scans();
        let error = scans.find_map(Result::err).expect("it is noticed");
        assert!(scans.next().is_none(), "nothing follows");
        error.to_string()
    };
    let mut flipped = bytes.clone();
    // Every block has some of them.
    flipped.iter_mut().step_by(64).for_each(|byte| *byte ^= 1);
    for changed in [&flipped, &bytes[..bytes.len() / 3].to_vec(), &Vec::new()] {
        let error = said(&|| fs::write(&path, changed).expect("changed"));
        assert!(error.contains("observations.mcap: changed while"), "{error}");
    }
    let error = said(&|| fs::remove_file(&path).expect("removed"));
    assert!(error.contains("observations.mcap: cannot be read"), "{error}");
}
