//! Writing `observations.mcap`: the stretches of an experiment as a ROS 2 recording.
//!
//! | topic | message | when |
//! |---|---|---|
//! | `/tf_static` | `tf2_msgs/TFMessage`: laser in rig, as the drawing has it | once, at the beginning |
//! | `/session/pose` | the [`PoseLabel`](catoptric_model::PoseLabel) as JSON | before the messages of its stretch |
//! | `/tf` | `tf2_msgs/TFMessage`: the bodies as first seen | at the start of a stretch; in a flight every frame after |
//! | `/points` | `sensor_msgs/PointCloud2`: the plane as scanned | the first scan of a stretch, not every scan |
//! | `/scan` | `sensor_msgs/LaserScan` | every scan |
//! | `/echoes` | `sensor_msgs/MultiEchoLaserScan` | every scan of a scanner that reports more than one echo |
//! | `/mocap/<subject>` | `geometry_msgs/PoseStamped` in `room` | every frame in which the body was solved |
//! | `/mocap/markers` | `mocap4r2_msgs/Markers` in `room`: "subject/marker", those that were seen | every frame |
//!
//! Time is [`EPOCH_NS`] plus the time since the recording began, in whole nanoseconds; log time, publish time and
//! stamp are one. The messages of a stretch stand in order of time. The same stretches give the same bytes.
//!
//! `/session/pose` has no schema: rosbags refuses a recording with one that is not ROS, and Foxglove needs none.

use super::bodies::{Bodies, MARKERS_TOPIC};
use super::definitions::{self, Definition};
use super::error::IoError;
use super::messages::{self, FrameTransform, LASER_FRAME, LabelledMarker, ROOM_FRAME};
pub use super::schedule::EPOCH_NS;
use super::schedule::{Event, Simultaneous, nanoseconds, schedule, simultaneous_frames};
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::frame::Pose;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{Session, Stretch};
use mcap::records::MessageHeader;
use mcap::write::NoSeek;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Longest recording, in seconds: times must stay inside the 32 bits of a stamp (January 2038).
const LONGEST_S: f64 = 6e8;

/// A recording being written, one stretch at a time.
///
/// Dropped before [`finish`](Self::finish) it leaves a file without its end, which no reader takes for whole.
pub struct RecordingWriter<W: Write> {
    mcap: Option<mcap::Writer<NoSeek<W>>>,
    path: PathBuf,
    scanner: ScannerSheet,
    bodies: Bodies,
    channels: Channels,
    sequences: BTreeMap<u16, u32>,
    frame_number: u32,
}

/// The channels of a recording.
struct Channels {
    label: u16,
    transforms: u16,
    points: u16,
    scan: u16,
    /// Added with the first stretch that has echoes: other recordings need no such topic.
    echoes: Option<u16>,
    poses: Vec<u16>,
    markers: u16,
}

impl<W: Write> RecordingWriter<W> {
    /// Begins a recording; `path` names it in errors.
    ///
    /// # Errors
    /// [`IoError`] if the session's names cannot be topics, or writing fails.
    pub fn create(writer: W, path: &Path, session: &Session) -> Result<Self, IoError> {
        let fail = |e| mcap_error(path, e);
        let bodies = Bodies::of(session, path)?;
        let mut mcap = mcap::WriteOptions::new()
            .profile("ros2")
            .library(concat!("catoptric ", env!("CARGO_PKG_VERSION")))
            .compression(Some(mcap::Compression::Lz4))
            // Chunks are made in memory: a full disk is then met only where it is reported as one.
            .disable_seeking(true)
            .create(NoSeek::new(writer))
            .map_err(fail)?;
        let mut add = |topic: &str, definition: Definition| add_channel(&mut mcap, topic, definition);
        let static_transforms = add("/tf_static", definitions::TF_MESSAGE).map_err(fail)?;
        let transforms = add("/tf", definitions::TF_MESSAGE).map_err(fail)?;
        let points = add("/points", definitions::POINT_CLOUD).map_err(fail)?;
        let scan = add("/scan", definitions::LASER_SCAN).map_err(fail)?;
        let topic = |name: &str| format!("/mocap/{name}");
        let poses = bodies
            .all
            .iter()
            .map(|b| add(&topic(&b.subject), definitions::POSE_STAMPED))
            .collect::<Result<_, _>>()
            .map_err(fail)?;
        let markers = add(&topic(MARKERS_TOPIC), definitions::MARKERS).map_err(fail)?;
        let label = mcap
            .add_channel(0, "/session/pose", "json", &BTreeMap::new())
            .map_err(fail)?;
        let mut recording = Self {
            mcap: Some(mcap),
            path: path.to_owned(),
            scanner: session.scanner.clone(),
            bodies,
            channels: Channels {
                label,
                transforms,
                points,
                scan,
                echoes: None,
                poses,
                markers,
            },
            sequences: BTreeMap::new(),
            frame_number: 0,
        };
        let mount = FrameTransform {
            parent: RIG_SUBJECT,
            child: LASER_FRAME,
            pose: Pose::from(&session.nominal_rig_from_sensor),
        };
        let message = messages::encode_transforms(EPOCH_NS, &[mount]);
        recording.put(static_transforms, EPOCH_NS, &message)?;
        Ok(recording)
    }

    /// Appends a stretch.
    ///
    /// # Errors
    /// [`IoError::Content`] if its numbers do not fit each other or the session, otherwise what went wrong in
    /// writing.
    pub fn write_stretch(&mut self, stretch: &Stretch) -> Result<(), IoError> {
        self.check(stretch)
            .map_err(|what| IoError::content(&self.path, format!("pose {}: {what}", stretch.label.pose)))?;
        let start = EPOCH_NS + nanoseconds(stretch.start_s);
        let frames = simultaneous_frames(stretch);
        for (time, event) in schedule(stretch, start, &frames) {
            let (channel, message) = match event {
                Event::Label => (self.channels.label, self.encode_label(stretch)?),
                Event::Transforms => {
                    let transforms: Vec<_> = first_seen(stretch).collect();
                    (
                        self.channels.transforms,
                        messages::encode_transforms(time, &transforms),
                    )
                }
                Event::Moved { track, frame } => {
                    let track = &stretch.tracks[track];
                    let Some(pose) = track.frames[frame].pose else {
                        continue;
                    };
                    let transform = FrameTransform {
                        parent: ROOM_FRAME,
                        child: &track.subject,
                        pose,
                    };
                    (
                        self.channels.transforms,
                        messages::encode_transforms(time, &[transform]),
                    )
                }
                Event::Points => {
                    let first = &stretch.ranges[..stretch.beams];
                    (
                        self.channels.points,
                        messages::encode_points(time, &self.scanner, first),
                    )
                }
                Event::Scan(k) => {
                    let ranges = &stretch.ranges[k * stretch.beams..(k + 1) * stretch.beams];
                    let period = stretch.scan_period_s;
                    (
                        self.channels.scan,
                        messages::encode_scan(time, &self.scanner, period, ranges),
                    )
                }
                Event::Echoes(k) => {
                    let Some(echoes) = &stretch.echoes else { continue };
                    let echoes = &echoes[k * stretch.beams..(k + 1) * stretch.beams];
                    let period = stretch.scan_period_s;
                    (
                        self.echo_channel()?,
                        messages::encode_echoes(time, &self.scanner, period, echoes),
                    )
                }
                Event::Pose { track, frame } => {
                    let track = &stretch.tracks[track];
                    let body = self.bodies.position(&track.subject);
                    let Some((body, pose)) = body.zip(track.frames[frame].pose) else {
                        continue;
                    };
                    (self.channels.poses[body], messages::encode_pose(time, &pose))
                }
                Event::Markers => {
                    let seen = self.seen_markers(stretch, &frames[&time]);
                    let message = messages::encode_markers(time, self.frame_number, &seen);
                    self.frame_number = self.frame_number.wrapping_add(1);
                    (self.channels.markers, message)
                }
            };
            self.put(channel, time, &message)?;
        }
        Ok(())
    }

    /// Ends the recording and hands the writer back, flushed.
    ///
    /// # Errors
    /// [`IoError`] if writing fails.
    pub fn finish(mut self) -> Result<W, IoError> {
        let mut mcap = self.mcap.take().expect("taken only here and on drop");
        mcap.finish().map_err(|e| mcap_error(&self.path, e))?;
        let mut writer = mcap.into_inner().into_inner();
        writer.flush().map_err(|e| IoError::write(&self.path, e))?;
        Ok(writer)
    }

    /// The channel of the echoes, made when it is first needed.
    fn echo_channel(&mut self) -> Result<u16, IoError> {
        if let Some(channel) = self.channels.echoes {
            return Ok(channel);
        }
        let mcap = self.mcap.as_mut().expect("taken only at the end");
        let channel = add_channel(mcap, "/echoes", definitions::MULTI_ECHO_SCAN)
            .map_err(|e| mcap_error(&self.path, e))?;
        self.channels.echoes = Some(channel);
        Ok(channel)
    }

    /// Writes one message.
    fn put(&mut self, channel: u16, time: u64, message: &[u8]) -> Result<(), IoError> {
        let next = self.sequences.entry(channel).or_default();
        let header = MessageHeader {
            channel_id: channel,
            sequence: *next,
            log_time: time,
            publish_time: time,
        };
        *next = next.wrapping_add(1);
        let mcap = self.mcap.as_mut().expect("taken only at the end");
        mcap.write_to_known_channel(&header, message)
            .map_err(|e| mcap_error(&self.path, e))
    }

    fn encode_label(&self, stretch: &Stretch) -> Result<Vec<u8>, IoError> {
        serde_json::to_vec(&stretch.label).map_err(|e| IoError::json(&self.path, &e))
    }

    /// The markers that were seen at one time.
    fn seen_markers(&self, stretch: &Stretch, frames: &Simultaneous) -> Vec<LabelledMarker> {
        let mut seen = Vec::new();
        for &(track, frame) in frames {
            let track = &stretch.tracks[track];
            let Some(body) = self.bodies.position(&track.subject) else {
                continue;
            };
            let labels = &self.bodies.all[body].labels;
            for (index, (name, marker)) in labels.iter().zip(&track.frames[frame].markers).enumerate() {
                let name = name.clone();
                seen.extend(marker.map(|point| LabelledMarker { name, index, point }));
            }
        }
        seen
    }

    /// What of a stretch does not fit.
    fn check(&self, stretch: &Stretch) -> Result<(), String> {
        let time_fits = |t: f64| (0.0..=LONGEST_S).contains(&t);
        let beams = self.scanner.beams;
        if stretch.beams != beams || beams == 0 {
            return Err(format!("{} beams, the scanner has {beams}", stretch.beams));
        }
        let expected = stretch.label.scans.saturating_mul(beams);
        if stretch.ranges.len() != expected {
            return Err(format!("{} readings, {expected} expected", stretch.ranges.len()));
        }
        if let Some(found) = stretch.echoes.as_ref().map(Vec::len).filter(|n| *n != expected) {
            return Err(format!("echoes of {found} readings, {expected} expected"));
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

impl<W: Write> Drop for RecordingWriter<W> {
    fn drop(&mut self) {
        // An `mcap::Writer` that is dropped ends its file properly; one taken apart does not.
        if let Some(mcap) = self.mcap.take() {
            drop(mcap.into_inner());
        }
    }
}

fn add_channel<W: Write>(
    mcap: &mut mcap::Writer<NoSeek<W>>,
    topic: &str,
    definition: Definition,
) -> mcap::McapResult<u16> {
    let text = definition.text();
    let schema = mcap.add_schema(definition.name, "ros2msg", text.as_bytes())?;
    mcap.add_channel(schema, topic, "cdr", &BTreeMap::new())
}

/// Where each body was when it was first solved.
fn first_seen(stretch: &Stretch) -> impl Iterator<Item = FrameTransform<'_>> {
    stretch.tracks.iter().filter_map(|track| {
        let pose = track.frames.iter().find_map(|f| f.pose)?;
        Some(FrameTransform {
            parent: ROOM_FRAME,
            child: &track.subject,
            pose,
        })
    })
}

/// What went wrong in writing.
fn mcap_error(path: &Path, error: mcap::McapError) -> IoError {
    match error {
        mcap::McapError::Io(source) => IoError::write(path, source),
        other => IoError::write(path, std::io::Error::other(other)),
    }
}
