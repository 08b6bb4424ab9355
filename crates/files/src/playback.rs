//! Reading `observations.mcap`, our own or a third party's.
//!
//! A stretch begins with its message on `/session/pose` and lasts to the next. It has exactly as many scans as its
//! label states. The recording begins with its first message. Topics that are not in the table of
//! [`recording`](super::recording) are ignored, and so are bodies and markers that are not in the session, and
//! motion capture before the first label. A frame without a message on `/mocap/markers` has an empty list of markers.

use super::blocks::{Place, words};
use super::bodies::{Bodies, MARKERS_TOPIC};
use super::definitions::{self, Definition};
use super::error::IoError;
use super::gathering::{Gathering, Keep, Known, Whole};
use super::messages;
use super::source::{Source, Start};
use super::survey::{Survey, Surveyed, watch};
use catoptric_model::session::ScannerSheet;
use catoptric_model::{ModelError, PoseLabel, PoseRecord, Readings, ScanSource, Session, Stop, Stretch};
use mcap::records::{Record, op};
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};

/// The content of a channel.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Topic {
    Label,
    Scan,
    Echoes,
    Pose(usize),
    Markers,
    Other,
}

/// The state of reading a recording.
struct Playback<'a, R: Keep> {
    scanner: &'a ScannerSheet,
    bodies: Bodies,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Topic>,
    /// Time of the first message, in nanoseconds.
    epoch: Option<u64>,
    current: Option<Gathering<R>>,
    /// Locations of the stretches.
    starts: Vec<Start>,
    finished: Vec<R::Kept>,
}

/// Reads a recording, frame by frame; all of its stretches are held in memory.
///
/// Ranges are returned as the 32-bit numbers that were stored, poses and markers bit for bit.
///
/// # Errors
/// [`IoError`] with the file and offset if it cannot be read, is cut off or corrupt, or does not fit the session.
pub fn read_recording(path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    Ok(play::<Whole>(&Place::File(path.to_owned()), session, &Stop::default())?.0)
}

/// Reads a recording from memory; `path` names it in errors.
///
/// # Errors
/// [`IoError`] as [`read_recording`].
pub fn parse_recording(bytes: &[u8], path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    let place = Place::Memory(path.to_owned(), Arc::from(bytes));
    Ok(play::<Whole>(&place, session, &Stop::default())?.0)
}

/// Reads what a calibration needs of every stretch of a recording; readings stay in the recording.
///
/// The outer error concerns the recording, the inner one a stretch that no calibration can use.
pub(super) fn survey(
    place: Place,
    session: &Session,
    stop: &Stop,
) -> Result<Result<Vec<PoseRecord>, ModelError>, IoError> {
    let (surveyed, source) = play::<Survey>(&place, session, stop)?;
    let source = Arc::new(source);
    let complete = |(stretch, surveyed): (usize, Surveyed)| {
        let mut record = match surveyed.record {
            Ok(record) => record,
            Err(error) => return Ok(Err(error)),
        };
        if !surveyed.unwatched.is_empty() {
            record.watched = watch(&source, stretch, surveyed.unwatched)?;
        }
        let recording: Arc<dyn ScanSource> = Arc::<Source>::clone(&source);
        record.readings = Readings::recorded(recording, stretch, record.label.scans, surveyed.statistics);
        Ok(Ok(record))
    };
    let records: Vec<Result<PoseRecord, ModelError>> = surveyed
        .into_par_iter()
        .enumerate()
        .map(complete)
        .collect::<Result<_, IoError>>()?;
    Ok(records.into_iter().collect())
}

/// Reads a recording once and returns the data kept of every stretch, and the index of its messages.
fn play<R: Keep>(place: &Place, session: &Session, stop: &Stop) -> Result<(Vec<R::Kept>, Source), IoError> {
    let mut playback = Playback::<R> {
        scanner: &session.scanner,
        bodies: Bodies::of(session, place.path())?,
        schemas: BTreeMap::new(),
        topics: BTreeMap::new(),
        epoch: None,
        current: None,
        starts: Vec::new(),
        finished: Vec::new(),
    };
    let (blocks, length) = place.visit(stop, |opcode, data, at| playback.record(opcode, data, at))?;
    let ended = playback.end_stretch();
    ended.map_err(|what| place.corrupt(what, length))?;
    let source = Source {
        place: place.clone(),
        stop: stop.clone(),
        blocks,
        stretches: playback.starts,
        topics: playback.topics,
        epoch: playback.epoch.unwrap_or_default(),
        bodies: playback.bodies,
        kept: Mutex::default(),
    };
    Ok((playback.finished, source))
}

impl<R: Keep> Playback<'_, R> {
    /// Processes a record, given the index of its block and its index there.
    fn record(&mut self, opcode: u8, data: &[u8], at: (usize, usize)) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match mcap::parse_record(opcode, data).map_err(|e| words(&e))? {
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
            }
            Record::Channel(channel) => {
                let schema = self
                    .schemas
                    .get(&channel.schema_id)
                    .map_or("no schema", String::as_str);
                let topic = self.topic(&channel.topic, schema, &channel.message_encoding)?;
                self.topics.insert(channel.id, topic);
            }
            Record::Message { header, data } => {
                self.epoch.get_or_insert(header.log_time);
                let topic = self.topics.get(&header.channel_id);
                let topic = topic.ok_or_else(|| {
                    format!("a message on channel {}, which does not exist", header.channel_id)
                })?;
                self.message(&topic.clone(), header.log_time, &data, at)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// The meaning of a topic.
    fn topic(&self, topic: &str, schema: &str, encoding: &str) -> Result<Topic, String> {
        let expect = |definition: Definition, found: Topic| {
            if schema == definition.name && encoding == "cdr" {
                return Ok(found);
            }
            Err(format!(
                "{topic} holds {schema} as {encoding:?}, {} as \"cdr\" is needed",
                definition.name
            ))
        };
        match topic {
            "/scan" => expect(definitions::LASER_SCAN, Topic::Scan),
            "/echoes" => expect(definitions::MULTI_ECHO_SCAN, Topic::Echoes),
            "/session/pose" if encoding == "json" => Ok(Topic::Label),
            "/session/pose" => Err(format!("{topic} is {encoding:?}, \"json\" is needed")),
            _ => match topic.strip_prefix("/mocap/") {
                Some(MARKERS_TOPIC) => expect(definitions::MARKERS, Topic::Markers),
                Some(subject) => match self.bodies.position(subject) {
                    Some(body) => expect(definitions::POSE_STAMPED, Topic::Pose(body)),
                    None => Ok(Topic::Other),
                },
                None => Ok(Topic::Other),
            },
        }
    }

    /// Processes a message.
    fn message(
        &mut self,
        topic: &Topic,
        log_time: u64,
        data: &[u8],
        at: (usize, usize),
    ) -> Result<(), String> {
        let known = Known {
            scanner: self.scanner,
            bodies: &self.bodies,
            epoch: self.epoch.unwrap_or_default(),
        };
        match topic {
            Topic::Label => {
                let label: PoseLabel =
                    serde_json::from_slice(data).map_err(|e| format!("/session/pose: {e}"))?;
                self.end_stretch()?;
                self.starts.push(Start {
                    label: at,
                    scans: label.scans,
                });
                self.current = Some(Gathering::new(label, log_time, self.scanner));
            }
            Topic::Scan => {
                let scan = messages::decode_scan(data).map_err(|e| format!("/scan: {e}"))?;
                let current = self.current.as_mut();
                let current = current.ok_or("/scan: a scan before the first /session/pose")?;
                current
                    .scan(scan, self.scanner)
                    .map_err(|what| format!("/scan: pose {}: {what}", current.number()))?;
            }
            Topic::Echoes => {
                let (_, echoes) = messages::decode_echoes(data).map_err(|e| format!("/echoes: {e}"))?;
                let current = self.current.as_mut();
                let current = current.ok_or("/echoes: a scan before the first /session/pose")?;
                current
                    .echoes(echoes, self.scanner)
                    .map_err(|what| format!("/echoes: pose {}: {what}", current.number()))?;
            }
            Topic::Pose(body) => {
                let subject = &self.bodies.all[*body].subject;
                let (time, pose) =
                    messages::decode_pose(data).map_err(|e| format!("/mocap/{subject}: {e}"))?;
                if let Some(current) = &mut self.current {
                    let taken = current.pose(time, *body, pose, known);
                    taken.map_err(|what| format!("/mocap/{subject}: pose {}: {what}", current.number()))?;
                }
            }
            Topic::Markers => {
                let (time, markers) =
                    messages::decode_markers(data).map_err(|e| format!("/mocap/{MARKERS_TOPIC}: {e}"))?;
                if let Some(current) = &mut self.current {
                    let taken = current.markers(time, &markers, known);
                    taken.map_err(|what| {
                        format!("/mocap/{MARKERS_TOPIC}: pose {}: {what}", current.number())
                    })?;
                }
            }
            Topic::Other => {}
        }
        Ok(())
    }

    /// Ends the current stretch, if there is one.
    fn end_stretch(&mut self) -> Result<(), String> {
        let Some(gathering) = self.current.take() else {
            return Ok(());
        };
        let known = Known {
            scanner: self.scanner,
            bodies: &self.bodies,
            epoch: self.epoch.unwrap_or_default(),
        };
        self.finished.push(gathering.end(known)?);
        Ok(())
    }
}
