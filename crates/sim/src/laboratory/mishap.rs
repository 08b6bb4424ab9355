//! Mishaps: a board that moves while it is scanned, labels on the wrong markers.

use super::setup::Laboratory;
use crate::build::board::{board_markers, points};
use crate::error::SimError;
use crate::scene::{Board, Mishap};
use catoptric_model::tracking::solve_pose;
use catoptric_model::{Pose, Track};
use nalgebra::{Translation3, UnitQuaternion, Vector3};

/// Where a board moves to, and when.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Movement {
    /// First scan that sees the board there.
    pub(super) scan: usize,
    /// `room_from_board` from then on.
    pub(super) room_from_board: Pose,
}

impl Laboratory {
    /// The mishap of a stretch, if there is one.
    pub(super) fn mishap(&self, number: usize) -> Option<&Mishap> {
        let mut mishaps = self.scene.experiment.mishap.iter();
        mishaps.find(|m| m.pose as usize == number)
    }

    /// The movement of a stretch's board, if it moves.
    pub(super) fn movement(&self, number: usize) -> Option<Movement> {
        let mishap = self.mishap(number).filter(|m| m.moves())?;
        let shift = Vector3::from(mishap.moved_mm.unwrap_or_default()) * 1e-3;
        let turn = Vector3::from(mishap.moved_deg.unwrap_or_default()).map(f64::to_radians);
        let step = Pose::from_parts(Translation3::from(shift), UnitQuaternion::from_scaled_axis(turn));
        Some(Movement {
            scan: self.planned[number].scans / 2,
            room_from_board: self.boards[number]? * step,
        })
    }

    /// Applies the stretch's mislabeling to its markers and solves the poses again.
    pub(super) fn mislabel(&self, number: usize, track: &mut Track) {
        let (Some(mishap), Some(board)) = (self.mishap(number), self.board_of(number)) else {
            return;
        };
        let markers = board_markers(board);
        let place = |name: &str| markers.iter().position(|m| m.name == name);
        let swapped = mishap.swapped_markers.as_ref();
        let swapped = swapped.and_then(|[a, b]| Some((place(a)?, place(b)?)));
        let astray = mishap.mislabelled.as_ref();
        let astray = astray.and_then(|m| Some((place(&m.marker)?, Vector3::from(m.off_mm) * 1e-3)));
        if swapped.is_none() && astray.is_none() {
            return;
        }
        let template = points(&markers);
        for frame in &mut track.frames {
            if let Some((a, b)) = swapped {
                frame.markers.swap(a, b);
            }
            if let (Some((marker, off)), Some(room_from_board)) = (astray, &self.boards[number])
                && let Some(place) = &mut frame.markers[marker]
            {
                *place += room_from_board.rotation * off;
            }
            frame.pose = solve_pose(&template, &frame.markers);
        }
    }

    /// The board of a stretch.
    pub(super) fn board_of(&self, number: usize) -> Option<&Board> {
        let (board, _) = self.planned[number].board.as_ref()?;
        Some(&self.scene.board[*board])
    }

    /// Checks that every mishap has its pose, board and markers.
    pub(super) fn check_mishaps(&self) -> Result<(), SimError> {
        for mishap in &self.scene.experiment.mishap {
            let number = mishap.pose as usize;
            let fail = |what: String| Err(SimError::Mishap { pose: number, what });
            if number >= self.planned.len() {
                return fail(format!("the recording has poses 0 to {}", self.planned.len() - 1));
            }
            let Some(board) = self.board_of(number) else {
                let with_board = |n: &usize| self.planned[*n].board.is_some();
                let first = (0..self.planned.len()).find(with_board);
                return fail(match first {
                    Some(first) => format!("no board is set up in it; pose {first} is the first with one"),
                    None => "no pose has a board".to_owned(),
                });
            };
            if mishap.moves() && self.planned[number].scans < 2 {
                return fail("nothing can move halfway through a single scan".to_owned());
            }
            let markers = board_markers(board);
            let swapped = mishap.swapped_markers.iter().flatten();
            let astray = mishap.mislabelled.iter().map(|m| &m.marker);
            if let Some(name) = swapped
                .chain(astray)
                .find(|n| markers.iter().all(|m| m.name != **n))
            {
                let known: Vec<&str> = markers.iter().map(|m| m.name.as_str()).collect();
                return fail(format!(
                    "board {:?} has no marker {name:?}; known: {}",
                    board.name,
                    known.join(", ")
                ));
            }
        }
        Ok(())
    }
}
