//! The order of the messages of a recording: by the times at which they were logged, or by their own stamps where log times
//! jitter; and messages that were recorded more than once.

use super::blocks::Block;
use super::messages;
use super::records;
use super::topics::Topic;
use std::collections::VecDeque;

/// Scans, or frames of one body, among which a repeated one is looked for: recorders that write all twice are not far apart.
const MOST_RECENT: usize = 8;

/// A message of a recording that is not in order.
#[derive(Debug, Clone, Copy)]
pub(super) struct Entry {
    /// When it was logged, in nanoseconds.
    pub(super) time: u64,
    pub(super) is_label: bool,
    pub(super) is_scan: bool,
    /// Its block, and its index there.
    pub(super) block: u32,
    pub(super) number: u32,
}

/// The times of the messages that matter.
#[derive(Default)]
pub(super) struct Index {
    pub(super) entries: Vec<Entry>,
    /// The stamp of each, in nanoseconds; `None` for labels.
    stamps: Vec<Option<u64>>,
    /// Earliest time of any message.
    pub(super) epoch: Option<u64>,
    pub(super) blocks: Vec<Block>,
    /// Length of the recording, in bytes.
    pub(super) length: u64,
}

impl Index {
    /// Adds a message on a topic that is read, given the index of its block and its index there.
    pub(super) fn push(
        &mut self,
        topic: &Topic,
        message: &records::Message<'_>,
        at: (usize, usize),
    ) -> Result<(), String> {
        let number = |n: usize| u32::try_from(n).map_err(|_| "too many messages".to_owned());
        let is_label = matches!(topic, Topic::Label(_));
        self.entries.push(Entry {
            time: message.time,
            is_label,
            is_scan: matches!(topic, Topic::Scan),
            block: number(at.0)?,
            number: number(at.1)?,
        });
        self.stamps.push(match is_label {
            true => None,
            false => messages::decode_stamp(message.data).ok(),
        });
        Ok(())
    }

    /// Ordered by log times; of equal times labels come first.
    pub(super) fn by_log_time(mut self) -> Self {
        self.entries.sort_by_key(|entry| (entry.time, !entry.is_label));
        self
    }

    /// Ordered by stamps that are within a scan period of their log times, and the largest difference in nanoseconds; `None` if
    /// no stamp differs.
    ///
    /// A label has no stamp. It was sent before its first scan, so a scan that began less than half a period before the label
    /// was logged is the label's own.
    pub(super) fn by_stamps(mut self, period_s: f64) -> Option<(Self, u64)> {
        let period = catoptric_model::dataset::nanoseconds(period_s);
        let mut largest = 0;
        for (entry, stamp) in self.entries.iter_mut().zip(&self.stamps) {
            if let Some((stamp, off)) = stamp.map(|stamp| (stamp, stamp.abs_diff(entry.time)))
                && off <= period
            {
                largest = largest.max(off);
                entry.time = stamp;
            }
        }
        if largest == 0 {
            return None;
        }
        let mut scans: Vec<u64> = self
            .entries
            .iter()
            .filter(|e| e.is_scan)
            .map(|e| e.time)
            .collect();
        scans.sort_unstable();
        for label in self.entries.iter_mut().filter(|entry| entry.is_label) {
            let after = scans.partition_point(|time| *time < label.time);
            let before = after.checked_sub(1).map(|last| scans[last]);
            if let Some(time) = before.filter(|time| 2 * (label.time - time) <= period) {
                label.time = time;
            }
        }
        Some((self.by_log_time(), largest))
    }
}

/// The messages that were taken last, by topic.
#[derive(Default)]
pub(super) struct Recent {
    scans: VecDeque<Vec<u8>>,
    echoes: VecDeque<Vec<u8>>,
}

impl Recent {
    /// Whether a message was taken before, byte for byte, its stamp included. Motion capture is gathered by its stamps, where a
    /// repeated message changes nothing.
    pub(super) fn is_repeated(&mut self, topic: &Topic, data: &[u8]) -> bool {
        let last = match topic {
            Topic::Scan => &mut self.scans,
            Topic::Echoes => &mut self.echoes,
            Topic::Label(_) | Topic::Pose(_) | Topic::Markers | Topic::Other => return false,
        };
        if last.iter().any(|before| before == data) {
            return true;
        }
        let mut oldest = match last.len() {
            MOST_RECENT => last.pop_front().unwrap_or_default(),
            _ => Vec::new(),
        };
        oldest.clear();
        oldest.extend_from_slice(data);
        last.push_back(oldest);
        false
    }
}
