//! Is noise white? The means of the first and of the second half of a stretch then differ by no more than the scatter of
//! the readings within each half lets them.
//!
//! What all beams of a stretch share, and what varies evenly along the scan, is taken out: a board or a rig that settles
//! moves all readings together. What is left of neighboring beams is then independent, unless the scanner smooths its
//! readings.

use super::super::problem::Joint;
use super::evidence::Statistic;
use catoptric_model::assessment::{Cause, ComponentTest};
use catoptric_model::{BeamStatistics, Dataset};
use nalgebra::{Matrix2, Vector2};

/// Minimum number of readings in each half.
const MIN_READINGS: usize = 20;

/// Smallest scatter of readings that is not their rounding, in meters.
const MIN_SCATTER: f64 = 5e-4;

/// Minimum number of beams of a stretch.
const MIN_BEAMS: usize = 5;

/// Differences of halves of all readings of boards.
pub(super) struct Halves {
    pub(super) statistic: Statistic,
    /// Variance of the differences relative to that of white noise.
    pub(super) inflation: f64,
    /// Correlation of neighboring beams' differences.
    pub(super) neighbors: f64,
    /// Number of pairs of neighbors.
    pairs: usize,
}

impl Halves {
    pub(super) fn test(&self) -> ComponentTest {
        ComponentTest {
            cause: Cause::CorrelatedNoise,
            statistic: self.statistic.chi_squared,
            degrees_of_freedom: self.statistic.freedom,
            p_value: libm::exp(self.statistic.ln_p()),
        }
    }

    /// χ² of the correlation of neighbors, if it is positive; its variance is one over the number of pairs.
    pub(super) fn of_neighbors(&self) -> Statistic {
        Statistic {
            chi_squared: self.neighbors.max(0.0).powi(2) * self.pairs as f64,
            freedom: 1.0,
        }
    }

    pub(super) fn test_of_neighbors(&self) -> ComponentTest {
        let statistic = self.of_neighbors();
        ComponentTest {
            cause: Cause::NeighborNoise,
            statistic: statistic.chi_squared,
            degrees_of_freedom: statistic.freedom,
            p_value: libm::exp(statistic.ln_p()),
        }
    }
}

/// Compares the halves of every stretch; `None` if there are too few readings.
pub(super) fn correlated(joint: &Joint, dataset: &Dataset) -> Option<Halves> {
    let mut statistic = Statistic::default();
    let (mut products, mut pairs) = (0.0, 0);
    for group in &joint.groups {
        for (place, board) in group.boards.iter().enumerate() {
            let statistics = dataset.poses.get(board.pose)?.readings.statistics();
            let mut seen: Vec<Vector2<f64>> = Vec::new();
            for element in &group.elements {
                let of_board = element.sights.iter().find(|s| s.board == place);
                let readings = statistics.get(element.beam);
                if let (Some(sight), Some(readings)) = (of_board, readings)
                    // Without outliers: those are no noise.
                    && readings.all.count == sight.count
                    && let Some(difference) = difference(readings)
                {
                    seen.push(Vector2::new(element.beam as f64, difference));
                }
            }
            if seen.len() >= MIN_BEAMS {
                let left = beside_trend(&seen);
                statistic.chi_squared += left.iter().map(|p| p.y * p.y).sum::<f64>();
                statistic.freedom += (seen.len() - 2) as f64;
                for pair in left.windows(2).filter(|pair| pair[1].x - pair[0].x == 1.0) {
                    products += pair[0].y * pair[1].y;
                    pairs += 1;
                }
            }
        }
    }
    let inflation = statistic.chi_squared / statistic.freedom;
    (statistic.freedom > 0.0).then(|| Halves {
        neighbors: if pairs > 0 && inflation > 0.0 {
            products / pairs as f64 / inflation
        } else {
            0.0
        },
        pairs,
        inflation,
        statistic,
    })
}

/// Difference of the two halves' means, of variance 1 if noise is white.
fn difference(readings: &BeamStatistics) -> Option<f64> {
    let [first, second] = readings.halves;
    if first.count.min(second.count) < MIN_READINGS {
        return None;
    }
    let freedom = (first.count + second.count - 2) as f64;
    let variance = (first.squares + second.squares) / freedom;
    if variance < MIN_SCATTER * MIN_SCATTER {
        return None;
    }
    let of_difference = variance * (1.0 / first.count as f64 + 1.0 / second.count as f64);
    // The scatter is estimated too: Student's t has the variance ν/(ν − 2).
    let student = ((freedom - 2.0) / freedom).sqrt();
    Some((second.mean - first.mean) / of_difference.sqrt() * student)
}

/// Points (place, value), each with the distance of its value from the straight line through all.
fn beside_trend(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    let count = points.len() as f64;
    let middle = points.iter().map(|p| p.x).sum::<f64>() / count;
    let row = |p: &Vector2<f64>| Vector2::new(1.0, p.x - middle);
    let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
    for p in points {
        normal += row(p) * row(p).transpose();
        right += row(p) * p.y;
    }
    let line = normal
        .try_inverse()
        .map_or_else(Vector2::zeros, |inverse| inverse * right);
    let left = |p: &Vector2<f64>| Vector2::new(p.x, p.y - row(p).dot(&line));
    points.iter().map(left).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_model::Readings;

    #[test]
    fn a_trend_is_taken_out_and_scatter_is_kept() {
        let points: Vec<_> = (0..20)
            .map(|i| Vector2::new(f64::from(i), 3.0 + 0.1 * f64::from(i)))
            .collect();
        let squares = |points: &[Vector2<f64>]| beside_trend(points).iter().map(|p| p.y * p.y).sum::<f64>();
        assert!(squares(&points) < 1e-20);
        let alternating = |i: i32| if i % 2 == 0 { 1.0 } else { -1.0 };
        let points: Vec<_> = (0..40)
            .map(|i| Vector2::new(f64::from(i), 5.0 + alternating(i)))
            .collect();
        assert!((squares(&points) - 40.0).abs() < 0.1);
    }

    #[test]
    fn halves_at_two_levels_differ_and_few_readings_say_nothing() {
        let readings = |level: f64, count: usize| {
            let value = |i: usize| {
                let noise = if i.is_multiple_of(2) { 2e-3 } else { -2e-3 };
                2.0 + noise + if 2 * i >= count { level } else { 0.0 }
            };
            let all = Readings::in_memory(1, (0..count).map(value).collect());
            all.statistics()[0]
        };
        assert!(difference(&readings(0.0, 100)).expect("there are enough").abs() < 1e-9);
        // Half a millimeter on a standard error of 0.4 mm.
        let found = difference(&readings(5e-4, 100)).expect("there are enough");
        assert!((found - 1.25).abs() < 0.03, "{found}");
        assert_eq!(difference(&readings(0.0, 30)), None);
    }
}
