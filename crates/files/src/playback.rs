//! Reading `observations.mcap`, our own or a third party's.
//!
//! Messages belong together by the times at which they were logged; their order in the file means nothing. A stretch begins
//! with its label on `/session/pose` and lasts to the next one; of messages logged at the same time the label comes first,
//! and others in the order of the file. Scans and frames of motion capture happen when their own stamps say. The recording
//! begins with its first message. If stretches do not have the scans that their labels state, and log times differ from stamps
//! by up to a scan period, the stamps decide what belongs together, too.
//!
//! Topics that are not in the table of [`recording`](super::recording) are ignored, and so are bodies and markers that are
//! not in the session, and messages before the first label. A frame without a message on `/mocap/markers` has an empty list
//! of markers. Of a message that was recorded more than once one counts. Lost scans, messages and labels that are repeated and
//! readings that are no ranges are counted and noted.

use super::blocks::{Block, Place, Visit};
use super::bodies::{Bodies, MARKERS_TOPIC};
use super::codes::Codes;
use super::error::IoError;
use super::gathering::{Gathering, Keep, Known, Whole};
use super::messages;
use super::order::{Entry, Index};
use super::records;
use super::source::{Position, Source, Start};
use super::topics::{LABEL_TOPIC, Text, Topic};
use catoptric_model::session::ScannerSheet;
use catoptric_model::{PoseLabel, Session, Stop, Stretch};
use mcap::records::op;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

/// What reading a recording makes of it.
pub(super) struct Played<R: Keep> {
    pub(super) stretches: Vec<R::Kept>,
    pub(super) source: Source,
    /// What was unusual, a sentence each.
    pub(super) notes: Vec<String>,
    /// The stretches that are left out, each with the reason.
    pub(super) left_out: Vec<String>,
    /// Number of scans that labels state and that are not there.
    missing: usize,
}

/// The state of reading a recording.
struct Playback<'a, R: Keep> {
    scanner: &'a ScannerSheet,
    bodies: Bodies,
    schemas: BTreeMap<u16, String>,
    topics: BTreeMap<u16, Topic>,
    /// Names of all topics.
    names: BTreeSet<String>,
    /// Time of the first message, in nanoseconds.
    epoch: Option<u64>,
    /// Latest time of the messages taken so far, and that of the current label.
    latest: u64,
    labeled: u64,
    /// Whether messages that belong together are apart, so that they must be sorted; and whether they are.
    is_unordered: bool,
    is_sorted: bool,
    /// Whether a stretch with a fault is left out instead of the whole recording.
    partial: bool,
    /// Whether some of the recording cannot be read.
    has_damage: bool,
    current: Option<Gathering<R>>,
    /// Numbers of the poses so far.
    poses: BTreeSet<usize>,
    /// Locations of the stretches.
    starts: Vec<Start>,
    finished: Vec<R::Kept>,
    codes: Codes,
    /// Scans before the first label.
    unlabeled: usize,
    /// Messages that were recorded before, and number of scans that are not there.
    repeated: usize,
    missing: usize,
    notes: Vec<String>,
    left_out: Vec<String>,
}

/// Reads a recording, frame by frame; all of its stretches are held in memory.
///
/// Ranges are returned as the 32-bit numbers that were stored, poses and markers bit for bit.
///
/// # Errors
/// [`IoError`] with the file and offset if it cannot be read, is cut off or corrupt, or does not fit the session.
pub fn read_recording(path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    let place = Place::File(path.to_owned());
    Ok(play::<Whole>(&place, session, false, &Stop::default())?.stretches)
}

/// Reads a recording from memory; `path` names it in errors.
///
/// # Errors
/// [`IoError`] as [`read_recording`].
pub fn parse_recording(bytes: &[u8], path: &Path, session: &Session) -> Result<Vec<Stretch>, IoError> {
    let place = Place::Memory(path.to_owned(), Arc::from(bytes));
    Ok(play::<Whole>(&place, session, false, &Stop::default())?.stretches)
}

/// Reads a recording and returns the data kept of every stretch, and the index of its messages. If it is `partial`, what is
/// damaged is left out.
pub(super) fn play<R: Keep>(
    place: &Place,
    session: &Session,
    partial: bool,
    stop: &Stop,
) -> Result<Played<R>, IoError> {
    let as_logged = as_logged::<R>(place, session, partial, stop);
    let is_complete = |played: &Played<R>| played.left_out.is_empty() && played.missing == 0;
    match &as_logged {
        Ok(played) if is_complete(played) => return as_logged,
        Ok(_) | Err(IoError::Recording { .. }) => {}
        Err(_) => return as_logged,
    }
    // Log times that jitter may put messages into a neighboring stretch.
    let mut playback = Playback::<R>::new(place, session, partial)?;
    let index = match indexed(place, &mut playback, stop) {
        Ok(index) => index.by_stamps(session.scanner.scan.scan_period_s()),
        Err(error @ IoError::Stopped(_)) => return Err(error),
        // What was found first is reported.
        Err(_) => None,
    };
    let Some((index, jitter_ns)) = index else {
        return as_logged;
    };
    match sorted(place, session, playback, stop, index) {
        Err(error @ IoError::Stopped(_)) => Err(error),
        Ok(mut by_stamp) if is_complete(&by_stamp) => {
            let words = format!(
                "log times are up to {:.1} ms from the stamps of their messages: the stamps decide which stretch a message belongs \
                 to",
                jitter_ns as f64 * 1e-6
            );
            by_stamp.notes.insert(0, words);
            Ok(by_stamp)
        }
        Ok(_) | Err(_) => as_logged,
    }
}

/// Reads a recording in the order of its log times.
fn as_logged<R: Keep>(
    place: &Place,
    session: &Session,
    partial: bool,
    stop: &Stop,
) -> Result<Played<R>, IoError> {
    let mut playback = Playback::<R>::new(place, session, partial)?;
    let visited = place.visit(stop, partial, |event| playback.take(event));
    if !playback.is_unordered {
        let (blocks, length) = visited?;
        let ended = playback.end_stretch(None);
        ended.map_err(|what| place.corrupt(what, length))?;
        return playback.finish(place, blocks, None, stop);
    }
    // Once more, for the times of all messages, and then in order.
    let mut playback = Playback::<R>::new(place, session, partial)?;
    let index = indexed(place, &mut playback, stop)?;
    sorted(place, session, playback, stop, index.by_log_time())
}

/// Reads a recording for the times of its messages.
fn indexed<R: Keep>(place: &Place, playback: &mut Playback<'_, R>, stop: &Stop) -> Result<Index, IoError> {
    let mut index = Index::default();
    let partial = playback.partial;
    let (blocks, length) = place.visit(stop, partial, |event| {
        let Visit::Record { opcode, data, at } = event else {
            return playback.take(event);
        };
        let Some(message) = playback.define(opcode, data)? else {
            return Ok(());
        };
        index.epoch = Some(index.epoch.map_or(message.time, |epoch| epoch.min(message.time)));
        match playback.topics.get(&message.channel) {
            None => Err(playback.no_channel(message.channel)),
            Some(Topic::Other) => Ok(()),
            Some(topic) => index.push(topic, &message, at),
        }
    })?;
    (index.blocks, index.length) = (blocks, length);
    Ok(index)
}

/// Reads the messages of a recording in the order of an index, made with the help of a playback.
fn sorted<R: Keep>(
    place: &Place,
    session: &Session,
    mut playback: Playback<'_, R>,
    stop: &Stop,
    index: Index,
) -> Result<Played<R>, IoError> {
    playback.epoch = index.epoch;
    playback.is_sorted = true;
    let source = Source {
        order: Some(Arc::from(index.entries)),
        ..Source::new(place, &session.scanner, stop, index.blocks)
    };
    for (number, entry) in source.order.iter().flat_map(|order| order.iter()).enumerate() {
        let at = || source.blocks[entry.block as usize].at();
        let records = source.records(entry.block as usize)?;
        let record = records.get(entry.number as usize);
        let message = record.and_then(|(_, body)| records::message(body));
        let mut message = message.ok_or_else(|| place.changed(at()))?;
        message.time = entry.time;
        let taken = playback.message(&message, (0, number));
        taken.map_err(|what| place.corrupt(what, at()))?;
    }
    playback
        .end_stretch(None)
        .map_err(|what| place.corrupt(what, index.length))?;
    let Source { blocks, order, .. } = source;
    playback.finish(place, blocks, order, stop)
}

impl<'a, R: Keep> Playback<'a, R> {
    fn new(place: &Place, session: &'a Session, partial: bool) -> Result<Self, IoError> {
        Ok(Self {
            scanner: &session.scanner,
            bodies: Bodies::of(session, place.path())?,
            schemas: BTreeMap::new(),
            topics: BTreeMap::new(),
            names: BTreeSet::new(),
            epoch: None,
            latest: 0,
            labeled: 0,
            is_unordered: false,
            is_sorted: false,
            partial,
            has_damage: false,
            current: None,
            poses: BTreeSet::new(),
            starts: Vec::new(),
            finished: Vec::new(),
            codes: Codes::default(),
            unlabeled: 0,
            repeated: 0,
            missing: 0,
            notes: Vec::new(),
            left_out: Vec::new(),
        })
    }

    /// Processes what a visit of the recording comes to.
    fn take(&mut self, event: Visit<'_>) -> Result<(), String> {
        match event {
            Visit::Damage(what) => {
                self.fault(what.to_owned());
                self.has_damage = true;
                Ok(())
            }
            Visit::Record { opcode, data, at } => {
                let Some(message) = self.define(opcode, data)? else {
                    return Ok(());
                };
                self.epoch.get_or_insert(message.time);
                self.message(&message, at)
            }
        }
    }

    /// Processes a schema or a channel; returns a message.
    fn define<'m>(&mut self, opcode: u8, data: &'m [u8]) -> Result<Option<records::Message<'m>>, String> {
        let short = |what: &str| format!("not a whole recording: a {what} claims more than its record has");
        match opcode {
            op::SCHEMA => {
                let schema = records::schema(data).ok_or_else(|| short("schema"))?;
                self.schemas.insert(schema.id, schema.name.to_owned());
            }
            op::CHANNEL => {
                let channel = records::channel(data).ok_or_else(|| short("channel"))?;
                let schema = self
                    .schemas
                    .get(&channel.schema)
                    .map_or("no schema", String::as_str);
                let topic = Topic::of(channel.topic, schema, channel.encoding, &self.bodies)?;
                self.names.insert(channel.topic.to_owned());
                self.topics.insert(channel.id, topic);
            }
            op::MESSAGE => return records::message(data).map(Some).ok_or_else(|| short("message")),
            _ => {}
        }
        Ok(None)
    }

    fn no_channel(&self, channel: u16) -> String {
        format!("a message on channel {channel}, which does not exist")
    }

    /// Processes a message, given the index of its block and its index there.
    fn message(&mut self, message: &records::Message<'_>, at: Position) -> Result<(), String> {
        let Some(topic) = self.topics.get(&message.channel).cloned() else {
            return Err(self.no_channel(message.channel));
        };
        // In order, no message comes after a label that was logged later, nor a label after anything logged no earlier.
        let in_order = match topic {
            Topic::Other => return Ok(()),
            _ if self.is_sorted => true,
            Topic::Label(_) => message.time > self.latest || self.latest == 0,
            Topic::Scan | Topic::Echoes => message.time >= self.latest_scan(),
            Topic::Pose(_) | Topic::Markers => message.time >= self.labeled,
        };
        if !in_order {
            self.is_unordered = true;
            return Err("the messages are not in the order of their times".to_owned());
        }
        self.latest = self.latest.max(message.time);
        if let Topic::Label(text) = topic {
            return self.label(text, message, at);
        }
        let Some(current) = &mut self.current else {
            self.unlabeled += usize::from(self.poses.is_empty() && topic == Topic::Scan);
            return Ok(());
        };
        if current.recent.is_repeated(&topic, message.data) {
            self.repeated += 1;
            return Ok(());
        }
        let known = Known {
            scanner: self.scanner,
            bodies: &self.bodies,
            epoch: self.epoch.unwrap_or_default(),
        };
        let (taken, name) = match topic {
            Topic::Label(_) | Topic::Other => return Ok(()),
            Topic::Scan => {
                let scan = messages::decode_scan(message.data).map_err(|e| e.to_string());
                let taken =
                    scan.and_then(|scan| current.scan(scan, message.time, self.scanner, &mut self.codes));
                (taken, "/scan".to_owned())
            }
            Topic::Echoes => {
                let echoes = messages::decode_echoes(message.data).map_err(|e| e.to_string());
                let taken = echoes.and_then(|echoes| current.echoes(echoes, self.scanner));
                (taken, "/echoes".to_owned())
            }
            Topic::Pose(body) => {
                let pose = messages::decode_pose(message.data).map_err(|e| e.to_string());
                let taken = pose.and_then(|(time, pose)| current.pose(time, body, pose, known));
                (taken, format!("/mocap/{}", self.bodies.all[body].subject))
            }
            Topic::Markers => {
                let markers = messages::decode_markers(message.data).map_err(|e| e.to_string());
                let taken = markers.and_then(|(time, markers)| current.markers(time, &markers, known));
                (taken, format!("/mocap/{MARKERS_TOPIC}"))
            }
        };
        match taken {
            Ok(()) => Ok(()),
            Err(what) => {
                let pose = current.number();
                self.fault_or(format!("{name}: pose {pose}: {what}"))
            }
        }
    }

    /// The least time that a scan in order can have.
    fn latest_scan(&self) -> u64 {
        self.current
            .as_ref()
            .map_or(self.labeled, |current| current.latest_scan.max(self.labeled))
    }

    /// Processes a label.
    fn label(&mut self, text: Text, message: &records::Message<'_>, at: Position) -> Result<(), String> {
        self.labeled = message.time;
        let label = match text {
            Text::Bare => Ok(message.data),
            Text::Message => messages::decode_text(message.data).map(str::as_bytes),
        };
        let label = label.map_err(|e| e.to_string());
        let label: Result<PoseLabel, String> =
            label.and_then(|label| serde_json::from_slice(label).map_err(|e| e.to_string()));
        let beams = self.scanner.scan.beams();
        let label = label.and_then(|label| match label.beams {
            Some([first, last]) if first > last || last >= beams => Err(format!(
                "beams is [{first}, {last}]; the first and the last of the beams 0 to {} are allowed",
                beams - 1
            )),
            _ => Ok(label),
        });
        let label = match label {
            Ok(label) => label,
            Err(what) => {
                self.end_stretch(Some(at))?;
                return self.fault_or(format!("{LABEL_TOPIC}: {what}"));
            }
        };
        if let Some(current) = &self.current
            && current.label_time == message.time
            && current.label != label
            && current.scans() == 0
        {
            let (first, second) = (current.number(), label.pose);
            return self.fault_or(format!(
                "{LABEL_TOPIC}: the labels of pose {first} and of pose {second} were logged at the same time"
            ));
        }
        if self
            .current
            .as_ref()
            .is_some_and(|current| current.label == label)
        {
            self.notes
                .push(format!("pose {}: its label was sent more than once", label.pose));
            return Ok(());
        }
        self.end_stretch(Some(at))?;
        if !self.poses.insert(label.pose) {
            return self.fault_or(format!(
                "{LABEL_TOPIC}: there are two stretches of pose {}",
                label.pose
            ));
        }
        self.starts.push(Start {
            label: at,
            end: (usize::MAX, usize::MAX),
            scans: label.scans,
        });
        self.current = Some(Gathering::new(label, message.time, self.scanner));
        Ok(())
    }

    /// A fault in the current stretch: it is left out, or the error is returned.
    fn fault_or(&mut self, what: String) -> Result<(), String> {
        if self.partial {
            self.fault(what);
            return Ok(());
        }
        Err(what)
    }

    /// Leaves out the current stretch, and all messages up to the next label.
    fn fault(&mut self, what: String) {
        if let Some(current) = self.current.take() {
            self.starts.pop();
            self.left_out
                .push(format!("pose {} is left out: {what}", current.number()));
        } else {
            self.left_out.push(what);
        }
    }

    /// Ends the current stretch, if there is one, at the position of the next label.
    fn end_stretch(&mut self, end: Option<Position>) -> Result<(), String> {
        let Some(gathering) = self.current.take() else {
            return Ok(());
        };
        let known = Known {
            scanner: self.scanner,
            bodies: &self.bodies,
            epoch: self.epoch.unwrap_or_default(),
        };
        let (number, scans) = (gathering.number(), gathering.scans());
        self.missing += gathering.label.scans.saturating_sub(scans);
        let ended = match self.is_sorted && self.has_damage && gathering.miscounts() {
            // What cannot be read may have been anywhere, and a label among it.
            true => Err("some of its messages cannot be read".to_owned()),
            false => gathering.end(known),
        };
        match ended {
            Ok((kept, notes)) => {
                if let Some(start) = self.starts.last_mut() {
                    start.scans = scans;
                    start.end = end.unwrap_or(start.end);
                }
                self.notes.extend(notes);
                self.finished.push(kept);
                Ok(())
            }
            Err(what) => {
                self.starts.pop();
                if self.partial {
                    self.left_out.push(format!("pose {number} is left out: {what}"));
                    return Ok(());
                }
                Err(what)
            }
        }
    }

    /// Everything that was read.
    fn finish(
        mut self,
        place: &Place,
        blocks: Vec<Block>,
        order: Option<Arc<[Entry]>>,
        stop: &Stop,
    ) -> Result<Played<R>, IoError> {
        if self.unlabeled > 0 {
            let words = format!(
                "{} scans before the first label belong to no stretch",
                self.unlabeled
            );
            self.notes.insert(0, words);
        }
        if self.repeated > 0 {
            let (messages, count) = match self.repeated {
                1 => ("1 message was".to_owned(), "it counts"),
                n => (format!("{n} messages were"), "each counts"),
            };
            self.notes.push(format!(
                "{messages} recorded more than once, byte for byte: {count} once"
            ));
        }
        self.notes.extend(self.codes.words());
        Ok(Played {
            stretches: self.finished,
            source: Source {
                order,
                stretches: self.starts,
                topics: self.topics,
                names: self.names,
                epoch: self.epoch.unwrap_or_default(),
                bodies: self.bodies,
                ..Source::new(place, self.scanner, stop, blocks)
            },
            notes: self.notes,
            left_out: self.left_out,
            missing: self.missing,
        })
    }
}
