//! What motion capture sees during a stretch.

use super::setup::Laboratory;
use crate::build::board::{board_markers, points};
use crate::build::room::room_from_rig;
use crate::laboratory::mocap::{self, Body};
use catoptric_model::Track;
use catoptric_model::dataset::RIG_SUBJECT;
use std::ops::Range;

impl Laboratory {
    /// Number of motion-capture frames during a stretch.
    pub(super) fn frames_of(&self, number: usize) -> u64 {
        let duration_s = self.planned[number].scans as f64 * self.sensor.scan().scan_period_s();
        // Frame numbers and counts of a recording of hours stay far below 2³².
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let frames = (duration_s * self.scene.mocap.frame_rate_hz).floor() as u64;
        frames.max(1)
    }

    /// Tracks of the rig and of the stretch's board during some of its frames.
    pub(super) fn tracks(&self, number: usize, frames: Range<u64>) -> Vec<Track> {
        let mocap = &self.scene.mocap;
        let start_s = self.start_s(number);
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let first_frame = (start_s * mocap.frame_rate_hz).round() as u64;
        let track =
            |body: &Body<'_>| mocap::track(mocap, self.seed, body, start_s, first_frame, frames.clone());
        let rig = points(&self.scene.superstructure.marker);
        let at_rest = room_from_rig(&self.scene.room);
        let trajectory = self.planned[number].flight.map(|f| &self.trajectories[f]);
        let mut tracks = vec![track(&Body {
            subject: RIG_SUBJECT,
            index: 0,
            template: &rig,
            room_from_body: &|elapsed_s| trajectory.map_or(at_rest, |t| t.room_from_rig(elapsed_s)),
            // The rig rests for the whole experiment, which is one placement, and is picked up for each flight.
            placement: if trajectory.is_some() { number + 1 } else { 0 },
        })];
        if let (Some((board, _)), Some(room_from_board)) = (&self.planned[number].board, &self.boards[number])
        {
            let template = points(&board_markers(&self.scene.board[*board]));
            let movement = self
                .movement(number)
                .map(|m| (self.elapsed_s(m.scan, 0), m.room_from_board));
            let stands = |elapsed_s: f64| match &movement {
                Some((from, there)) if elapsed_s >= *from => *there,
                _ => *room_from_board,
            };
            let mut seen = track(&Body {
                subject: &self.scene.board[*board].name,
                index: board + 1,
                template: &template,
                room_from_body: &stands,
                placement: number + 1,
            });
            self.mislabel(number, &mut seen);
            tracks.push(seen);
        }
        tracks
    }
}
