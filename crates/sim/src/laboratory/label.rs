//! What is noted about a stretch.

use super::setup::Laboratory;
use crate::noise::{Draws, Purpose};
use catoptric_model::{PoseLabel, SpotNote, TestKind, TestNote};

/// Number of neighboring beams whose spot is measured: the paper's triple beam.
const SPOT_BEAMS: usize = 3;

impl Laboratory {
    /// The label that a person writes for a stretch.
    pub(super) fn label(&self, number: usize) -> PoseLabel {
        let planned = &self.planned[number];
        let board = planned.board.as_ref().map(|(board, _)| &self.scene.board[*board]);
        PoseLabel {
            pose: number,
            kind: planned.kind,
            scans: planned.scans,
            board: board.map(|b| b.name.clone()),
            color: board.map(|b| b.color.clone()),
            facet: planned
                .facet
                .map(|f| self.scene.superstructure.facet[f].name.clone()),
            beams: planned.beams,
            test: planned.test.map(|test| TestNote {
                spot: (test.kind == TestKind::Spot)
                    .then(|| self.spot_note(number))
                    .flatten(),
                ..test
            }),
            flight: planned.flight.map(|f| self.scene.flight[f].name.clone()),
        }
    }

    /// The spot of three neighboring beams around a board's center, as a person reads its edges off the board.
    fn spot_note(&self, number: usize) -> Option<SpotNote> {
        let sensor_from_board = self.room_from_sensor().inverse() * self.boards[number]?;
        let spot = self.sensor.spot(&sensor_from_board, SPOT_BEAMS)?;
        let mut draws = Draws::new(self.seed, Purpose::SpotReading, number as u64);
        let sd = self.scene.experiment.spot_sd_mm;
        let mut read = |extent: f64| {
            let misread = sd * (draws.normal() - draws.normal());
            ((extent * 1e3 + misread).max(0.0) * 10.0).round() / 10.0
        };
        Some(SpotNote {
            beams: SPOT_BEAMS,
            width_mm: read(spot[0]),
            height_mm: read(spot[1]),
        })
    }
}
