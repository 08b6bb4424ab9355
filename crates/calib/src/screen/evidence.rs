//! The stretches of a dataset that show what an element reads, with everything known about what it should read.

use crate::judge::common::CommonErrors;
use crate::mount::pose::Mount;
use crate::readings::observations::BoardInSensor;
use catoptric_model::{Dataset, Pose, PoseRecord, Summary};
use nalgebra::Matrix6;

/// The stretches of a dataset prepared for screening.
pub(super) struct Screen<'a> {
    pub(super) dataset: &'a Dataset,
    pub(super) summaries: &'a [Vec<Summary>],
    /// Covariance of the mounting.
    pub(super) mount: Matrix6<f64>,
    pub(super) common: CommonErrors<'a>,
    pub(super) boards: &'a [Option<BoardInSensor>],
    pub(super) rooms_from_sensor: Vec<Pose>,
}

impl<'a> Screen<'a> {
    /// Prepares the stretches; `boards` holds each pose's board in the sensor frame.
    pub(super) fn new(
        dataset: &'a Dataset,
        summaries: &'a [Vec<Summary>],
        mount: &'a Mount,
        boards: &'a [Option<BoardInSensor>],
    ) -> Self {
        Self {
            dataset,
            summaries,
            mount: mount.uncertainty.total(),
            common: CommonErrors::of(&dataset.session),
            boards,
            rooms_from_sensor: dataset
                .poses
                .iter()
                .map(|p| p.room_from_rig * mount.rig_from_sensor)
                .collect(),
        }
    }

    /// All stretches with the mirrors on and nothing moving, with their statistics.
    pub(super) fn screened(&self) -> impl Iterator<Item = (&'a PoseRecord, &'a Vec<Summary>)> {
        self.dataset
            .poses
            .iter()
            .zip(self.summaries)
            .filter(|(record, _)| record.label.kind.is_evidence())
    }
}
