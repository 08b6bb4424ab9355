//! Range errors of the scanner: Cooper, Eqs. (3)–(5), with the tables that these equations need.
//!
//! A bias is *measured − true* and is subtracted to correct.

use crate::limits;
use crate::range::{CorrectedRange, RawRange};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// The three error terms of Eq. (3), individually, in meters.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct BiasTerms {
    /// Error that depends on the target's distance.
    #[doc(alias = "E_r")]
    pub distance: f64,
    /// Error that depends on the beam's incidence on the target.
    #[doc(alias = "E_a")]
    pub angle: f64,
    /// Error that depends on the target's color.
    #[doc(alias = "E_c")]
    pub color: f64,
}

impl BiasTerms {
    /// E_a + E_c + E_r.
    #[inline]
    pub fn total(&self) -> f64 {
        self.distance + self.angle + self.color
    }
}

/// Everything that Eq. (3) subtracts: a table over distance, a cosine law, and a line for each color.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RangeBias {
    /// E_r.
    #[serde(default)]
    pub distance: DistanceBias,
    /// E_a.
    #[serde(default)]
    pub angle: AngleBias,
    /// E_c by color name; zero for a color that is not listed.
    #[serde(default)]
    pub color: BTreeMap<String, ColorBias>,
}

/// The biases on targets of one color.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColoredBias<'a> {
    bias: &'a RangeBias,
    color: Option<&'a ColorBias>,
}

impl ColoredBias<'_> {
    /// The three terms for a target at `range` meters at a given incidence.
    #[inline]
    pub fn terms(&self, range: f64, cos_incidence: f64) -> BiasTerms {
        BiasTerms {
            distance: self.bias.distance.error(range),
            angle: self.bias.angle.error(cos_incidence),
            color: self.color.map_or(0.0, |c| c.error(range)),
        }
    }
}

/// E_r as a table over distance, linearly interpolated and constant outside (Cooper, Table 2).
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DistanceBias {
    /// Distances in meters, strictly increasing.
    #[schemars(inner(range(min = 0.0, max = limits::FAR_M)))]
    pub range_m: Vec<f64>,
    /// Errors at those distances, in millimeters.
    #[schemars(inner(range(min = -limits::ERROR_MM, max = limits::ERROR_MM)))]
    pub error_mm: Vec<f64>,
}

/// E_a = A_a·cos θ_N + B_a — Cooper, Eq. (4) — plus a table where that law does not fit the measured errors.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleBias {
    /// A_a, in millimeters.
    #[doc(alias = "A_a")]
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub gain_mm: f64,
    /// B_a, in millimeters.
    #[doc(alias = "B_a")]
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub offset_mm: f64,
    /// Table added to the law; with A_a = B_a = 0 it replaces the law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table: Option<AngleTable>,
}

/// Range errors over incidence, linearly interpolated in θ_N and constant outside.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AngleTable {
    /// Incidences θ_N in degrees, strictly increasing.
    #[schemars(length(min = 1), inner(range(min = 0.0, max = 90.0)))]
    pub incidence_deg: Vec<f64>,
    /// Errors at those incidences, in millimeters.
    #[schemars(inner(range(min = -limits::ERROR_MM, max = limits::ERROR_MM)))]
    pub error_mm: Vec<f64>,
}

/// E_c = A_c·R + B_c — Cooper, Eq. (5).
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ColorBias {
    /// A_c, in millimeters per meter.
    #[doc(alias = "A_c")]
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub slope_mm_per_m: f64,
    /// B_c, in millimeters.
    #[doc(alias = "B_c")]
    #[schemars(range(min = -limits::ERROR_MM, max = limits::ERROR_MM))]
    pub offset_mm: f64,
}

/// Weights of a table's nodes in the value linearly interpolated at `x`, held constant outside the table.
///
/// Two nodes at most, as (index, weight); all weights are 0 for an empty table. `nodes` must be strictly increasing.
#[inline]
pub fn interpolation_weights(nodes: &[f64], x: f64) -> [(usize, f64); 2] {
    let n = nodes.len();
    if n == 0 {
        return [(0, 0.0), (0, 0.0)];
    }
    let above = nodes.partition_point(|&node| node <= x);
    if above == 0 {
        return [(0, 1.0), (0, 0.0)];
    }
    if above == n {
        return [(n - 1, 1.0), (n - 1, 0.0)];
    }
    let t = (x - nodes[above - 1]) / (nodes[above] - nodes[above - 1]);
    [(above - 1, 1.0 - t), (above, t)]
}

/// The value of a table at `x`, linearly interpolated and constant outside; 0 for an empty table.
pub fn interpolate(nodes: &[f64], values: &[f64], x: f64) -> f64 {
    interpolation_weights(nodes, x)
        .iter()
        .map(|&(i, w)| w * values.get(i).copied().unwrap_or(0.0))
        .sum()
}

impl DistanceBias {
    /// Weight of each table node in the interpolated value: (index, weight) of two nodes at most.
    ///
    /// This is the derivative of E_r with respect to its nodes, as an error budget needs it.
    #[inline]
    pub fn weights(&self, range: f64) -> [(usize, f64); 2] {
        interpolation_weights(&self.range_m, range)
    }

    /// Range error caused by the target's distance, in meters.
    ///
    /// The paper fits a line that misses its own Table 2 by up to 5 mm; this interpolates the table itself.
    #[doc(alias = "E_r")]
    #[inline]
    pub fn error(&self, range: f64) -> f64 {
        self.weights(range)
            .iter()
            .map(|&(i, w)| w * self.error_mm.get(i).copied().unwrap_or(0.0) * 1e-3)
            .sum()
    }
}

impl AngleBias {
    /// Range error caused by the beam's incidence on the target, in meters: E_a = A_a·cos θ_N + B_a — Eq. (4).
    ///
    /// Takes cos θ_N, `0 ≤ cos θ_N ≤ 1`. The paper's law misses its own Table 3 by up to 8 mm; this adds a table
    /// if one is given.
    #[doc(alias = "E_a")]
    #[inline]
    pub fn error(&self, cos_incidence: f64) -> f64 {
        let law = (self.gain_mm * cos_incidence + self.offset_mm) * 1e-3;
        self.table
            .as_ref()
            .map_or(law, |table| law + table.error(cos_incidence))
    }
}

impl AngleTable {
    /// The table's value at an incidence given by its cosine, in meters; a cosine rounded beyond ±1 counts as ±1.
    #[inline]
    pub fn error(&self, cos_incidence: f64) -> f64 {
        let incidence = libm::acos(cos_incidence.clamp(-1.0, 1.0)).to_degrees();
        interpolate(&self.incidence_deg, &self.error_mm, incidence) * 1e-3
    }
}

impl ColorBias {
    /// Range error caused by the target's color, in meters: E_c = A_c·R + B_c — Eq. (5).
    #[doc(alias = "E_c")]
    #[inline]
    pub fn error(&self, range: f64) -> f64 {
        (self.slope_mm_per_m * range + self.offset_mm) * 1e-3
    }
}

impl RangeBias {
    /// The biases on targets of one color, for repeated evaluation.
    #[inline]
    pub fn on(&self, color: &str) -> ColoredBias<'_> {
        ColoredBias {
            bias: self,
            color: self.color.get(color),
        }
    }

    /// The three terms for a target at `range` meters at a given incidence and color.
    #[inline]
    pub fn terms(&self, range: f64, cos_incidence: f64, color: &str) -> BiasTerms {
        self.on(color).terms(range, cos_incidence)
    }

    /// The corrected range r − E_a − E_c − E_r — Eq. (3).
    ///
    /// `range` and `cos_incidence` are estimates of the target's; the errors vary so slowly that centimeter accuracy of
    /// the range gives micrometer accuracy here.
    #[inline]
    pub fn correct(&self, raw: RawRange, range: f64, cos_incidence: f64, color: &str) -> CorrectedRange {
        CorrectedRange(raw.0 - self.terms(range, cos_incidence, color).total())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table_2() -> DistanceBias {
        DistanceBias {
            range_m: vec![0.5, 2.0, 4.0],
            error_mm: vec![-2.8, 6.1, -0.1],
        }
    }

    #[test]
    fn the_table_is_exact_at_its_nodes_and_constant_outside() {
        for (range, mm) in [
            (0.5, -2.8),
            (2.0, 6.1),
            (4.0, -0.1),
            (0.1, -2.8),
            (9.0, -0.1),
            (3.0, 3.0),
        ] {
            assert!((table_2().error(range) - mm * 1e-3).abs() < 1e-15, "at {range} m");
        }
        assert_eq!(DistanceBias::default().error(1.0), 0.0);
    }

    #[test]
    fn equations_4_and_5_as_printed() {
        let angle = AngleBias {
            gain_mm: -70.3,
            offset_mm: 86.1,
            table: None,
        };
        assert!((angle.error(1.0) - 0.0158).abs() < 1e-15);
        let color = ColorBias {
            slope_mm_per_m: 0.5,
            offset_mm: -1.0,
        };
        assert!((color.error(4.0) - 0.001).abs() < 1e-15);
    }

    #[test]
    fn a_table_of_incidences_is_added_to_the_law() {
        // Table 3, means over its three trials, at the angles actually measured.
        let table = AngleTable {
            incidence_deg: vec![0.9, 18.5, 44.7],
            error_mm: vec![9.233, 27.4, 34.7],
        };
        let alone = AngleBias {
            table: Some(table.clone()),
            ..AngleBias::default()
        };
        let at = |bias: &AngleBias, degrees: f64| bias.error(libm::cos(degrees.to_radians()));
        for (degrees, mm) in [
            (0.0, 9.233),
            (0.9, 9.233),
            (18.5, 27.4),
            (31.6, 31.05),
            (80.0, 34.7),
        ] {
            // The arc cosine loses half of its digits near 1, where the table is flat.
            assert!(
                (at(&alone, degrees) - mm * 1e-3).abs() < 1e-12,
                "at {degrees} degrees"
            );
        }
        let law = AngleBias {
            gain_mm: -70.3,
            offset_mm: 86.1,
            table: None,
        };
        let both = AngleBias {
            table: Some(table),
            ..law.clone()
        };
        assert!((at(&both, 30.0) - at(&law, 30.0) - at(&alone, 30.0)).abs() < 1e-15);
        assert_eq!(AngleTable::default().error(0.5), 0.0);
    }

    #[test]
    fn correction_undoes_the_terms() {
        let bias = RangeBias {
            distance: table_2(),
            angle: AngleBias {
                gain_mm: -70.3,
                offset_mm: 70.3,
                table: None,
            },
            color: BTreeMap::from([(
                "white".to_owned(),
                ColorBias {
                    slope_mm_per_m: 0.5,
                    offset_mm: 1.0,
                },
            )]),
        };
        let terms = bias.terms(1.3, 0.8, "white");
        let corrected = bias.correct(RawRange(1.3 + terms.total()), 1.3, 0.8, "white");
        assert!((corrected.0 - 1.3).abs() < 1e-15);
    }
}
