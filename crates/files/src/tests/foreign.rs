//! Recordings unlike our own: messages in another order, other compression, lost scans, poses that a tracker reports when it
//! has lost a body, damage, clocks that differ.

use super::*;
use crate::dataset::{OBSERVATIONS, parse_dataset};
use catoptric_model::Dataset;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;

/// A message: topic, when it was logged, and its bytes.
pub(super) type Logged = (String, u64, Vec<u8>);

pub(super) const BEAMS: usize = 20;

/// Three stretches, at rest, each with jitter of its markers and its poses.
pub(super) fn original(session: &Session) -> Vec<Stretch> {
    let stretch = |pose: usize| {
        let mut stretch = stretch(session, pose, 8, 30, 5 + pose as u64);
        let mut numbers = Numbers(77 + pose as u64);
        for frame in stretch.tracks.iter_mut().flat_map(|t| &mut t.frames) {
            if let Some(pose) = &mut frame.pose {
                pose.translation.vector.x += 1e-4 * numbers.next();
            }
        }
        stretch
    };
    (0..3).map(stretch).collect()
}

pub(super) fn messages(bytes: &[u8]) -> Vec<Logged> {
    let all = mcap::MessageStream::new(bytes).expect("ours");
    all.map(|message| {
        let message = message.expect("whole");
        (
            message.channel.topic.clone(),
            message.log_time,
            message.data.into_owned(),
        )
    })
    .collect()
}

/// The recording with other messages, on the channels of the original.
pub(super) fn written(bytes: &[u8], messages: &[Logged]) -> Vec<u8> {
    let mut out = io::Cursor::new(Vec::new());
    let mut writer = mcap::WriteOptions::new()
        .compression(None)
        .create(&mut out)
        .expect("begun");
    let mut channels = BTreeMap::new();
    for message in mcap::MessageStream::new(bytes).expect("ours") {
        let channel = message.expect("whole").channel;
        channels.entry(channel.topic.clone()).or_insert(channel);
    }
    let mut ids = BTreeMap::new();
    for (topic, channel) in &channels {
        let schema = channel.schema.as_ref().expect("every topic has a schema");
        let schema = writer
            .add_schema(&schema.name, &schema.encoding, &schema.data)
            .expect("added");
        let id = writer.add_channel(schema, topic, &channel.message_encoding, &BTreeMap::new());
        ids.insert(topic.clone(), id.expect("added"));
    }
    for (topic, time, data) in messages {
        let header = MessageHeader {
            channel_id: ids[topic],
            sequence: 0,
            log_time: *time,
            publish_time: *time,
        };
        writer.write_to_known_channel(&header, data).expect("written");
    }
    writer.finish().expect("ended");
    drop(writer);
    out.into_inner()
}

pub(super) fn dataset(session: &Session, bytes: Vec<u8>) -> Dataset {
    parse_dataset(session.clone(), bytes).expect("it is read")
}

/// All that a dataset says, whatever file it is from.
fn content(dataset: &Dataset) -> String {
    let scans = |pose: &catoptric_model::PoseRecord| -> Vec<Vec<f64>> {
        pose.scans()
            .map(|scan| scan.expect("there").into_owned())
            .collect()
    };
    let all: Vec<_> = dataset.poses.iter().map(|pose| (pose, scans(pose))).collect();
    format!("{all:?} {:?}", dataset.warnings)
}

#[test]
fn the_order_of_a_file_means_nothing() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let expected = content(&dataset(&session, bytes.clone()));
    let in_order = messages(&bytes);
    let mut by_topic = in_order.clone();
    by_topic.sort_by(|a, b| a.0.cmp(&b.0));
    let mut ties_the_other_way = in_order.clone();
    ties_the_other_way.sort_by(|a, b| (a.1, b.0.as_str()).cmp(&(b.1, a.0.as_str())));
    let mut backwards = in_order.clone();
    backwards.reverse();
    for changed in [by_topic, ties_the_other_way, backwards] {
        assert_ne!(changed, in_order);
        assert_eq!(content(&dataset(&session, written(&bytes, &changed))), expected);
    }
}

#[test]
fn labels_without_a_schema_can_still_be_read() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let expected = content(&dataset(&session, bytes.clone()));
    let mut out = io::Cursor::new(Vec::new());
    let mut writer = mcap::Writer::new(&mut out).expect("begun");
    for message in mcap::MessageStream::new(&bytes).expect("ours") {
        let mut message = message.expect("whole");
        if message.channel.topic == "/session/pose" {
            // After the encapsulation and the length of the text, and before its terminating zero.
            message.data = message.data[8..message.data.len() - 1].to_vec().into();
            message.channel = std::sync::Arc::new(mcap::Channel {
                schema: None,
                message_encoding: "json".to_owned(),
                ..(*message.channel).clone()
            });
        }
        writer.write(&message).expect("written");
    }
    writer.finish().expect("ended");
    drop(writer);
    assert_eq!(content(&dataset(&session, out.into_inner())), expected);
}

#[test]
fn chunks_may_be_compressed_with_zstd() {
    use ruzstd::encoding::{CompressionLevel, compress_to_vec};
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let expected = content(&dataset(&session, bytes.clone()));
    // The records of one uncompressed chunk, compressed anew.
    let plain = written(&bytes, &messages(&bytes));
    let (chunk, rest) = chunk_of(&plain);
    let packed = |body: &[u8], size: u64| {
        let mut record = Vec::new();
        record.extend(&body[..16]);
        record.extend(size.to_le_bytes());
        record.extend(&body[24..28]);
        record.extend(4_u32.to_le_bytes());
        record.extend(b"zstd");
        let records = &body[40..];
        let packed = compress_to_vec(records, CompressionLevel::Fastest);
        record.extend((packed.len() as u64).to_le_bytes());
        record.extend(packed);
        record
    };
    let size = chunk.len() as u64 - 40;
    let with = |size| rest.with_chunk(&packed(chunk, size));
    assert_eq!(content(&dataset(&session, with(size))), expected);
    for wrong in [size - 1, size + 1, 1 << 40, u64::MAX] {
        let error = parse_dataset(session.clone(), with(wrong)).expect_err("refused");
        assert_eq!(error.exit_code(), 2, "{error}");
    }
}

/// What stands around the only chunk of a recording.
struct Around<'a> {
    before: &'a [u8],
}

impl Around<'_> {
    /// A recording without a summary.
    fn with_chunk(&self, body: &[u8]) -> Vec<u8> {
        let mut bytes = self.before.to_vec();
        let mut record = |opcode: u8, body: &[u8]| {
            bytes.push(opcode);
            bytes.extend((body.len() as u64).to_le_bytes());
            bytes.extend(body);
        };
        record(mcap::records::op::CHUNK, body);
        record(mcap::records::op::DATA_END, &[0; 4]);
        record(mcap::records::op::FOOTER, &[0; 20]);
        bytes.extend(mcap::MAGIC);
        bytes
    }
}

/// The body of the first chunk of a recording, whose records must not be compressed.
fn chunk_of(bytes: &[u8]) -> (&[u8], Around<'_>) {
    let mut at = mcap::MAGIC.len();
    loop {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().expect("eight bytes"));
        let body = at + 9..at + 9 + usize::try_from(length).expect("short");
        if bytes[at] == mcap::records::op::CHUNK {
            return (&bytes[body], Around { before: &bytes[..at] });
        }
        at = body.end;
    }
}

#[test]
fn a_lost_scan_and_a_label_sent_twice_are_noted() {
    let session = session(BEAMS);
    let stretches = original(&session);
    let bytes = record(&session, &stretches);
    let mut changed = messages(&bytes);
    let scan = changed
        .iter()
        .rposition(|m| m.0 == "/scan")
        .expect("there are scans");
    changed.remove(scan);
    let label = changed
        .iter()
        .position(|m| m.0 == "/session/pose")
        .expect("there are labels");
    let again = (
        changed[label].0.clone(),
        changed[label + 9].1,
        changed[label].2.clone(),
    );
    changed.insert(label + 10, again);
    let found = dataset(&session, written(&bytes, &changed));
    assert_eq!(
        found.poses.iter().map(|p| p.label.scans).collect::<Vec<_>>(),
        [8, 8, 7]
    );
    assert_eq!(found.poses[2].scans().count(), 7);
    assert_eq!(
        found.poses[2].readings.statistics()[0].halves[0].count,
        found.poses[2]
            .scans()
            .take(3)
            .filter(|s| { s.as_ref().expect("there")[0].is_finite() })
            .count()
    );
    let warnings = found.warnings.join("\n");
    assert!(warnings.contains("pose 2: 1 of its 8 scans"), "{warnings}");
    assert!(
        warnings.contains("pose 0: its label was sent more than once"),
        "{warnings}"
    );
}

#[test]
fn frames_in_which_the_tracker_lost_a_body_are_not_used() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let good = dataset(&session, bytes.clone());
    let lost = |change: &dyn Fn(usize, &mut Vec<u8>)| {
        let mut changed = messages(&bytes);
        let of_board = changed.iter_mut().filter(|m| m.0 == "/mocap/white");
        for (number, (_, _, data)) in of_board.enumerate() {
            change(number, data);
        }
        dataset(&session, written(&bytes, &changed))
    };
    let numbers = |data: &mut Vec<u8>, numbers: [f64; 7]| {
        let at = data.len() - 56;
        data.truncate(at);
        numbers.iter().for_each(|n| data.extend(n.to_le_bytes()));
    };
    let identity = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    for code in [[0.0; 7], identity, [f64::NAN; 7]] {
        let found = lost(&|number, data| {
            if number % 13 == 5 {
                numbers(data, code);
            }
        });
        for (found, good) in found.poses.iter().zip(&good.poses) {
            let apart = found.room_from_board.expect("seen").translation.vector
                - good.room_from_board.expect("seen").translation.vector;
            assert!(apart.norm() < 1e-4, "{code:?}: {apart:?}");
        }
        assert_eq!(found.warnings.len(), 3, "{:?}", found.warnings);
        assert!(found.warnings[0].contains("\"white\""), "{:?}", found.warnings);
    }
    // Frozen for the whole of the second stretch: the board was never seen there.
    let frozen = std::cell::RefCell::new(Vec::new());
    let mut counts = [0; 3];
    for (number, pose) in good.poses.iter().enumerate() {
        counts[number] = original(&session)[number].tracks[1]
            .frames
            .iter()
            .filter(|f| f.pose.is_some())
            .count();
        assert!(pose.room_from_board.is_some());
    }
    let found = lost(&|number, data| {
        if number + 1 == counts[0] {
            frozen.replace(data[data.len() - 56..].to_vec());
        } else if number >= counts[0] && number < counts[0] + counts[1] {
            let at = data.len() - 56;
            data.truncate(at);
            data.extend(frozen.borrow().iter());
        }
    });
    assert_eq!(
        found.poses.iter().map(|p| p.label.pose).collect::<Vec<_>>(),
        [0, 2]
    );
    let warnings = found.warnings.join("\n");
    assert!(warnings.contains("never saw its board \"white\""), "{warnings}");
}

#[test]
fn damage_is_refused_and_can_be_left_out() {
    let session = session(400);
    let stretches: Vec<Stretch> = (0..4)
        .map(|pose| stretch(&session, pose, 600, 9, 3 + pose as u64))
        .collect();
    let bytes = record(&session, &stretches);
    let folder = tempfile::tempdir().expect("folder");
    let text = toml::to_string(&session).expect("TOML");
    std::fs::write(folder.path().join("session.toml"), text).expect("written");
    let read = |bytes: &[u8], damage| {
        std::fs::write(folder.path().join(OBSERVATIONS), bytes).expect("written");
        read_dataset_with(folder.path(), damage, &Default::default())
    };
    let mut flipped = bytes.clone();
    flipped[bytes.len() / 2] ^= 1;
    for damaged in [&flipped[..], &bytes[..bytes.len() * 2 / 3]] {
        let error = read(damaged, Damage::Refused).expect_err("refused");
        assert!(
            matches!(error, IoError::Damaged { kept, .. } if kept > 0),
            "{error}"
        );
        assert_eq!(error.exit_code(), 2);
        let some = read(damaged, Damage::LeftOut).expect("some can be read");
        assert!(!some.poses.is_empty() && some.poses.len() < 4);
        assert!(
            some.warnings.iter().any(|w| w.contains("is left out")),
            "{:?}",
            some.warnings
        );
        let whole = read(&bytes, Damage::Refused).expect("whole");
        for pose in &some.poses {
            let expected = whole
                .poses
                .iter()
                .find(|p| p.label == pose.label)
                .expect("the same");
            assert_eq!(pose.readings.statistics(), expected.readings.statistics());
        }
    }
}

#[test]
fn a_recording_in_which_nothing_is_known_is_refused() {
    let session = session(BEAMS);
    let bytes = record(&session, &[]);
    let error = parse_dataset(session.clone(), bytes)
        .expect_err("nothing to read")
        .to_string();
    assert!(error.contains("there is no message on /session/pose"), "{error}");
}

#[test]
fn clocks_that_differ_are_refused_with_the_gap() {
    let session = session(BEAMS);
    let mut flight = stretch(&session, 0, 8, 60, 3);
    flight.label = PoseLabel::of(0, PoseKind::Flight, 8);
    let bytes = record(&session, &[flight]);
    let restamped = |stamp: &dyn Fn(usize, u64) -> u64| {
        let mut changed = messages(&bytes);
        for (number, (_, time, data)) in changed.iter_mut().filter(|m| m.0 == "/scan").enumerate() {
            let stamp = stamp(number, *time);
            data[4..8].copy_from_slice(
                &u32::try_from(stamp / 1_000_000_000)
                    .expect("32 bits")
                    .to_le_bytes(),
            );
            data[8..12].copy_from_slice(&u32::try_from(stamp % 1_000_000_000).expect("below").to_le_bytes());
        }
        parse_dataset(session.clone(), written(&bytes, &changed))
    };
    let since_boot = restamped(&|number, _| 5_000_000_000 + 25_000_000 * number as u64);
    let error = since_boot.expect_err("refused").to_string();
    assert!(error.contains("the same clock"), "{error}");
    let error = restamped(&|_, _| 1_518_000_000_000_000_000)
        .expect_err("refused")
        .to_string();
    assert!(error.contains("bear the same stamp"), "{error}");
    // Uneven stamps are those of the scans.
    let late = restamped(&|number, time| time + if number < 4 { 0 } else { 100_000_000 }).expect("read");
    let motion = late.poses[0].motion.as_ref().expect("a flight");
    assert!((motion.time_s(5, 0, 0.0) - (5.0 * 0.025 + 0.1)).abs() < 1e-9);
}
