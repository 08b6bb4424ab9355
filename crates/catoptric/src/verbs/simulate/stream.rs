//! A recording as a stream: excerpts of its stretches, just enough at a time to keep every thread busy.
//!
//! A stretch is opened once, and what its sensor sees while nothing moves is traced then. Random numbers of its
//! excerpts are drawn in parallel, linked in order, and then the excerpts are recorded in parallel and encoded on the
//! same thread.

use super::tables::{ReturnRows, rows_of_readings};
use crate::Error;
use catoptric_files::recording::{Encoded, RecordingEncoder};
use catoptric_model::Pose;
use catoptric_model::Stop;
use catoptric_sim::laboratory::{Drawn, Memory, Returns, Sight};
use catoptric_sim::receive::Return;
use catoptric_sim::{Laboratory, SimError};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Scans per excerpt: about half a megabyte of readings.
const SCANS: usize = 64;

/// Number of excerpts in progress per thread.
const PER_THREAD: usize = 2;

/// A table of the truth that is written row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Table {
    Returns,
    Readings,
    SubRays,
}

/// The excerpts of a recording, in order.
pub(crate) struct Stream<'a> {
    laboratory: &'a Laboratory,
    encoder: &'a RecordingEncoder,
    tables: Vec<Table>,
    stop: &'a Stop,
    /// Stretch and first scan of the next excerpt.
    next: (usize, usize),
    /// The stretch of the last excerpt.
    open: Option<Arc<Open<'a>>>,
    memory: Memory,
}

/// A stretch being recorded.
struct Open<'a> {
    sight: Sight<'a>,
    first_seen: Vec<Option<(f64, Pose)>>,
    /// What is seen, and from which scan on; empty for a flight, in which every scan sees something else.
    seen: Vec<(usize, Returns)>,
    trace: Duration,
}

/// An excerpt, ready to be written.
pub(crate) struct Made<'a> {
    open: Arc<Open<'a>>,
    pub(crate) number: usize,
    pub(crate) scans: Range<usize>,
    pub(crate) encoded: Encoded,
    /// Rows of the requested tables except those of sub-rays.
    pub(crate) texts: Vec<String>,
    /// Legs of the beams that were traced for it.
    pub(crate) segments: usize,
    pub(crate) trace: Duration,
    pub(crate) sample: Duration,
    pub(crate) encode: Duration,
}

impl<'a> Stream<'a> {
    /// Creates the stream of a recording with the rows of some tables.
    pub(crate) fn new(
        laboratory: &'a Laboratory,
        encoder: &'a RecordingEncoder,
        tables: Vec<Table>,
        stop: &'a Stop,
    ) -> Self {
        Self {
            laboratory,
            encoder,
            tables,
            stop,
            next: (0, 0),
            open: None,
            memory: Memory::default(),
        }
    }

    /// Returns the next excerpts, enough to keep a given number of threads busy; none after the last.
    pub(crate) fn next(&mut self, threads: usize) -> Result<Vec<Made<'a>>, Error> {
        let laboratory = self.laboratory;
        let excerpts: Vec<_> = std::iter::from_fn(|| self.step())
            .take(PER_THREAD * threads)
            .collect();
        let begun: Vec<usize> = excerpts
            .iter()
            .filter(|(_, scans)| scans.start == 0)
            .map(|(number, _)| *number)
            .collect();
        let opened: Vec<Arc<Open<'a>>> = begun
            .par_iter()
            .map(|number| Open::of(laboratory, *number).map(Arc::new))
            .collect::<Result<_, SimError>>()?;
        let mut opened = opened.into_iter();
        let mut drawn: Vec<(Drawn, Duration)> = excerpts
            .par_iter()
            .map(|(number, scans)| {
                let begin = Instant::now();
                let drawn = laboratory.draw(*number, scans.clone());
                (drawn, begin.elapsed())
            })
            .collect();
        let mut work = Vec::with_capacity(drawn.len());
        for (drawn, time) in &mut drawn {
            let begin = Instant::now();
            laboratory.link(drawn, &mut self.memory);
            if drawn.scans().start == 0 {
                self.open = opened.next();
            }
            *time += begin.elapsed();
            work.extend(self.open.clone());
        }
        let work: Vec<_> = work.into_iter().zip(drawn).collect();
        let made = work.into_par_iter().map(|(open, (drawn, time))| {
            let mut made = self.make(open, &drawn)?;
            made.sample += time;
            Ok(made)
        });
        made.collect()
    }

    /// Returns stretch and scans of the next excerpt.
    fn step(&mut self) -> Option<(usize, Range<usize>)> {
        let (number, scan) = self.next;
        if number == self.laboratory.stretches() {
            return None;
        }
        let all = self.laboratory.scans_of(number);
        let end = all.min(scan + SCANS);
        self.next = if end == all {
            (number + 1, 0)
        } else {
            (number, end)
        };
        Some((number, scan..end))
    }

    fn make(&self, open: Arc<Open<'a>>, drawn: &Drawn) -> Result<Made<'a>, Error> {
        let (laboratory, number, scans) = (self.laboratory, drawn.number(), drawn.scans());
        let wanted = |table| self.tables.contains(&table);
        let moves = open.sight.moves();
        let (mut trace, mut sample, mut encode, mut segments) = Default::default();
        if scans.start == 0 {
            trace = open.trace;
            segments = open.seen.iter().map(|(_, seen)| segments_of(seen)).sum();
        }
        let mut recorder = laboratory.excerpt_recorder(drawn);
        let mut return_rows = ReturnRows::new(laboratory);
        let (mut returns_text, mut readings_text) = (String::new(), String::new());
        // What a scan of a flight sees is needed only during that scan.
        let mut flown = Returns::new();
        let mut clock = Clock::new();
        for scan in scans.clone() {
            self.stop.check()?;
            let seen = match open.seen.iter().rfind(|(from, _)| *from <= scan) {
                Some((_, seen)) => seen,
                None => {
                    open.sight.look(scan, &mut flown);
                    segments += segments_of(&flown);
                    clock.add(&mut trace);
                    &flown
                }
            };
            let readings = recorder.add(seen, open.sight.changes_at(scan));
            clock.add(&mut sample);
            if wanted(Table::Returns) && (moves || scan == 0) {
                let scan = if moves { scan.to_string() } else { String::new() };
                return_rows.add(number, seen, &scan, &mut returns_text);
            }
            if wanted(Table::Readings) {
                let effects = laboratory.scan_effects(drawn, scan);
                let rows = rows_of_readings(laboratory, (number, scan), seen, &effects, readings);
                readings_text.push_str(&rows);
            }
            clock.add(&mut encode);
        }
        let excerpt = recorder.finish(&open.first_seen);
        clock.add(&mut sample);
        let encoded = self.encoder.encode_excerpt(&excerpt)?;
        let texts = self.tables.iter().filter_map(|table| match table {
            Table::Returns => Some(std::mem::take(&mut returns_text)),
            Table::Readings => Some(std::mem::take(&mut readings_text)),
            Table::SubRays => None,
        });
        let texts = texts.collect();
        clock.add(&mut encode);
        Ok(Made {
            open,
            number,
            scans,
            encoded,
            texts,
            segments,
            trace,
            sample,
            encode,
        })
    }
}

/// A stopwatch that measures the durations of consecutive tasks.
struct Clock(Instant);

impl Clock {
    fn new() -> Self {
        Self(Instant::now())
    }

    /// Adds the time since the last call to `to`.
    fn add(&mut self, to: &mut Duration) {
        let now = Instant::now();
        *to += now - self.0;
        self.0 = now;
    }
}

impl<'a> Open<'a> {
    fn of(laboratory: &'a Laboratory, number: usize) -> Result<Self, SimError> {
        let begin = Instant::now();
        let sight = laboratory.sight(number)?;
        let mut seen = Vec::new();
        if !sight.flies() {
            seen.push((0, sight.returns(0)));
            let scans = 1..laboratory.scans_of(number);
            let changes = scans.filter(|scan| sight.changes_at(*scan));
            seen.extend(changes.map(|scan| (scan, sight.returns(scan))));
        }
        let trace = begin.elapsed();
        Ok(Self {
            first_seen: laboratory.first_seen(number),
            sight,
            seen,
            trace,
        })
    }
}

impl<'a> Made<'a> {
    /// What the sensor sees during the stretch.
    pub(crate) fn sight(&self) -> &Sight<'a> {
        &self.open.sight
    }
}

fn segments_of(returns: &Returns) -> usize {
    let pieces = |r: &Option<Return>| r.as_ref().map_or(1, |r| r.facets.len() + 1);
    returns.iter().map(pieces).sum()
}
