//! Repeated reading of a recording, stretch by stretch, whenever its readings are needed.

use super::blocks::{Block, Place, Records};
use super::bodies::Bodies;
use super::capture::Capture;
use super::error::IoError;
use super::messages;
use super::playback::Topic;
use super::survey::MOST_WAITING;
use catoptric_model::{ScanSource, Scans, Stop, TrackedFrame, Unreadable};
use mcap::records::Record;
use std::borrow::Cow;
use std::collections::{BTreeMap, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

/// Size of the blocks kept for the next stretch, which is often in the same block, in bytes.
const MOST_KEPT: usize = 1 << 24;

/// Location of a stretch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// Block and index of its label's message.
    pub(super) label: (usize, usize),
    /// Its scans.
    pub(super) scans: usize,
}

/// A recording with the index of its contents.
pub(super) struct Source {
    pub(super) place: Place,
    /// Looked at before each block.
    pub(super) stop: Stop,
    pub(super) blocks: Vec<Block>,
    pub(super) stretches: Vec<Start>,
    pub(super) topics: BTreeMap<u16, Topic>,
    pub(super) bodies: Bodies,
    /// Time of the first message, in nanoseconds.
    pub(super) epoch: u64,
    pub(super) kept: Mutex<VecDeque<(usize, Arc<Records>)>>,
}

/// The messages of a stretch, in order.
struct Messages<'a> {
    source: &'a Source,
    block: usize,
    /// Index in its block of the next message.
    next: usize,
    records: Option<Arc<Records>>,
}

/// The scans of a stretch.
struct ScansOf<'a> {
    messages: Messages<'a>,
    left: usize,
}

impl Source {
    /// Visits the frames of some bodies in a stretch, in order of time.
    pub(super) fn frames(
        &self,
        stretch: usize,
        of: &[usize],
        mut each: impl FnMut(usize, TrackedFrame),
    ) -> Result<(), IoError> {
        let mut capture = Capture::default();
        let mut messages = self.messages(stretch);
        let at = self.blocks[self.stretches[stretch].label.0].at();
        let changed = || self.place.changed(at);
        while let Some((topic, message)) = messages.next()? {
            match topic {
                Topic::Pose(body) => {
                    let (time, pose) = messages::decode_pose(message).map_err(|_| changed())?;
                    capture.pose(time, *body, pose).map_err(|_| changed())?;
                }
                Topic::Markers => {
                    let (time, markers) = messages::decode_markers(message).map_err(|_| changed())?;
                    let taken = capture.markers(time, &markers, &self.bodies);
                    taken.map_err(|_| changed())?;
                }
                Topic::Label | Topic::Scan | Topic::Echoes | Topic::Other => {}
            }
            if capture.waiting() > MOST_WAITING {
                capture.take(MOST_WAITING / 2, &self.bodies, of, self.epoch, &mut each);
            }
        }
        capture.take(0, &self.bodies, of, self.epoch, &mut each);
        Ok(())
    }

    fn messages(&self, stretch: usize) -> Messages<'_> {
        let (block, label) = self.stretches[stretch].label;
        Messages {
            source: self,
            block,
            next: label + 1,
            records: None,
        }
    }

    fn records(&self, block: usize) -> Result<Arc<Records>, IoError> {
        self.stop.check()?;
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, records)) = kept().iter().find(|(b, _)| *b == block) {
            return Ok(Arc::clone(records));
        }
        let records = Arc::new(self.place.records(&self.blocks[block])?);
        let mut kept = kept();
        kept.push_back((block, Arc::clone(&records)));
        let mut size: usize = kept.iter().map(|(_, records)| records.size()).sum();
        while size > MOST_KEPT {
            size -= kept.pop_front().map_or(size, |(_, oldest)| oldest.size());
        }
        Ok(records)
    }
}

impl Messages<'_> {
    /// The next message and its kind; `None` after the last of the stretch.
    fn next(&mut self) -> Result<Option<(&Topic, &[u8])>, IoError> {
        let (topic, number, length) = loop {
            if self.block >= self.source.blocks.len() {
                return Ok(None);
            }
            let records = match &self.records {
                Some(records) => records,
                None => self.records.insert(self.source.records(self.block)?),
            };
            let Some((opcode, record)) = records.get(self.next) else {
                (self.block, self.next, self.records) = (self.block + 1, 0, None);
                continue;
            };
            self.next += 1;
            let Ok(Record::Message { header, data }) = mcap::parse_record(opcode, record) else {
                continue;
            };
            match self.source.topics.get(&header.channel_id) {
                Some(Topic::Label) => {
                    self.block = self.source.blocks.len();
                    return Ok(None);
                }
                Some(topic) => break (topic, self.next - 1, data.len()),
                None => {}
            }
        };
        let record = self.records.as_ref().and_then(|r| r.get(number));
        Ok(record.map(|(_, record)| (topic, &record[record.len() - length..])))
    }
}

impl ScansOf<'_> {
    fn read(&mut self) -> Result<Vec<f64>, IoError> {
        let source = self.messages.source;
        while let Some((topic, message)) = self.messages.next()? {
            if let Topic::Scan = topic {
                let scan = messages::decode_scan(message);
                let scan = scan.map_err(|_| source.place.changed(0))?;
                return Ok(scan.ranges);
            }
        }
        Err(source.place.changed(0))
    }
}

impl<'a> Iterator for ScansOf<'a> {
    type Item = Result<Cow<'a, [f64]>, Unreadable>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        let scan = self.read();
        if scan.is_err() {
            self.left = 0;
        }
        Some(scan.map(Cow::Owned).map_err(|e| Unreadable(e.to_string())))
    }
}

impl ScanSource for Source {
    fn scans(&self, stretch: usize) -> Scans<'_> {
        Box::new(ScansOf {
            messages: self.messages(stretch),
            left: self.stretches[stretch].scans,
        })
    }
}
