//! Summary of many structures: the result of a tolerance analysis.

use super::draw::{Built, Departure, Draw, Workshop};
use super::{Bounds, Calibrated};
use crate::layout::Class;
use catoptric_assess::score::percentile;
use catoptric_sim::Scene;
use serde::Serialize;

/// Version of the format of a tolerance analysis.
pub const SCHEMA_VERSION: u32 = 1;

/// Maximum number of bars of a histogram, apart from the one of the largest value.
const BARS: f64 = 60.0;

/// The effect of manufacturing errors on a layout.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tolerance {
    /// Version of this format.
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the first structure.
    pub seed: u64,
    /// Number of structures, one for every seed from there on.
    pub draws: usize,
    /// The errors that they are built with.
    pub errors: Errors,
    /// Elements of the drawing.
    pub drawn: Counts,
    /// Mean number of elements that an edge splits.
    pub split_mean: f64,
    /// Maximum number of them in a structure.
    pub split_worst: usize,
    /// Mean number of elements without a direction of their own, split ones included.
    pub lost_mean: f64,
    /// Maximum number of them in a structure.
    pub lost_worst: usize,
    /// The first seed with that maximum.
    pub worst_seed: u64,
    /// Mean number of elements that a facet deflects in the drawing and not as built.
    pub changed_mean: f64,
    /// Maximum number of them in a structure.
    pub changed_worst: usize,
    /// Errors of the directions before calibration, over all elements and structures, in degrees.
    pub direction_deg: Distribution,
    /// Errors of points at 4 m, in millimeters.
    pub point_at_4m_mm: Distribution,
    /// Facet by facet.
    pub facets: Vec<FacetTolerance>,
    /// The effect of each kind of error alone.
    pub sources: Vec<Source>,
    /// Histogram of the errors of the directions.
    pub histogram: Histogram,
    /// The error that any calibration leaves; `None` if not requested.
    pub bound: Option<Bounds>,
    /// The error that simulated calibrations leave; `None` if not requested.
    pub calibrated: Option<Calibrated>,
}

/// The errors that structures are built with, as the scene states them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Errors {
    /// Rotation of a facet about each axis, 1σ, in degrees.
    pub tilt_sd_deg: f64,
    /// Shift of a facet along each axis, 1σ, in millimeters.
    pub shift_sd_mm: f64,
    /// Error of a mirror's thickness, 1σ, in millimeters.
    pub thickness_sd_mm: f64,
    /// Root mean square of a mirror's slope error, in milliradians.
    pub slope_rms_mrad: f64,
    /// Maximum yaw of the scanner in its housing, in degrees.
    pub mount_yaw_tolerance_deg: f64,
    /// Maximum pitch and roll of the scanner, in degrees.
    pub mount_tilt_tolerance_deg: f64,
    /// Maximum shift of the scanner, in millimeters.
    pub mount_shift_tolerance_mm: f64,
}

/// Elements of the drawing by class.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counts {
    /// Deflected by one facet alone.
    pub deflected: usize,
    /// Split at an edge.
    pub split: usize,
    /// Without a direction of their own, split ones included.
    pub lost: usize,
}

/// The distribution of a quantity; all `None` without values.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// Root mean square.
    pub rms: Option<f64>,
    /// Median.
    pub median: Option<f64>,
    /// 95th percentile.
    pub p95: Option<f64>,
    /// Maximum.
    pub max: Option<f64>,
}

/// The elements of one facet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetTolerance {
    /// The facet.
    pub name: String,
    /// Number of elements that it deflects in the drawing.
    pub elements: usize,
    /// Errors of their directions, in degrees.
    pub direction_deg: Distribution,
    /// Errors of their points at 4 m, in millimeters.
    pub point_at_4m_mm: Distribution,
}

/// One kind of error alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Source {
    /// Name of the kind.
    pub name: String,
    /// Root mean square error of the directions, in degrees.
    pub direction_rms_deg: Option<f64>,
    /// Root mean square error of points at 4 m, in millimeters.
    pub point_at_4m_rms_mm: Option<f64>,
}

/// Histogram of the errors of the directions.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Width of a bar, in degrees; the first begins at 0.
    pub width_deg: f64,
    /// Number of elements in each bar, over all structures.
    pub counts: Vec<usize>,
}

impl Errors {
    fn of(scene: &Scene) -> Self {
        let as_built = &scene.superstructure.as_built;
        let mount = &scene.scanner.mount;
        Self {
            tilt_sd_deg: as_built.tilt_sd_deg,
            shift_sd_mm: as_built.shift_sd_mm,
            thickness_sd_mm: as_built.thickness_sd_mm,
            slope_rms_mrad: as_built.slope_rms_mrad,
            mount_yaw_tolerance_deg: mount.yaw_tolerance_deg,
            mount_tilt_tolerance_deg: mount.tilt_tolerance_deg,
            mount_shift_tolerance_mm: mount.shift_tolerance_mm,
        }
    }
}

impl Distribution {
    fn of(values: &[f64]) -> Self {
        let some = |value: f64| (!values.is_empty()).then_some(value);
        let mean = values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64;
        Self {
            rms: some(mean.sqrt()),
            median: some(percentile(values, 0.5)),
            p95: some(percentile(values, 0.95)),
            max: some(percentile(values, 1.0)),
        }
    }
}

impl Histogram {
    fn of(values: &[f64]) -> Self {
        let largest = values.iter().copied().fold(0.0, f64::max);
        if largest == 0.0 {
            return Self {
                width_deg: 1.0,
                counts: vec![values.len()],
            };
        }
        let width_deg = round_above(largest / BARS);
        let mut counts = Vec::new();
        for value in values {
            // Bounded by the number of bars.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let bar = (value / width_deg) as usize;
            if bar >= counts.len() {
                counts.resize(bar + 1, 0);
            }
            counts[bar] += 1;
        }
        Self { width_deg, counts }
    }
}

/// Rounds up to 1, 2 or 5 times a power of ten.
fn round_above(value: f64) -> f64 {
    let mut decade = 1.0;
    while decade > value {
        decade /= 10.0;
    }
    while decade * 10.0 <= value {
        decade *= 10.0;
    }
    let steps = [1.0, 2.0, 5.0].map(|m| m * decade);
    steps.into_iter().find(|s| *s >= value).unwrap_or(10.0 * decade)
}

impl Workshop {
    /// Summarizes structures built from this drawing, given in the order of their seeds.
    pub fn summarize(&self, built: &[Built]) -> Tolerance {
        let bench = self.bench();
        let draws: Vec<&Draw> = built.iter().map(|b| &b.whole).collect();
        let count = |class: fn(Class) -> bool| bench.drawn.iter().filter(|t| class(t.class())).count();
        let mean = |of: fn(&Draw) -> usize| {
            draws.iter().map(|d| of(d) as f64).sum::<f64>() / draws.len().max(1) as f64
        };
        let worst = |of: fn(&Draw) -> usize| draws.iter().map(|d| of(d)).max().unwrap_or(0);
        let lost_worst = worst(|d| d.lost);
        let values = |of: fn(&Departure) -> f64, facet: Option<usize>| -> Vec<f64> {
            let all = draws.iter().flat_map(|d| &d.departures);
            let own = all.filter(|d| facet.is_none_or(|f| f == d.facet));
            own.map(of).collect()
        };
        let degrees = |facet| values(|d| d.direction.to_degrees(), facet);
        let point_mm = |facet| values(|d| 1e3 * d.point, facet);
        let facets = bench.scene.superstructure.facet.iter().enumerate();
        let directions = degrees(None);
        Tolerance {
            schema_version: SCHEMA_VERSION,
            name: bench.scene.name.clone(),
            seed: draws.first().map_or(bench.scene.seed, |d| d.seed),
            draws: draws.len(),
            errors: Errors::of(&bench.scene),
            drawn: Counts {
                deflected: count(|c| c == Class::Deflected),
                split: count(|c| c == Class::Split),
                lost: count(|c| !c.sees()),
            },
            split_mean: mean(|d| d.split),
            split_worst: worst(|d| d.split),
            lost_mean: mean(|d| d.lost),
            lost_worst,
            worst_seed: draws
                .iter()
                .find(|d| d.lost == lost_worst)
                .map_or(bench.scene.seed, |d| d.seed),
            changed_mean: mean(|d| d.changed),
            changed_worst: worst(|d| d.changed),
            direction_deg: Distribution::of(&directions),
            point_at_4m_mm: Distribution::of(&point_mm(None)),
            facets: facets
                .map(|(number, facet)| FacetTolerance {
                    name: facet.name.clone(),
                    elements: bench.drawn_of(number),
                    direction_deg: Distribution::of(&degrees(Some(number))),
                    point_at_4m_mm: Distribution::of(&point_mm(Some(number))),
                })
                .collect(),
            sources: self.sources(built),
            histogram: Histogram::of(&directions),
            bound: None,
            calibrated: None,
        }
    }

    fn sources(&self, built: &[Built]) -> Vec<Source> {
        let of_one = |(number, cause): (usize, super::Cause)| {
            let sums = built.iter().filter_map(|b| b.alone.get(number));
            let (count, direction, point) = sums.fold((0, 0.0, 0.0), |(n, direction, point), sum| {
                (n + sum.0, direction + sum.1, point + sum.2)
            });
            let root = |square: f64| (count > 0).then(|| (square / count as f64).sqrt());
            Source {
                name: cause.name().to_owned(),
                direction_rms_deg: root(direction).map(f64::to_degrees),
                point_at_4m_rms_mm: root(point).map(|p| 1e3 * p),
            }
        };
        self.causes().enumerate().map(of_one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_distribution_is_that_of_its_values() {
        let found = Distribution::of(&[3.0, 4.0]);
        assert!(found.rms.is_some_and(|rms| (rms - 12.5_f64.sqrt()).abs() < 1e-15));
        assert_eq!((found.median, found.max), (Some(3.5), Some(4.0)));
        assert_eq!(Distribution::of(&[]).rms, None);
    }

    #[test]
    fn a_histogram_counts_every_value_in_round_bins() {
        let values: Vec<f64> = (0..1000).map(|i| 7.3e-3 * f64::from(i)).collect();
        let found = Histogram::of(&values);
        assert_eq!(found.width_deg, 0.2);
        assert_eq!(found.counts.iter().sum::<usize>(), 1000);
        assert_eq!(found.counts.len(), 37);
        let first = values.iter().filter(|v| **v < 0.2).count();
        assert_eq!(found.counts[0], first);
        assert_eq!(Histogram::of(&[0.0; 3]).counts, [3]);
    }
}
