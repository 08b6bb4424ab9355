//! Readings beam by beam, for what needs their median or their order.
//!
//! A recording holds them scan by scan. As many beams are gathered at a time as fit into a fixed amount of memory, and a long stretch is
//! read several times instead of being held.

use catoptric_model::{Dataset, PoseRecord, Unreadable};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Readings that are held at a time, over all threads, in bytes.
pub(crate) const MOST_BYTES: usize = 1 << 26;

/// Beams of a stretch whose readings are wanted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Wanted {
    /// Index of the stretch.
    pub(crate) pose: usize,
    pub(crate) beams: Vec<usize>,
}

/// The readings of some beams of some stretches.
#[derive(Debug, Default)]
pub(crate) struct Columns(BTreeMap<(usize, usize), Vec<f64>>);

impl Columns {
    /// Reads every stretch that something is wanted of, once.
    pub(crate) fn read(dataset: &Dataset, wanted: &[Wanted]) -> Result<Self, Unreadable> {
        let of_one = |wanted: &Wanted| {
            let columns = columns(&dataset.poses[wanted.pose], &wanted.beams)?;
            let places = wanted.beams.iter().map(|beam| (wanted.pose, *beam));
            Ok(places.zip(columns).collect::<Vec<_>>())
        };
        let found: Vec<Vec<_>> = wanted.par_iter().map(of_one).collect::<Result<_, _>>()?;
        Ok(Self(found.into_iter().flatten().collect()))
    }

    /// The readings of a beam in a stretch, scan after scan; none if they were not wanted.
    pub(crate) fn of(&self, pose: usize, beam: usize) -> &[f64] {
        self.0.get(&(pose, beam)).map_or(&[], Vec::as_slice)
    }
}

/// Returns what `make` makes of the readings of every wanted beam, with its stretch and its number, in order of both. At most
/// `most_bytes` of readings are in memory at a time.
pub(crate) fn of_each<T: Send>(
    dataset: &Dataset,
    wanted: Vec<Wanted>,
    most_bytes: usize,
    make: impl Fn(&[f64]) -> T + Sync,
) -> Result<Vec<(usize, usize, T)>, Unreadable> {
    let mut made = Vec::new();
    for batch in batches(dataset, wanted, most_bytes) {
        let of_one = |wanted: &Wanted| {
            let columns = columns(&dataset.poses[wanted.pose], &wanted.beams)?;
            let beams = wanted.beams.par_iter().zip(&columns);
            Ok(beams
                .map(|(beam, column)| (wanted.pose, *beam, make(column)))
                .collect::<Vec<_>>())
        };
        let of_batch: Vec<Vec<_>> = batch.par_iter().map(of_one).collect::<Result<_, _>>()?;
        made.extend(of_batch.into_iter().flatten());
    }
    Ok(made)
}

/// Bytes that a beam's readings of a stretch take.
pub(crate) fn bytes(record: &PoseRecord) -> usize {
    record.readings.len() / record.beams().max(1) * size_of::<f64>()
}

/// What is wanted, parted into pieces that are read together.
fn batches(dataset: &Dataset, wanted: Vec<Wanted>, most_bytes: usize) -> Vec<Vec<Wanted>> {
    let mut batches = vec![Vec::new()];
    let mut held = 0;
    for Wanted { pose, beams } in wanted {
        let of_beam = bytes(&dataset.poses[pose]).max(1);
        for some in beams.chunks((most_bytes / of_beam).max(1)) {
            let size = some.len() * of_beam;
            if held + size > most_bytes && held > 0 {
                batches.push(Vec::new());
                held = 0;
            }
            held += size;
            let beams = some.to_vec();
            batches
                .last_mut()
                .expect("there is one")
                .push(Wanted { pose, beams });
        }
    }
    batches
}

/// The readings of some beams of a stretch, beam after beam.
fn columns(record: &PoseRecord, beams: &[usize]) -> Result<Vec<Vec<f64>>, Unreadable> {
    let scans = record.readings.len() / record.beams().max(1);
    let mut columns = vec![Vec::with_capacity(scans); beams.len()];
    for scan in record.scans() {
        let scan = scan?;
        for (column, beam) in columns.iter_mut().zip(beams) {
            column.extend(scan.get(*beam));
        }
    }
    Ok(columns)
}
