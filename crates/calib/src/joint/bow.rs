//! Facets that are not as flat as the session draws them: whose normal turns along their fan.

use super::fan::orders;
use super::group::{FACET_PARAMETERS, FIGURE_ORDERS};
use super::problem::Joint;
use crate::lsq::Solution;
use nalgebra::Vector2;

/// Turn of a facet's normal from its first to its last beam that is worth a sentence, in radians: with the slope errors of
/// good mirrors, 0.2 mrad rms, it is below a tenth of that.
const WORTH: f64 = 2e-3;

/// Standard deviations beyond which it is no chance.
const SURELY: f64 = 5.0;

impl Joint<'_> {
    /// A sentence for every facet whose normal turns along its fan.
    pub(super) fn bows<'a>(
        &'a self,
        solution: &'a Solution,
        names: &'a dyn Fn(usize) -> String,
    ) -> impl Iterator<Item = String> + 'a {
        let facets = self.groups.iter().enumerate().flat_map(|(number, group)| {
            let facets = group.facets.iter().enumerate();
            facets.map(move |(i, facet)| (number, i, facet.facet))
        });
        facets.filter_map(move |(group, i, facet)| {
            let (turn, sd) = self.turn_along(solution, group, i)?;
            (turn > WORTH && turn > SURELY * sd).then(|| {
                format!(
                    "facet {:?} is not flat: its normal turns by {:.2}° ± {:.2}° from its first beam to its last",
                    names(facet),
                    turn.to_degrees(),
                    sd.to_degrees()
                )
            })
        })
    }

    /// By how much a facet's normal turns from the first beam of its fan to the last, to first order, and the standard
    /// deviation of that, in radians.
    fn turn_along(&self, solution: &Solution, group: usize, facet: usize) -> Option<(f64, f64)> {
        let figure = Self::shape(solution.state.own(group), facet)?.figure;
        let columns = [0, FIGURE_ORDERS];
        let first = self.offset(group) + facet * FACET_PARAMETERS + 3;
        let covariance = solution
            .information
            .covariance_among(&columns.map(|c| first + c))?;
        let scale = self.flatness.figure * (orders(1.0)[0] - orders(-1.0)[0]);
        let turn = Vector2::from(columns.map(|c| figure[c])) * scale;
        let along = turn.try_normalize(f64::MIN_POSITIVE)?;
        let variance = scale * scale * along.dot(&(covariance.fixed_view::<2, 2>(0, 0) * along));
        Some((turn.norm(), variance.max(0.0).sqrt()))
    }
}
