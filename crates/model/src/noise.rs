//! White noise of readings over distance.

use crate::bias::interpolate;
use crate::characterization::NoiseRow;
use crate::limits;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Largest difference between two distances at which noise was measured that counts as none, in meters.
const SAME_DISTANCE: f64 = 1e-3;

/// White noise of a reading over distance, linearly interpolated and constant outside (Cooper, Tables 2 and 4).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Distances in meters, strictly increasing.
    #[schemars(length(min = 1), inner(range(min = 0.0, max = limits::FAR_M)))]
    pub range_m: Vec<f64>,
    /// Standard deviations at those distances, in millimeters.
    #[schemars(inner(range(min = 0.0, max = limits::ERROR_MM)))]
    pub sd_mm: Vec<f64>,
}

impl Noise {
    /// The table of some measured rows; those at one distance, to the millimeter, are pooled.
    pub(crate) fn of<'r>(rows: impl IntoIterator<Item = &'r NoiseRow>) -> Self {
        let mut rows: Vec<&NoiseRow> = rows.into_iter().collect();
        rows.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
        let mut table = Self::default();
        for near in rows.chunk_by(|a, b| b.distance_m - a.distance_m < SAME_DISTANCE) {
            let freedom: f64 = near.iter().map(|r| r.degrees_of_freedom as f64).sum();
            let weighted = |value: fn(&NoiseRow) -> f64| {
                near.iter()
                    .map(|r| r.degrees_of_freedom as f64 * value(r))
                    .sum::<f64>()
                    / freedom
            };
            table.range_m.push(weighted(|r| r.distance_m));
            table.sd_mm.push(weighted(|r| r.sd_mm * r.sd_mm).sqrt());
        }
        table
    }

    /// Standard deviation of a reading of a target at a distance, both in meters.
    pub fn sd(&self, range: f64) -> f64 {
        interpolate(&self.range_m, &self.sd_mm, range) * 1e-3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measured_rows_become_a_table() {
        let row = |distance_m: f64, sd_mm: f64, degrees_of_freedom: usize| NoiseRow {
            color: "white".to_owned(),
            distance_m,
            sd_mm,
            degrees_of_freedom,
        };
        let rows = [row(2.0, 3.0, 300), row(0.5, 4.0, 100), row(2.0002, 5.0, 100)];
        let table = Noise::of(&rows);
        assert_eq!(table.range_m.len(), 2);
        assert!((table.sd(0.1) - 4e-3).abs() < 1e-15);
        // Pooled: √((300·3² + 100·5²)/400).
        assert!((table.sd(3.0) - 13.0_f64.sqrt() * 1e-3).abs() < 1e-12);
    }
}
