//! Reading `observations.mcap`, ours or somebody else's.
//!
//! A stretch begins with its message on `/session/pose` and lasts to the next. It holds exactly as many scans as its
//! label says. The recording begins with its first message. Topics that are not in the table of
//! [`recording`](super::recording) are passed over, and so are bodies and markers that the session does not know and
//! motion capture before the first label. Where `/mocap/markers` has no message, the list of markers is empty.

use super::bodies::{Bodies, MARKERS_TOPIC};
use super::definitions::{self, Definition};
use super::error::IoError;
use super::gathering::Gathering;
use super::messages;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{PoseLabel, Session, Stretch};
use mcap::records::{Record, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use std::collections::BTreeMap;
use std::path::Path;

/// Longest record or chunk that is believed, in bytes; a longer one is a corrupt length, not a reason to allocate.
const LONGEST_RECORD: usize = 1 << 28;

/// What a channel carries.
#[derive(Debug, Clone, PartialEq)]
enum Topic {
    Label,
    Scan,
    Echoes,
    Pose(usize),
    Markers,
    Other,
}

/// The recording so far.
struct Playback<'a> {
    scanner: &'a ScannerSheet,
    bodies: Bodies,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Topic>,
    /// Time of the first message, in nanoseconds.
    epoch: Option<u64>,
    current: Option<Gathering>,
    finished: Vec<Stretch>,
}

/// Reads a recording.
///
/// Ranges come back as the 32-bit numbers they were stored as, poses and markers bit by bit.
///
/// # Errors
/// [`IoError`] with the file and the place if it cannot be read, is cut off or corrupt, or does not fit the session.
pub fn read_recording(path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    let bytes = std::fs::read(path).map_err(|e| IoError::read(path, e))?;
    parse_recording(&bytes, path, session)
}

/// Reads a recording from memory; `path` names it in errors.
///
/// # Errors
/// [`IoError`] as [`read_recording`].
pub fn parse_recording(bytes: &[u8], path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    let mut playback = Playback {
        scanner: &session.scanner,
        bodies: Bodies::of(session, path)?,
        schemas: BTreeMap::new(),
        topics: BTreeMap::new(),
        epoch: None,
        current: None,
        finished: Vec::new(),
    };
    let at = |offset: usize, what: String| IoError::Recording {
        path: path.to_owned(),
        what,
        offset: offset as u64,
    };
    // Every checksum is checked: readings that were damaged must not look like readings.
    let options = LinearReaderOptions::default()
        .with_record_length_limit(LONGEST_RECORD)
        .with_prevalidate_chunk_crcs(true)
        .with_validate_data_section_crc(true)
        .with_validate_summary_section_crc(true)
        .with_check_finishes_after_end_magic(true);
    let mut reader = LinearReader::new_with_options(options);
    let mut offset = 0;
    while let Some(event) = reader.next_event() {
        match event.map_err(|e| at(offset, corrupt(&e)))? {
            LinearReadEvent::ReadRequest(need) => {
                let next = &bytes[offset..bytes.len().min(offset.saturating_add(need))];
                reader.insert(next.len()).copy_from_slice(next);
                reader.notify_read(next.len());
                offset += next.len();
            }
            LinearReadEvent::Record { data, opcode } => {
                playback.record(opcode, data).map_err(|what| at(offset, what))?;
            }
        }
    }
    playback.end_stretch().map_err(|what| at(offset, what))?;
    Ok(playback.finished)
}

/// The reader's error in one line, with what lies beneath it.
fn corrupt(error: &mcap::McapError) -> String {
    match error {
        mcap::McapError::Parse(e) => format!("not a whole recording: {error}: {e}"),
        mcap::McapError::Io(e) => format!("not a whole recording: {e}"),
        _ => format!("not a whole recording: {error}"),
    }
}

impl Playback<'_> {
    /// Takes a record in.
    fn record(&mut self, opcode: u8, data: &[u8]) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match mcap::parse_record(opcode, data).map_err(|e| corrupt(&e))? {
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
                self.message(&topic.clone(), header.log_time, &data)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// What a topic is to us.
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

    /// Takes a message in.
    fn message(&mut self, topic: &Topic, log_time: u64, data: &[u8]) -> Result<(), String> {
        match topic {
            Topic::Label => {
                let label: PoseLabel =
                    serde_json::from_slice(data).map_err(|e| format!("/session/pose: {e}"))?;
                self.end_stretch()?;
                self.current = Some(Gathering::new(label, log_time));
            }
            Topic::Scan => {
                let scan = messages::decode_scan(data).map_err(|e| format!("/scan: {e}"))?;
                let current = self.current.as_mut();
                let current = current.ok_or("/scan: a scan before the first /session/pose")?;
                current
                    .scan(&scan, self.scanner)
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
                    current.pose(time, *body, pose);
                }
            }
            Topic::Markers => {
                let (time, markers) =
                    messages::decode_markers(data).map_err(|e| format!("/mocap/{MARKERS_TOPIC}: {e}"))?;
                if let Some(current) = &mut self.current {
                    current.markers(time, markers);
                }
            }
            Topic::Other => {}
        }
        Ok(())
    }

    /// Closes the current stretch, if there is one.
    fn end_stretch(&mut self) -> Result<(), String> {
        let Some(gathering) = self.current.take() else {
            return Ok(());
        };
        let epoch = self.epoch.unwrap_or_default();
        let stretch = gathering.into_stretch(self.scanner, &self.bodies, epoch)?;
        self.finished.push(stretch);
        Ok(())
    }
}
