//! Writing `observations.mcap`: the stretches of an experiment as a ROS 2 recording.
//!
//! | topic | message | when |
//! |---|---|---|
//! | `/tf_static` | `tf2_msgs/TFMessage`: laser in rig, nominal | once, at the beginning |
//! | `/session/pose` | `std_msgs/String`: the [`PoseLabel`](catoptric_model::PoseLabel) as JSON | before the messages of its stretch |
//! | `/tf` | `tf2_msgs/TFMessage`: the bodies as first seen | at the start of a stretch; in a flight every frame after |
//! | `/points` | `sensor_msgs/PointCloud2`: the plane as scanned | the first scan of a stretch, not every scan |
//! | `/scan` | `sensor_msgs/LaserScan` | every scan |
//! | `/echoes` | `sensor_msgs/MultiEchoLaserScan` | every scan of a scanner that reports more than one echo |
//! | `/mocap/<subject>` | `geometry_msgs/PoseStamped` in `room` | every frame in which the body was solved |
//! | `/mocap/markers` | `mocap4r2_msgs/Markers` in `room`: "subject/marker", those that were seen | every frame |
//!
//! Time is [`EPOCH_NS`] plus the time since the recording began, in whole nanoseconds; log time, publish time and
//! stamp are equal. The messages of a stretch are ordered by time. The same stretches give the same bytes.

use super::bodies::{Bodies, MARKERS_TOPIC};
use super::container::Container;
use super::definitions::{self, Definition};
use super::error::IoError;
use super::messages::{self, FrameTransform, LASER_FRAME, LabeledMarker, ROOM_FRAME};
pub use super::schedule::EPOCH_NS;
use super::schedule::{Event, Simultaneous, schedule, simultaneous_frames};
use super::topics::LABEL_TOPIC;
use catoptric_model::dataset::{RIG_SUBJECT, nanoseconds};
use catoptric_model::frame::Pose;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{Excerpt, Session, Stretch};
use std::collections::BTreeMap;
use std::io::Write;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Maximum length of a recording, in seconds: times must fit into the 32 bits of a stamp (January 2038).
const LONGEST_S: f64 = 6e8;

/// A recording being written, stretch by stretch or excerpt by excerpt.
///
/// If dropped before [`finish`](Self::finish), it leaves a file without an end, which readers reject as incomplete.
pub struct RecordingWriter<W: Write> {
    container: Container<W>,
    encoder: Arc<RecordingEncoder>,
    /// Whether the channel of the echoes exists: recordings without echoes do not have this topic.
    has_echoes: bool,
    sequences: BTreeMap<u16, u32>,
    frame_number: u32,
    /// The current stretch, the number of its scans so far, and their final number.
    current: Option<(usize, usize, usize)>,
}

/// The encoder of stretches into messages; usable on any thread.
#[derive(Debug)]
pub struct RecordingEncoder {
    path: PathBuf,
    scanner: ScannerSheet,
    bodies: Bodies,
    channels: Channels,
}

/// The encoded messages of an excerpt or a stretch, in the order of writing.
#[derive(Debug)]
pub struct Encoded {
    pose: usize,
    /// Range of the scans.
    scans: Range<usize>,
    /// Number of scans in the whole stretch.
    expected: usize,
    bytes: Vec<u8>,
    /// Channel, time, and byte range in `bytes`.
    messages: Vec<(u16, u64, Range<usize>)>,
}

/// The channels of a recording.
#[derive(Debug)]
struct Channels {
    label: u16,
    transforms: u16,
    points: u16,
    scan: u16,
    poses: Vec<u16>,
    markers: u16,
    /// Added with the first message.
    echoes: u16,
}

impl<W: Write> RecordingWriter<W> {
    /// Begins a recording; `path` names it in errors.
    ///
    /// # Errors
    /// [`IoError`] if the session's names cannot be topics, or writing fails.
    pub fn create(writer: W, path: &Path, session: &Session) -> Result<Self, IoError> {
        let bodies = Bodies::of(session, path)?;
        let library = concat!("catoptric ", env!("CARGO_PKG_VERSION"));
        let mut container =
            Container::create(writer, "ros2", library).map_err(|e| IoError::write(path, e))?;
        let mut add = |topic: &str, definition: Definition| add_channel(&mut container, topic, definition);
        let static_transforms = add("/tf_static", definitions::TF_MESSAGE);
        let transforms = add("/tf", definitions::TF_MESSAGE);
        let points = add("/points", definitions::POINT_CLOUD);
        let scan = add("/scan", definitions::LASER_SCAN);
        let topic = |name: &str| format!("/mocap/{name}");
        let poses = bodies
            .all
            .iter()
            .map(|b| add(&topic(&b.subject), definitions::POSE_STAMPED))
            .collect();
        let markers = add(&topic(MARKERS_TOPIC), definitions::MARKERS);
        let label = add_channel(&mut container, LABEL_TOPIC, definitions::STRING);
        let encoder = RecordingEncoder {
            path: path.to_owned(),
            scanner: session.scanner.clone(),
            bodies,
            channels: Channels {
                label,
                transforms,
                points,
                scan,
                poses,
                markers,
                echoes: label + 1,
            },
        };
        let mut recording = Self {
            container,
            encoder: Arc::new(encoder),
            has_echoes: false,
            sequences: BTreeMap::new(),
            frame_number: 0,
            current: None,
        };
        let mount = FrameTransform {
            parent: RIG_SUBJECT,
            child: LASER_FRAME,
            pose: Pose::from(&session.nominal_rig_from_sensor),
        };
        let message = messages::encode_transforms(EPOCH_NS, &[mount]);
        recording.put(static_transforms, EPOCH_NS, &message);
        Ok(recording)
    }

    /// The encoder of stretches for this recording.
    pub fn encoder(&self) -> Arc<RecordingEncoder> {
        Arc::clone(&self.encoder)
    }

    /// Appends a stretch.
    ///
    /// # Errors
    /// [`IoError::Content`] if its numbers are inconsistent with each other or the session, otherwise the error in
    /// writing.
    pub fn write_stretch(&mut self, stretch: &Stretch) -> Result<(), IoError> {
        let encoded = self.encoder.encode_stretch(stretch)?;
        self.append(vec![encoded])
    }

    /// Appends encoded messages, in order. Full chunks are compressed in parallel and written; the rest waits for
    /// more messages.
    ///
    /// # Errors
    /// [`IoError::Content`] if scans of a stretch are missing, otherwise the error in writing.
    pub fn append(&mut self, encoded: Vec<Encoded>) -> Result<(), IoError> {
        for mut next in encoded {
            self.follow(&next)?;
            for (channel, time, range) in next.messages {
                let channels = &self.encoder.channels;
                let message = &mut next.bytes[range];
                if channel == channels.markers {
                    message[messages::FRAME_NUMBER].copy_from_slice(&self.frame_number.to_le_bytes());
                    self.frame_number = self.frame_number.wrapping_add(1);
                } else if channel == channels.echoes && !self.has_echoes {
                    self.has_echoes = true;
                    let added = add_channel(&mut self.container, "/echoes", definitions::MULTI_ECHO_SCAN);
                    assert_eq!(added, channel, "it is the only channel that is added later");
                }
                self.put(channel, time, message);
            }
        }
        let written = self.container.write_full();
        written.map_err(|e| IoError::write(&self.encoder.path, e))
    }

    /// Ends the recording and returns the writer, flushed.
    ///
    /// # Errors
    /// [`IoError`] if scans of a stretch are missing or writing fails.
    pub fn finish(self) -> Result<W, IoError> {
        self.check_current()?;
        let path = &self.encoder.path;
        self.container.finish().map_err(|e| IoError::write(path, e))
    }

    /// Writes one message.
    fn put(&mut self, channel: u16, time: u64, message: &[u8]) {
        let next = self.sequences.entry(channel).or_default();
        self.container.put(channel, *next, time, message);
        *next = next.wrapping_add(1);
    }

    /// Checks that these scans are the next ones.
    fn follow(&mut self, next: &Encoded) -> Result<(), IoError> {
        let due = match self.current {
            Some((pose, done, _)) if next.scans.start > 0 => (pose, done),
            _ => {
                self.check_current()?;
                (next.pose, 0)
            }
        };
        if due != (next.pose, next.scans.start) {
            let (pose, scan) = (next.pose, next.scans.start);
            let what = format!(
                "pose {pose}: scan {scan} follows scan {} of pose {}",
                due.1, due.0
            );
            return Err(IoError::content(&self.encoder.path, what));
        }
        self.current = Some((next.pose, next.scans.end, next.expected));
        Ok(())
    }

    /// Checks that the current stretch is complete.
    fn check_current(&self) -> Result<(), IoError> {
        match self.current {
            Some((pose, done, expected)) if done != expected => Err(IoError::content(
                &self.encoder.path,
                format!("pose {pose}: {done} scans, its label says {expected}"),
            )),
            _ => Ok(()),
        }
    }
}

impl RecordingEncoder {
    /// Encodes a whole stretch.
    ///
    /// # Errors
    /// [`IoError::Content`] if its numbers are inconsistent with each other or the session.
    pub fn encode_stretch(&self, stretch: &Stretch) -> Result<Encoded, IoError> {
        self.encode(stretch, 0..stretch.label.scans, &stretch.first_seen())
    }

    /// Encodes an excerpt of a stretch.
    ///
    /// # Errors
    /// [`IoError::Content`] if its numbers are inconsistent with each other or the session.
    pub fn encode_excerpt(&self, excerpt: &Excerpt) -> Result<Encoded, IoError> {
        let scans = excerpt.part.ranges.len() / excerpt.part.beams.max(1);
        let scans = excerpt.first_scan..excerpt.first_scan + scans;
        self.encode(&excerpt.part, scans, &excerpt.first_seen)
    }

    fn encode(
        &self,
        part: &Stretch,
        scans: Range<usize>,
        first_seen: &[Option<(f64, Pose)>],
    ) -> Result<Encoded, IoError> {
        self.check(part, &scans).map_err(|what| {
            let pose = part.label.pose;
            IoError::content(&self.path, format!("pose {pose}: {what}"))
        })?;
        let mut encoded = Encoded {
            pose: part.label.pose,
            scans: scans.clone(),
            expected: part.label.scans,
            bytes: Vec::with_capacity(part.ranges.len() * size_of::<f32>() * 9 / 8),
            messages: Vec::new(),
        };
        let start = EPOCH_NS + nanoseconds(part.start_s);
        let frames = simultaneous_frames(part);
        for (time, event) in schedule(part, &scans, first_seen, start, &frames) {
            let Some((channel, message)) = self.message(part, &scans, first_seen, &frames, time, event)?
            else {
                continue;
            };
            let begin = encoded.bytes.len();
            encoded.bytes.extend(message);
            encoded.messages.push((channel, time, begin..encoded.bytes.len()));
        }
        Ok(encoded)
    }

    /// One message with its channel; `None` for one without a channel.
    fn message(
        &self,
        part: &Stretch,
        scans: &Range<usize>,
        first_seen: &[Option<(f64, Pose)>],
        frames: &BTreeMap<u64, Simultaneous>,
        time: u64,
        event: Event,
    ) -> Result<Option<(u16, Vec<u8>)>, IoError> {
        let (channels, period) = (&self.channels, part.scan_period_s);
        let readings = |scan: usize| (scan - scans.start) * part.beams..(scan - scans.start + 1) * part.beams;
        Ok(Some(match event {
            Event::Label => {
                let label = serde_json::to_string(&part.label).map_err(|e| IoError::json(&self.path, &e))?;
                (channels.label, messages::encode_text(&label))
            }
            Event::Transforms => {
                let seen = part.tracks.iter().zip(first_seen);
                let transforms: Vec<_> = seen
                    .filter_map(|(track, seen)| Some(in_room(&track.subject, seen.as_ref()?.1)))
                    .collect();
                (
                    channels.transforms,
                    messages::encode_transforms(time, &transforms),
                )
            }
            Event::Moved { track, frame } => {
                let track = &part.tracks[track];
                let Some(pose) = track.frames[frame].pose else {
                    return Ok(None);
                };
                let transform = in_room(&track.subject, pose);
                (
                    channels.transforms,
                    messages::encode_transforms(time, &[transform]),
                )
            }
            Event::Points => {
                let first = &part.ranges[readings(0)];
                (
                    channels.points,
                    messages::encode_points(time, &self.scanner, first),
                )
            }
            Event::Scan(k) => {
                let ranges = &part.ranges[readings(k)];
                let counts = part.intensities.as_ref().map_or(&[][..], |all| &all[readings(k)]);
                (
                    channels.scan,
                    messages::encode_scan(time, &self.scanner, period, ranges, counts),
                )
            }
            Event::Echoes(k) => {
                let Some(echoes) = &part.echoes else {
                    return Ok(None);
                };
                let echoes = &echoes[readings(k)];
                let counts = part
                    .echo_intensities
                    .as_ref()
                    .map_or(&[][..], |all| &all[readings(k)]);
                (
                    channels.echoes,
                    messages::encode_echoes(time, &self.scanner, period, echoes, counts),
                )
            }
            Event::Pose { track, frame } => {
                let track = &part.tracks[track];
                let body = self.bodies.position(&track.subject);
                let Some((body, pose)) = body.zip(track.frames[frame].pose) else {
                    return Ok(None);
                };
                (channels.poses[body], messages::encode_pose(time, &pose))
            }
            Event::Markers => {
                // Frame numbers are assigned when the messages are put in order.
                let seen = self.seen_markers(part, &frames[&time]);
                (channels.markers, messages::encode_markers(time, 0, &seen))
            }
        }))
    }

    /// The markers seen at one time.
    fn seen_markers(&self, stretch: &Stretch, frames: &Simultaneous) -> Vec<LabeledMarker> {
        let mut seen = Vec::new();
        for &(track, frame) in frames {
            let track = &stretch.tracks[track];
            let Some(body) = self.bodies.position(&track.subject) else {
                continue;
            };
            let labels = &self.bodies.all[body].labels;
            for (index, (name, marker)) in labels.iter().zip(&track.frames[frame].markers).enumerate() {
                let name = name.clone();
                seen.extend(marker.map(|point| LabeledMarker { name, index, point }));
            }
        }
        seen
    }

    /// Checks that a stretch is consistent.
    fn check(&self, stretch: &Stretch, scans: &Range<usize>) -> Result<(), String> {
        let time_fits = |t: f64| (0.0..=LONGEST_S).contains(&t);
        let beams = self.scanner.scan.beams();
        if stretch.beams != beams {
            return Err(format!("{} beams, the scanner has {beams}", stretch.beams));
        }
        if scans.end > stretch.label.scans {
            return Err(format!(
                "scan {}, its label says {}",
                scans.end - 1,
                stretch.label.scans
            ));
        }
        let expected = scans.len().saturating_mul(beams);
        if stretch.ranges.len() != expected {
            return Err(format!("{} readings, {expected} expected", stretch.ranges.len()));
        }
        if let Some(found) = stretch.echoes.as_ref().map(Vec::len).filter(|n| *n != expected) {
            return Err(format!("echoes of {found} readings, {expected} expected"));
        }
        let counts = [
            stretch.intensities.as_ref().map(Vec::len),
            stretch.echo_intensities.as_ref().map(Vec::len),
        ];
        if let Some(found) = counts.into_iter().flatten().find(|n| *n != expected) {
            return Err(format!("intensities of {found} readings, {expected} expected"));
        }
        let duration = stretch.label.scans as f64 * stretch.scan_period_s;
        if !time_fits(stretch.start_s) || !time_fits(duration) || !time_fits(stretch.start_s + duration) {
            return Err(format!("starts at {} s and lasts {duration} s", stretch.start_s));
        }
        for track in &stretch.tracks {
            let body = self.bodies.position(&track.subject);
            let body = body.ok_or_else(|| format!("no body is named {:?}", track.subject))?;
            let expected = self.bodies.all[body].labels.len();
            for frame in &track.frames {
                if !time_fits(frame.time_s) {
                    return Err(format!("a motion-capture frame at {} s", frame.time_s));
                }
                if frame.markers.len() != expected && !frame.markers.is_empty() {
                    let found = frame.markers.len();
                    return Err(format!(
                        "{found} markers of {:?}, it has {expected}",
                        track.subject
                    ));
                }
            }
        }
        Ok(())
    }
}

fn add_channel<W: Write>(container: &mut Container<W>, topic: &str, definition: Definition) -> u16 {
    let schema = container.add_schema(definition.name, "ros2msg", &definition.text());
    container.add_channel(schema, topic, "cdr")
}

/// Pose of a body in the room.
fn in_room(subject: &str, pose: Pose) -> FrameTransform<'_> {
    FrameTransform {
        parent: ROOM_FRAME,
        child: subject,
        pose,
    }
}
