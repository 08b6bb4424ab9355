//! The readings of a stretch: in memory, or in a recording that is read again whenever they are wanted.
//!
//! What needs no second look at them is in [`BeamStatistics`], gathered scan by scan while they pass.

use crate::summary::{Moments, Summary};
use std::borrow::Cow;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Readings that a recording gave once and gives no more: the file is gone, or not the one it was.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Unreadable(
    /// What happened, with the file.
    pub String,
);

/// The scans of a stretch, one after the other; nothing follows an error.
pub type Scans<'a> = Box<dyn Iterator<Item = Result<Cow<'a, [f64]>, Unreadable>> + Send + 'a>;

/// A recording that stretches are read from, as often as is asked for.
pub trait ScanSource: Send + Sync {
    /// The scans of a stretch, by its number in the order of the recording.
    fn scans(&self, stretch: usize) -> Scans<'_>;
}

/// What a beam read over a stretch, in numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamStatistics {
    /// Readings that are not ranges.
    pub missing: usize,
    /// Those of them that were too close, −∞.
    pub too_close: usize,
    /// The ranges of all scans.
    pub all: Moments,
    /// The ranges of the first half of the scans, and of the second; the middle one of an odd number is in the second.
    pub halves: [Moments; 2],
    /// The least range, in meters; ∞ without any.
    pub least: f64,
    /// The largest range, in meters; −∞ without any.
    pub largest: f64,
}

impl Default for BeamStatistics {
    fn default() -> Self {
        Self {
            missing: 0,
            too_close: 0,
            all: Moments::default(),
            halves: [Moments::default(); 2],
            least: f64::INFINITY,
            largest: f64::NEG_INFINITY,
        }
    }
}

impl BeamStatistics {
    /// Mean and spread of all ranges.
    pub fn summary(&self) -> Summary {
        Summary {
            missing: self.missing,
            ..self.all.summary()
        }
    }
}

/// The statistics of every beam while the scans of a stretch pass by, in their order.
#[derive(Debug, Clone)]
pub struct Gathered {
    beams: Vec<BeamStatistics>,
    /// Scans that have passed.
    scans: usize,
    /// The first scan of the second half.
    half: usize,
}

impl Gathered {
    /// Begins a stretch of so many beams and scans.
    pub fn new(beams: usize, scans: usize) -> Self {
        Self {
            beams: vec![BeamStatistics::default(); beams],
            scans: 0,
            half: scans / 2,
        }
    }

    /// Takes a scan in.
    pub fn add(&mut self, scan: &[f64]) {
        if self.scans == self.half {
            for beam in &mut self.beams {
                beam.halves[0] = beam.all;
            }
        }
        let is_second = self.scans >= self.half;
        for (beam, r) in self.beams.iter_mut().zip(scan) {
            if r.is_finite() {
                beam.all.add(*r);
                if is_second {
                    beam.halves[1].add(*r);
                }
                beam.least = beam.least.min(*r);
                beam.largest = beam.largest.max(*r);
            } else {
                beam.missing += 1;
                beam.too_close += usize::from(*r == f64::NEG_INFINITY);
            }
        }
        self.scans += 1;
    }

    /// The statistics of every beam.
    pub fn finish(self) -> Vec<BeamStatistics> {
        self.beams
    }
}

/// The readings of a stretch in meters; −∞ too close, +∞ no return, NaN invalid (REP-117).
///
/// Two are equal if they hold equal readings; of recordings, which are not read for that, if their statistics are.
#[derive(Clone)]
pub struct Readings {
    beams: usize,
    place: Place,
    /// Gathered when they are first asked for.
    statistics: OnceLock<Arc<[BeamStatistics]>>,
}

#[derive(Clone)]
enum Place {
    /// In memory, scan after scan.
    Memory(Vec<f64>),
    /// In a recording: which, the number of the stretch, and its scans.
    Recording(Arc<dyn ScanSource>, usize, usize),
    /// Nowhere: of so many scans every reading is invalid.
    Nowhere(usize),
}

impl Readings {
    /// Readings in memory, scan after scan.
    pub fn in_memory(beams: usize, ranges: Vec<f64>) -> Self {
        Self {
            beams,
            place: Place::Memory(ranges),
            statistics: OnceLock::new(),
        }
    }

    /// Readings in a recording, by the number of their stretch, with the statistics that reading them once gave.
    pub fn recorded(
        source: Arc<dyn ScanSource>,
        stretch: usize,
        scans: usize,
        statistics: Vec<BeamStatistics>,
    ) -> Self {
        Self {
            beams: statistics.len(),
            place: Place::Recording(source, stretch, scans),
            statistics: OnceLock::from(Arc::from(statistics)),
        }
    }

    /// As many readings, all of them invalid.
    pub fn left_out(&self) -> Self {
        Self {
            beams: self.beams,
            place: Place::Nowhere(self.len() / self.beams.max(1)),
            statistics: OnceLock::new(),
        }
    }

    /// Beams of a scan.
    pub fn beams(&self) -> usize {
        self.beams
    }

    /// Number of the readings.
    pub fn len(&self) -> usize {
        match &self.place {
            Place::Memory(ranges) => ranges.len(),
            Place::Recording(_, _, scans) | Place::Nowhere(scans) => scans * self.beams,
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The readings, if they are in memory, scan after scan.
    pub fn held(&self) -> Option<&[f64]> {
        match &self.place {
            Place::Memory(ranges) => Some(ranges),
            Place::Recording(..) | Place::Nowhere(_) => None,
        }
    }

    /// The same, to be changed.
    pub fn held_mut(&mut self) -> Option<&mut Vec<f64>> {
        self.statistics.take();
        match &mut self.place {
            Place::Memory(ranges) => Some(ranges),
            Place::Recording(..) | Place::Nowhere(_) => None,
        }
    }

    /// The scans, one after the other.
    pub fn scans(&self) -> Scans<'_> {
        match &self.place {
            Place::Memory(ranges) => {
                let scans = ranges.chunks(self.beams.max(1));
                Box::new(scans.map(|scan| Ok(Cow::Borrowed(scan))))
            }
            Place::Recording(source, stretch, _) => source.scans(*stretch),
            Place::Nowhere(scans) => {
                let none = vec![f64::NAN; self.beams];
                Box::new((0..*scans).map(move |_| Ok(Cow::Owned(none.clone()))))
            }
        }
    }

    /// The statistics of every beam.
    pub fn statistics(&self) -> &[BeamStatistics] {
        self.statistics.get_or_init(|| {
            let scans = self.len() / self.beams.max(1);
            let mut gathered = Gathered::new(self.beams, scans);
            match &self.place {
                Place::Memory(ranges) => ranges
                    .chunks(self.beams.max(1))
                    .for_each(|scan| gathered.add(scan)),
                Place::Nowhere(_) => gathered.beams.iter_mut().for_each(|b| b.missing = scans),
                Place::Recording(..) => unreachable!("a recording's were gathered when it was read"),
            }
            gathered.finish().into()
        })
    }
}

impl PartialEq for Readings {
    fn eq(&self, other: &Self) -> bool {
        match (&self.place, &other.place) {
            (Place::Memory(a), Place::Memory(b)) => self.beams == other.beams && a == b,
            _ => self.len() == other.len() && self.statistics() == other.statistics(),
        }
    }
}

impl fmt::Debug for Readings {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut shown = f.debug_struct("Readings");
        shown.field("beams", &self.beams).field("len", &self.len());
        match &self.place {
            Place::Memory(ranges) => shown.field("ranges", ranges).finish(),
            Place::Recording(..) | Place::Nowhere(_) => {
                shown.field("statistics", &self.statistics()).finish()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statistics_leave_codes_out_and_part_the_scans_in_two() {
        let scans = vec![1.0, f64::INFINITY, 2.0, f64::NEG_INFINITY, 3.0, 5.0];
        let mut readings = Readings::in_memory(2, scans);
        let [first, second] = readings.statistics() else {
            panic!("there are two beams");
        };
        assert_eq!((first.missing, first.least, first.largest), (0, 1.0, 3.0));
        assert_eq!(first.halves.map(|h| (h.count, h.mean)), [(1, 1.0), (2, 2.5)]);
        assert_eq!((second.missing, second.too_close), (2, 1));
        assert_eq!(second.halves.map(|h| h.count), [0, 1]);
        // What was gathered does not outlive a change of the readings.
        readings.held_mut().expect("they are in memory")[1] = 4.0;
        assert_eq!(readings.statistics()[1].missing, 1);
    }

    #[test]
    fn readings_that_are_left_out_are_invalid() {
        let none = Readings::in_memory(2, vec![1.0; 6]).left_out();
        assert_eq!((none.len(), none.statistics()[1].missing), (6, 3));
        let scans: Vec<_> = none.scans().map(|s| s.expect("nothing is read")).collect();
        assert_eq!(scans.len(), 3);
        assert!(scans.iter().all(|s| s.len() == 2 && s.iter().all(|r| r.is_nan())));
    }
}
