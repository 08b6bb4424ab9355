//! Records stretches, and the whole experiment as a dataset in memory.

use super::setup::Laboratory;
use super::sight::Returns;
use crate::error::SimError;
use catoptric_model::dataset::RIG_SUBJECT;
use catoptric_model::{Dataset, PoseRecord, Stop, Stretch};
use rayon::prelude::*;

impl Laboratory {
    /// What every beam receives during a stretch, traced once since nothing moves; for a flight, during its first scan.
    ///
    /// # Errors
    /// An unknown color.
    pub fn returns(&self, number: usize) -> Result<Returns, SimError> {
        Ok(self.sight(number)?.returns(0))
    }

    /// Records a stretch.
    ///
    /// # Errors
    /// An unknown color.
    pub fn stretch(&self, number: usize) -> Result<Stretch, SimError> {
        let sight = self.sight(number)?;
        let mut returns = sight.returns(0);
        let mut recorder = self.recorder(number);
        for scan in 0..self.scans_of(number) {
            if sight.changes_at(scan) {
                returns = sight.returns(scan);
            }
            recorder.add(&returns);
        }
        Ok(recorder.finish())
    }

    /// Records a stretch in which nothing moves, given its [`Laboratory::returns`].
    pub fn record(&self, number: usize, returns: &Returns) -> Stretch {
        let mut recorder = self.recorder(number);
        for _ in 0..self.scans_of(number) {
            recorder.add(returns);
        }
        recorder.finish()
    }

    /// Everything a calibration needs of a stretch.
    ///
    /// # Errors
    /// As for [`Laboratory::stretch`], and [`SimError::Markers`] if motion capture never saw the rig during it, which
    /// takes a dropout of nearly 1.
    pub fn pose_record(&self, number: usize) -> Result<PoseRecord, SimError> {
        let record = self.stretch(number)?.into_record();
        record.map_err(|_| SimError::Markers {
            body: RIG_SUBJECT.to_owned(),
        })
    }

    /// The whole experiment in memory.
    ///
    /// # Errors
    /// As for [`Laboratory::pose_record`].
    pub fn dataset(&self) -> Result<Dataset, SimError> {
        self.dataset_until(&Stop::default())
    }

    /// As [`Laboratory::dataset`], but can be stopped before it ends.
    ///
    /// # Errors
    /// As for [`Laboratory::pose_record`], and [`SimError::Stopped`].
    pub fn dataset_until(&self, stop: &Stop) -> Result<Dataset, SimError> {
        let numbers = (0..self.stretches()).into_par_iter();
        let record = |number| {
            stop.check()?;
            self.pose_record(number)
        };
        let poses = numbers.map(record).collect::<Result<_, _>>()?;
        Ok(Dataset {
            session: self.session()?,
            poses,
            id: None,
            warnings: Vec::new(),
        })
    }
}
