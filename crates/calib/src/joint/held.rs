//! Cross-validation: leaves out a fifth of each facet's boards at a time and compares their readings with the
//! prediction from the rest.
//!
//! A reading is left out by giving it a millionth of its weight. Its prediction and the variance of the prediction,
//! with everything estimated and the board's own errors included, then come out of the same algebra as all others.

use super::group::Group;
use super::problem::Joint;
use crate::lsq::{self, ProblemError, State};
use catoptric_model::assessment::HeldOut;

/// Number of parts into which the boards of a facet are divided.
const FOLDS: usize = 5;

/// Factor on the standard deviation of a reading that is left out.
const LEFT_OUT: f64 = 1e6;

impl Joint<'_> {
    /// Differences of every board's readings from the prediction of a calibration without them; `None` if there are too
    /// few boards to leave any out.
    pub(super) fn cross_validated(&self, from: &State) -> Result<Option<HeldOut>, ProblemError> {
        let (mut boards, mut means) = (0, 0_usize);
        let (mut sum, mut squares, mut expected) = (0.0, 0.0, 0.0);
        for fold in 0..FOLDS {
            let is_left_out = |group: &Group, board: usize| !group.facets.is_empty() && board % FOLDS == fold;
            let mut rest = self.clone();
            for group in &mut rest.groups {
                let out: Vec<bool> = (0..group.boards.len()).map(|b| is_left_out(group, b)).collect();
                boards += out.iter().filter(|o| **o).count();
                let sights = group.elements.iter_mut().flat_map(|e| &mut e.sights);
                for sight in sights.filter(|s| out[s.board]) {
                    sight.sd *= LEFT_OUT;
                }
            }
            let solution = rest.solve(from.clone(), &lsq::SolverOptions::default())?;
            for answer in rest.answers(&solution) {
                // Without boards of its own an element's direction is that of its facet; without a covariance it is
                // open.
                for sight in answer
                    .seen
                    .iter()
                    .filter(|s| is_left_out(&rest.groups[s.group], s.board))
                {
                    let Some(fitted) = sight.fitted else { continue };
                    let residual = sight.residual * sight.sd;
                    let own = sight.sd / LEFT_OUT;
                    means += 1;
                    sum += residual;
                    squares += residual * residual;
                    expected += own * own + fitted * sight.sd * sight.sd;
                }
            }
        }
        let count = means as f64;
        Ok((means > 0).then(|| HeldOut {
            boards,
            means,
            rms_mm: 1e3 * (squares / count).sqrt(),
            expected_mm: 1e3 * (expected / count).sqrt(),
            mean_mm: 1e3 * sum / count,
        }))
    }
}
