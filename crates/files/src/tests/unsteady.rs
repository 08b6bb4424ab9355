//! Recordings that repeat messages, whose log times jitter, and in which motion capture sees a body elsewhere.

use super::foreign::{BEAMS, Logged, dataset, messages, original, written};
use super::*;
use crate::dataset::parse_dataset;

/// The stamp of a message that begins with a header, changed.
fn restamped(data: &[u8], time: u64) -> Vec<u8> {
    let mut data = data.to_vec();
    let seconds = u32::try_from(time / 1_000_000_000).expect("32 bits");
    let rest = u32::try_from(time % 1_000_000_000).expect("below");
    data[4..8].copy_from_slice(&seconds.to_le_bytes());
    data[8..12].copy_from_slice(&rest.to_le_bytes());
    data
}

#[test]
fn messages_that_are_recorded_twice_count_once() {
    let session = session(BEAMS);
    let mut stretches = original(&session);
    stretches[1].echoes = Some(stretches[1].ranges.iter().map(|_| vec![1.5]).collect());
    let bytes = record(&session, &stretches);
    let all = messages(&bytes);
    let expected = dataset(&session, bytes.clone());
    let (scans, labels) = (8 * 4, 3);
    // A moment later, as by two recorders; both files one after the other; each at the same time.
    let later = |(topic, time, data): &Logged| {
        let data = data.clone();
        [
            (topic.clone(), *time, data.clone()),
            (topic.clone(), time + 400_000, data),
        ]
    };
    let by_two: Vec<Logged> = all.iter().flat_map(later).collect();
    let appended = [all.clone(), all.clone()].concat();
    let at_once: Vec<Logged> = all.iter().flat_map(|m| [m.clone(), m.clone()]).collect();
    for twice in [by_two, appended, at_once] {
        let found = dataset(&session, written(&bytes, &twice));
        assert_eq!(found.warnings.len(), labels + 1, "{:?}", found.warnings);
        let label = "its label was sent more than once";
        assert_eq!(
            found.warnings.iter().filter(|w| w.ends_with(label)).count(),
            labels
        );
        let words = format!("{scans} messages were recorded more than once, byte for byte: each counts once");
        assert!(found.warnings.contains(&words), "{:?}", found.warnings);
        for (found, expected) in found.poses.iter().zip(&expected.poses) {
            assert_eq!(found.label, expected.label);
            assert_eq!(found.readings.statistics(), expected.readings.statistics());
            assert_eq!(found.room_from_board, expected.room_from_board);
        }
    }
    // Another reading at the same time is another scan.
    let mut another = all.clone();
    let place = all.iter().position(|m| m.0 == "/scan").expect("there are scans");
    let mut scan = all[place].clone();
    let last = scan.2.len() - 5;
    scan.2[last] ^= 1;
    another.insert(place, scan);
    let error = parse_dataset(session.clone(), written(&bytes, &another))
        .map(|_| ())
        .expect_err("refused");
    assert!(error.to_string().contains("9 scans, its label says 8"), "{error}");
}

#[test]
fn a_label_repeated_at_the_same_time_is_noted_and_two_labels_are_refused() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let all = messages(&bytes);
    let place = all
        .iter()
        .rposition(|m| m.0 == "/session/pose")
        .expect("there are labels");
    let mut again = all.clone();
    again.insert(place, all[place].clone());
    let found = dataset(&session, written(&bytes, &again));
    assert_eq!(found.warnings, ["pose 2: its label was sent more than once"]);
    let first = all
        .iter()
        .position(|m| m.0 == "/session/pose")
        .expect("there are labels");
    let mut two = all.clone();
    two[first].1 = all[place].1;
    two.retain(|m| m.1 >= all[place].1);
    let error = parse_dataset(session.clone(), written(&bytes, &two))
        .map(|_| ())
        .expect_err("refused");
    let words = "the labels of pose 0 and of pose 2 were logged at the same time";
    assert!(error.to_string().contains(words), "{error}");
}

/// Log times are those of the computer that recorded; what belongs together is up to the stamps.
#[test]
fn log_times_may_jitter_by_less_than_a_scan_period() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let all = messages(&bytes);
    let expected = dataset(&session, bytes.clone());
    let mut numbers = Numbers(5);
    let mut noticed = 0;
    for most_us in [300, 3000, 12_000] {
        for _ in 0..5 {
            let mut jittered: Vec<Logged> = all.clone();
            let most = f64::from(most_us) * 1e3;
            for (_, time, _) in &mut jittered {
                let by = (most * (2.0 * numbers.next() - 1.0)).round();
                #[allow(clippy::cast_possible_truncation)]
                let moved = time.saturating_add_signed(by as i64);
                *time = moved;
            }
            jittered.sort_by_key(|m| m.1);
            let found = dataset(&session, written(&bytes, &jittered));
            let jitter = |w: &String| w.starts_with("log times are up to ");
            noticed += usize::from(found.warnings.iter().any(jitter));
            assert!(found.warnings.iter().all(jitter), "{:?}", found.warnings);
            for (found, expected) in found.poses.iter().zip(&expected.poses) {
                assert_eq!(found.label, expected.label);
                assert_eq!(found.readings.statistics(), expected.readings.statistics());
            }
        }
    }
    assert!(noticed > 5, "{noticed}");
    // A contradiction that no jitter explains keeps its reason.
    let mut late = all.clone();
    let last = late.iter_mut().rfind(|m| m.0 == "/session/pose");
    last.expect("there are labels").1 += 60_000_000;
    late.sort_by_key(|m| m.1);
    let error = parse_dataset(session.clone(), written(&bytes, &late))
        .map(|_| ())
        .expect_err("refused");
    assert!(error.to_string().contains("scans, its label says 8"), "{error}");
    // Stamps of another clock are not the recorder's.
    let of_boot: Vec<Logged> = late
        .iter()
        .map(|(topic, time, data)| match topic.as_str() {
            "/scan" => (
                topic.clone(),
                *time,
                restamped(data, time - 1_500_000_000_000_000_000),
            ),
            _ => (topic.clone(), *time, data.clone()),
        })
        .collect();
    let error = parse_dataset(session.clone(), written(&bytes, &of_boot))
        .map(|_| ())
        .expect_err("refused");
    assert!(error.to_string().contains("scans, its label says 8"), "{error}");
}

/// A change of a position and a quaternion.
type Change<'a> = &'a dyn Fn(&mut [f64; 7]);

/// The last seven numbers of a message, a position and a quaternion, changed.
fn moved(data: &[u8], change: Change) -> Vec<u8> {
    let at = data.len() - 56;
    let mut numbers: [f64; 7] = std::array::from_fn(|i| {
        let bytes = &data[at + 8 * i..at + 8 * i + 8];
        f64::from_le_bytes(bytes.try_into().expect("eight bytes"))
    });
    change(&mut numbers);
    let bytes = numbers.iter().flat_map(|n| n.to_le_bytes());
    data[..at].iter().copied().chain(bytes).collect()
}

#[test]
fn frames_in_which_a_body_is_elsewhere_for_a_moment_are_not_used() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let good = dataset(&session, bytes.clone());
    // As many frames as are gathered at once, and more.
    let long: Vec<Stretch> = (0..3)
        .map(|pose| {
            let mut long = stretch(&session, pose, 8, 900, 5 + pose as u64);
            let mut numbers = Numbers(7);
            for frame in long.tracks.iter_mut().flat_map(|t| &mut t.frames) {
                if let Some(pose) = &mut frame.pose {
                    pose.translation.vector.x += 1e-4 * numbers.next();
                }
            }
            long
        })
        .collect();
    let long = record(&session, &long);
    let good_long = dataset(&session, long.clone());
    let flip = |n: &mut [f64; 7]| {
        let [x, y, z, w] = [n[3], n[4], n[5], n[6]];
        // Half a turn about the body's own z.
        [n[3], n[4], n[5], n[6]] = [y, -x, w, -z];
    };
    let jump = |n: &mut [f64; 7]| n[1] += 0.4;
    let far = |n: &mut [f64; 7]| n[0] = 1e300;
    let changes: [(Change, &str); 3] = [
        (&flip, "elsewhere for a moment in "),
        (&jump, "elsewhere for a moment in "),
        (&far, "beyond 10 km in "),
    ];
    for (bytes, good) in [(&bytes, &good), (&long, &good_long)] {
        for topic in ["/mocap/white", "/mocap/rig"] {
            for (change, words) in changes {
                let mut changed = messages(bytes);
                let of_body = changed.iter_mut().filter(|m| m.0 == topic);
                let mut spoiled = 0;
                for (_, _, data) in of_body.skip(4).step_by(9) {
                    *data = moved(data, change);
                    spoiled += 1;
                }
                let found = dataset(&session, written(bytes, &changed));
                for (found, good) in found.poses.iter().zip(&good.poses) {
                    let board = [found, good].map(|p| p.room_from_board.expect("seen"));
                    for [found, good] in [board, [found.room_from_rig, good.room_from_rig]] {
                        let off = good.inverse() * found;
                        assert!(off.translation.vector.norm() < 1e-4, "{topic} {words}: {off}");
                        assert!(off.rotation.angle() < 1e-6, "{topic} {words}: {off}");
                    }
                }
                assert_eq!(found.warnings.len(), 3, "{:?}", found.warnings);
                let counted = found.warnings.iter().map(|w| {
                    let count = w.split(words).nth(1).expect("it is named");
                    let count = count.split(' ').next().expect("a number");
                    count.parse::<usize>().expect("a number")
                });
                assert_eq!(counted.sum::<usize>(), spoiled);
            }
        }
    }
}

#[test]
fn a_stretch_in_which_too_few_frames_agree_is_left_out() {
    let session = session(BEAMS);
    let bytes = record(&session, &original(&session));
    let mut changed = messages(&bytes);
    let end = changed
        .iter()
        .rposition(|m| m.0 == "/session/pose")
        .expect("there are labels");
    for (number, (_, _, data)) in changed[end..]
        .iter_mut()
        .filter(|m| m.0 == "/mocap/white")
        .enumerate()
    {
        if number % 2 == 1 {
            *data = moved(data, &|n| n[2] += 0.5);
        }
    }
    let found = dataset(&session, written(&bytes, &changed));
    assert_eq!(found.poses.len(), 2);
    let words = "pose 2: motion capture put \"white\" elsewhere in ";
    let why = "too few of its frames agree on where it is; it is left out";
    assert!(
        found
            .warnings
            .iter()
            .any(|w| w.starts_with(words) && w.ends_with(why)),
        "{:?}",
        found.warnings
    );
}

/// The last of the seven numbers of a scan's sheet is at this place of a message.
fn with_number(data: &[u8], place: usize, number: f32) -> Vec<u8> {
    let at = 4 + 8 + (4 + messages::LASER_FRAME.len() + 1).next_multiple_of(4) + 4 * place;
    let mut data = data.to_vec();
    data[at..at + 4].copy_from_slice(&number.to_le_bytes());
    data
}

/// Changes every scan of a recording.
fn with_scans(bytes: &[u8], change: impl Fn(&[u8]) -> Vec<u8>) -> Vec<u8> {
    let mut changed = messages(bytes);
    for (_, _, data) in changed.iter_mut().filter(|m| m.0 == "/scan") {
        *data = change(data);
    }
    written(bytes, &changed)
}

#[test]
fn codes_of_drivers_and_limits_of_messages_are_no_ranges() {
    let session = session(3);
    let mut lab = stretch(&session, 0, 4, 9, 5);
    let single = |x: f64| f64::from(messages::single(x));
    lab.ranges = [0.0, 65.533, 1.5].map(single).repeat(4);
    let bytes = record(&session, &[lab]);
    let found = dataset(&session, bytes.clone());
    for scan in found.poses[0].scans() {
        let scan = scan.expect("there");
        assert!(
            scan[0].is_nan() && scan[1] == f64::INFINITY && scan[2] == 1.5,
            "{scan:?}"
        );
    }
    let words = "33.33 % of the readings (4) are 0, 33.33 % of the readings (4) are beyond the longest range: they count as missing";
    assert_eq!(found.warnings, [words]);
    // The message's own limits are narrower than the session's.
    let near = dataset(&session, with_scans(&bytes, |scan| with_number(scan, 6, 1.25)));
    let scan = near.poses[0].scans().next().expect("one").expect("there");
    assert_eq!(scan[2], f64::INFINITY);
    // Limits that no scanner has, with their place.
    for (place, number, words) in [
        (5, f32::NAN, "range_min is NaN and range_max 60"),
        (6, f32::NAN, "and range_max NaN"),
        (5, -1.0, "range_min is -1 and range_max 60"),
        (5, 61.0, "range_min is 61 and range_max 60"),
    ] {
        let changed = with_scans(&bytes, |scan| with_number(scan, place, number));
        let error = parse_dataset(session.clone(), changed)
            .map(|_| ())
            .expect_err("refused")
            .to_string();
        assert!(
            error.contains("/scan: pose 0: ") && error.contains(words),
            "{error}"
        );
    }
}

#[test]
fn an_azimuth_of_many_turns_is_that_of_another_scanner() {
    let session = session(3);
    let bytes = record(&session, &[stretch(&session, 0, 2, 3, 5)]);
    for azimuth in [3e38, -3e38, 1e6] {
        let changed = with_scans(&bytes, |scan| with_number(scan, 0, azimuth));
        let error = parse_dataset(session.clone(), changed)
            .map(|_| ())
            .expect_err("refused")
            .to_string();
        assert!(
            error.contains("pose 0: beams from ") && error.contains("session.toml has"),
            "{error}"
        );
    }
}

#[test]
fn a_recording_of_a_flight_alone_is_read() {
    let session = session(BEAMS);
    let mut flight = stretch(&session, 4, 8, 60, 3);
    flight.label = PoseLabel::of(4, PoseKind::Flight, 8);
    let found = dataset(&session, record(&session, std::slice::from_ref(&flight)));
    assert_eq!(found.warnings, [""; 0]);
    let [pose] = &found.poses[..] else {
        panic!("{} stretches", found.poses.len());
    };
    assert_eq!((pose.label.kind, pose.label.pose), (PoseKind::Flight, 4));
    let seen = flight.tracks[0]
        .frames
        .iter()
        .filter(|f| f.pose.is_some())
        .count();
    assert_eq!(pose.motion.as_ref().expect("it moves").frames.len(), seen);
    assert_eq!(pose.scans().count(), 8);
}

#[test]
fn a_byte_order_mark_changes_no_session() {
    let session = session(3);
    let text = toml::to_string(&session).expect("TOML");
    let marked = [b"\xef\xbb\xbf", text.as_bytes()].concat();
    assert_eq!(
        crate::parse_session(&marked, "session.toml").expect("read"),
        session
    );
}
