//! Order in which the messages of a stretch are written: by time, and at equal times by kind.

use super::messages::NS_PER_S;
use catoptric_model::dataset::nanoseconds;
use catoptric_model::{Pose, PoseKind, Stretch};
use std::collections::BTreeMap;
use std::ops::Range;

/// Start time of every recording, in nanoseconds since 1970: fixed, so that equal experiments give equal files.
pub const EPOCH_NS: u64 = 1_518_000_000 * NS_PER_S;

/// A message of a stretch; messages with equal times are written in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Event {
    Label,
    Transforms,
    Moved { track: usize, frame: usize },
    Points,
    Scan(usize),
    Echoes(usize),
    Pose { track: usize, frame: usize },
    Markers,
}

/// Frames of the tracks with equal times, as (track, frame).
pub(super) type Simultaneous = Vec<(usize, usize)>;

/// The frames of all bodies by time.
pub(super) fn simultaneous_frames(stretch: &Stretch) -> BTreeMap<u64, Simultaneous> {
    let mut by_time: BTreeMap<u64, Simultaneous> = BTreeMap::new();
    for (t, track) in stretch.tracks.iter().enumerate() {
        for (f, frame) in track.frames.iter().enumerate() {
            let time = EPOCH_NS + nanoseconds(frame.time_s);
            by_time.entry(time).or_default().push((t, f));
        }
    }
    by_time
}

/// All messages of some scans of a stretch and of the accompanying frames, in the order of writing.
pub(super) fn schedule(
    part: &Stretch,
    scans: &Range<usize>,
    first_seen: &[Option<(f64, Pose)>],
    start: u64,
    frames: &BTreeMap<u64, Simultaneous>,
) -> Vec<(u64, Event)> {
    let mut events = Vec::new();
    if scans.start == 0 {
        let first = frames.keys().next().map_or(start, |t| start.min(*t));
        events.extend([(first, Event::Label), (start, Event::Transforms)]);
        if !scans.is_empty() {
            events.push((start, Event::Points));
        }
    }
    for k in scans.clone() {
        let time = start + nanoseconds(k as f64 * part.scan_period_s);
        events.push((time, Event::Scan(k)));
        if part.echoes.is_some() {
            events.push((time, Event::Echoes(k)));
        }
    }
    for (time, members) in frames {
        let mut with_markers = false;
        for &(track, frame) in members {
            let seen = &part.tracks[track].frames[frame];
            with_markers |= !seen.markers.is_empty();
            if seen.pose.is_some() {
                events.push((*time, Event::Pose { track, frame }));
                // The transforms at the start of the stretch already have each body's first pose.
                let first = first_seen[track].is_some_and(|(time_s, _)| time_s == seen.time_s);
                if part.label.kind == PoseKind::Flight && !first {
                    events.push((*time, Event::Moved { track, frame }));
                }
            }
        }
        if with_markers {
            events.push((*time, Event::Markers));
        }
    }
    events.sort_unstable();
    events
}
