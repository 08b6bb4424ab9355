//! Repeated reading of a recording, stretch by stretch, whenever its readings are needed.

use super::blocks::{Block, Place, Records};
use super::bodies::Bodies;
use super::capture::{Capture, MOST_WAITING};
use super::codes::{Codes, Limits};
use super::error::IoError;
use super::messages;
use super::order::{Entry, Recent};
use super::records;
use super::topics::Topic;
use catoptric_model::session::ScannerSheet;
use catoptric_model::{ScanSource, Scans, Stop, TrackedFrame, Unreadable};
use mcap::records::op;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::{Arc, Mutex, PoisonError};

/// Size of the blocks kept for the next stretch, which is often in the same block, in bytes.
const MOST_KEPT: usize = 1 << 24;

/// Location of a stretch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Start {
    /// Its label.
    pub(super) label: Position,
    /// The first message beyond it.
    pub(super) end: Position,
    /// Its scans.
    pub(super) scans: usize,
}

/// A recording with the index of its contents.
pub(super) struct Source {
    pub(super) place: Place,
    /// Looked at before each block.
    pub(super) stop: Stop,
    pub(super) blocks: Vec<Block>,
    /// The messages in the order of their times, if that is not their order in the recording.
    pub(super) order: Option<Arc<[Entry]>>,
    pub(super) stretches: Vec<Start>,
    pub(super) topics: BTreeMap<u16, Topic>,
    /// Names of all topics.
    pub(super) names: BTreeSet<String>,
    pub(super) scanner: ScannerSheet,
    pub(super) bodies: Bodies,
    /// Time of the first message, in nanoseconds.
    pub(super) epoch: u64,
    pub(super) kept: Mutex<VecDeque<(usize, Arc<Records>)>>,
}

/// A position among the messages: a block and an index in it; 0 and the index among all if they are sorted.
pub(super) type Position = (usize, usize);

/// The messages of a stretch, in order.
struct Messages<'a> {
    source: &'a Source,
    next: Position,
    /// The first beyond the stretch.
    end: Position,
    /// The block that was read last.
    records: Option<(usize, Arc<Records>)>,
}

/// The scans of a stretch.
struct ScansOf<'a> {
    messages: Messages<'a>,
    recent: Recent,
    left: usize,
}

impl Source {
    /// The blocks of a recording, of which nothing else is known yet.
    pub(super) fn new(place: &Place, scanner: &ScannerSheet, stop: &Stop, blocks: Vec<Block>) -> Self {
        Self {
            place: place.clone(),
            stop: stop.clone(),
            blocks,
            order: None,
            stretches: Vec::new(),
            topics: BTreeMap::new(),
            names: BTreeSet::new(),
            scanner: scanner.clone(),
            bodies: Bodies::default(),
            epoch: 0,
            kept: Mutex::default(),
        }
    }

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
                Topic::Label(_) | Topic::Scan | Topic::Echoes | Topic::Other => {}
            }
            if capture.waiting() > MOST_WAITING {
                capture.take(MOST_WAITING / 2, &self.bodies, of, self.epoch, &mut each);
            }
        }
        capture.take(0, &self.bodies, of, self.epoch, &mut each);
        Ok(())
    }

    fn messages(&self, stretch: usize) -> Messages<'_> {
        let Start { label, end, .. } = self.stretches[stretch];
        Messages {
            source: self,
            next: (label.0, label.1 + 1),
            end,
            records: None,
        }
    }

    pub(super) fn records(&self, block: usize) -> Result<Arc<Records>, IoError> {
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
            if self.next >= self.end {
                return Ok(None);
            }
            let (block, number) = match &self.source.order {
                None => self.next,
                Some(order) => match order.get(self.next.1) {
                    Some(entry) => (entry.block as usize, entry.number as usize),
                    None => return Ok(None),
                },
            };
            if block >= self.source.blocks.len() {
                return Ok(None);
            }
            if self.records.as_ref().is_none_or(|(last, _)| *last != block) {
                self.records = Some((block, self.source.records(block)?));
            }
            let records = self.records.as_ref().map(|(_, records)| records);
            let Some((opcode, record)) = records.and_then(|records| records.get(number)) else {
                self.next = (self.next.0 + 1, 0);
                continue;
            };
            self.next.1 += 1;
            let Some(message) = (opcode == op::MESSAGE)
                .then(|| records::message(record))
                .flatten()
            else {
                continue;
            };
            if let Some(topic) = self.source.topics.get(&message.channel) {
                break (topic, number, message.data.len());
            }
        };
        let record = self.records.as_ref().and_then(|(_, records)| records.get(number));
        Ok(record.map(|(_, record)| (topic, &record[record.len() - length..])))
    }
}

impl ScansOf<'_> {
    fn read(&mut self) -> Result<Vec<f64>, IoError> {
        let source = self.messages.source;
        while let Some((topic, message)) = self.messages.next()? {
            if let Topic::Scan = topic {
                if self.recent.is_repeated(topic, message) {
                    continue;
                }
                let scan = messages::decode_scan(message);
                let mut scan = scan.map_err(|_| source.place.changed(0))?;
                let limits = Limits::of(&source.scanner, scan.limits_m);
                let limits = limits.map_err(|_| source.place.changed(0))?;
                Codes::default().replace(&mut scan.ranges, limits);
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
            recent: Recent::default(),
            left: self.stretches[stretch].scans,
        })
    }
}
