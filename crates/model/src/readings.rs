//! The readings of a stretch: in memory, or in a recording that is read again on demand.
//!
//! Statistics that need only one pass over the readings are in [`BeamStatistics`], accumulated scan by scan.

use crate::summary::{Moments, Summary};
use std::borrow::Cow;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Readings of a recording that can no longer be read: the file is gone or has changed.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Unreadable(
    /// The error, including the file.
    pub String,
);

/// The scans of a stretch in order; the iteration ends after an error.
pub type Scans<'a> = Box<dyn Iterator<Item = Result<Cow<'a, [f64]>, Unreadable>> + Send + 'a>;

/// A recording from which stretches can be read repeatedly.
pub trait ScanSource: Send + Sync {
    /// The scans of a stretch, given its index in the recording.
    fn scans(&self, stretch: usize) -> Scans<'_>;
}

/// Statistics of one beam over a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BeamStatistics {
    /// Number of readings that are not ranges.
    pub missing: usize,
    /// Number of those that were too close, −∞.
    pub too_close: usize,
    /// The ranges of all scans.
    pub all: Moments,
    /// The ranges of the first and of the second half of the scans; with an odd number, the middle scan is in the
    /// second.
    pub halves: [Moments; 2],
    /// The smallest range, in meters; ∞ without any.
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

/// The statistics of every beam, accumulated scan by scan, in order.
#[derive(Debug, Clone)]
pub struct Gathered {
    beams: Vec<BeamStatistics>,
    /// Number of scans added.
    scans: usize,
    /// Index of the first scan of the second half.
    half: usize,
}

impl Gathered {
    /// Begins a stretch with a given number of beams and scans.
    pub fn new(beams: usize, scans: usize) -> Self {
        Self {
            beams: vec![BeamStatistics::default(); beams],
            scans: 0,
            half: scans / 2,
        }
    }

    /// Adds a scan.
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

/// Intensities of every beam, accumulated scan by scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Intensities {
    beams: Vec<Moments>,
}

impl Intensities {
    /// Begins a stretch with a given number of beams.
    pub fn new(beams: usize) -> Self {
        Self {
            beams: vec![Moments::default(); beams],
        }
    }

    /// Adds a scan: the intensities, in counts, of those of its readings that are ranges.
    pub fn add(&mut self, ranges: &[f64], counts: &[f64]) {
        for ((beam, range), count) in self.beams.iter_mut().zip(ranges).zip(counts) {
            if range.is_finite() && count.is_finite() {
                beam.add(*count);
            }
        }
    }

    /// Mean intensity of a beam's ranges, in counts; `None` without any.
    pub fn mean(&self, beam: usize) -> Option<f64> {
        self.beams.get(beam).filter(|b| b.count > 0).map(|b| b.mean)
    }
}

/// The readings of a stretch in meters; −∞ too close, +∞ no return, NaN invalid (REP-117).
///
/// Readings in memory are compared individually; readings in recordings, by their statistics.
#[derive(Clone)]
pub struct Readings {
    beams: usize,
    place: Place,
    /// Computed on first use.
    statistics: OnceLock<Arc<[BeamStatistics]>>,
    intensities: Option<Arc<Intensities>>,
}

#[derive(Clone)]
enum Place {
    /// In memory, scan by scan.
    Memory(Vec<f64>),
    /// In a recording, with the index of the stretch and the number of its scans.
    Recording(Arc<dyn ScanSource>, usize, usize),
    /// Not available: every reading of the given number of scans is invalid.
    Nowhere(usize),
}

impl Readings {
    /// Readings in memory, scan by scan.
    pub fn in_memory(beams: usize, ranges: Vec<f64>) -> Self {
        Self {
            beams,
            place: Place::Memory(ranges),
            statistics: OnceLock::new(),
            intensities: None,
        }
    }

    /// Readings in a recording, given the index of their stretch and the statistics from the first pass over them.
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
            intensities: None,
        }
    }

    /// The same number of readings, all invalid.
    pub fn left_out(&self) -> Self {
        Self {
            beams: self.beams,
            place: Place::Nowhere(self.len() / self.beams.max(1)),
            statistics: OnceLock::new(),
            intensities: None,
        }
    }

    /// The same with the intensities that were recorded with them, if they were.
    #[must_use]
    pub fn with_intensities(mut self, intensities: Option<Intensities>) -> Self {
        self.intensities = intensities.map(Arc::new);
        self
    }

    /// Mean intensity of a beam's ranges, in counts of the receiver; `None` if there are no ranges or no intensities.
    pub fn intensity(&self, beam: usize) -> Option<f64> {
        self.intensities.as_ref()?.mean(beam)
    }

    /// Beams of a scan.
    pub fn beams(&self) -> usize {
        self.beams
    }

    /// Number of readings.
    pub fn len(&self) -> usize {
        match &self.place {
            Place::Memory(ranges) => ranges.len(),
            Place::Recording(_, _, scans) | Place::Nowhere(scans) => scans * self.beams,
        }
    }

    /// Whether there are no readings.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The readings scan by scan, if they are in memory.
    pub fn held(&self) -> Option<&[f64]> {
        match &self.place {
            Place::Memory(ranges) => Some(ranges),
            Place::Recording(..) | Place::Nowhere(_) => None,
        }
    }

    /// The same, mutable.
    pub fn held_mut(&mut self) -> Option<&mut Vec<f64>> {
        self.statistics.take();
        match &mut self.place {
            Place::Memory(ranges) => Some(ranges),
            Place::Recording(..) | Place::Nowhere(_) => None,
        }
    }

    /// The scans in order.
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
                Place::Recording(..) => {
                    unreachable!("a recording's statistics were computed when it was read")
                }
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
        shown.field("intensities", &self.intensities);
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
    fn statistics_omit_codes_and_split_the_scans_in_half() {
        let scans = vec![1.0, f64::INFINITY, 2.0, f64::NEG_INFINITY, 3.0, 5.0];
        let mut readings = Readings::in_memory(2, scans);
        let [first, second] = readings.statistics() else {
            panic!("there are two beams");
        };
        assert_eq!((first.missing, first.least, first.largest), (0, 1.0, 3.0));
        assert_eq!(first.halves.map(|h| (h.count, h.mean)), [(1, 1.0), (2, 2.5)]);
        assert_eq!((second.missing, second.too_close), (2, 1));
        assert_eq!(second.halves.map(|h| h.count), [0, 1]);
        // Changing the readings discards the cached statistics.
        readings.held_mut().expect("they are in memory")[1] = 4.0;
        assert_eq!(readings.statistics()[1].missing, 1);
    }

    #[test]
    fn intensities_are_means_over_ranges() {
        let mut all = Intensities::new(2);
        all.add(&[1.0, f64::INFINITY], &[100.0, 0.0]);
        all.add(&[1.0, 2.0], &[300.0, 50.0]);
        all.add(&[f64::NAN, 2.0], &[0.0, f64::NAN]);
        assert_eq!(
            (all.mean(0), all.mean(1), all.mean(2)),
            (Some(200.0), Some(50.0), None)
        );
        let readings = Readings::in_memory(2, vec![1.0; 6]);
        assert_eq!(readings.intensity(0), None);
        let readings = readings.with_intensities(Some(all));
        assert_eq!(readings.intensity(1), Some(50.0));
        // What is left out has no intensity either.
        assert_eq!(readings.left_out().intensity(0), None);
    }

    #[test]
    fn omitted_readings_are_invalid() {
        let none = Readings::in_memory(2, vec![1.0; 6]).left_out();
        assert_eq!((none.len(), none.statistics()[1].missing), (6, 3));
        let scans: Vec<_> = none.scans().map(|s| s.expect("nothing is read")).collect();
        assert_eq!(scans.len(), 3);
        assert!(scans.iter().all(|s| s.len() == 2 && s.iter().all(|r| r.is_nan())));
    }
}
