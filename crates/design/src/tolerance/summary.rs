//! What many structures have in common.

use super::draw::{Built, Departure, Draw, Workshop};
use super::{Bounds, Calibrated, SCHEMA_VERSION};
use crate::layout::Class;
use catoptric_assess::score::percentile;
use catoptric_sim::Scene;
use serde::Serialize;

/// Bars that a histogram has at most, save for the one of the greatest value.
const BARS: f64 = 60.0;

/// What manufacturing errors do to a layout.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tolerance {
    /// Version of this format.
    pub schema_version: u32,
    /// Name of the scene.
    pub name: String,
    /// Seed of the first structure.
    pub seed: u64,
    /// Structures, one for every seed from there on.
    pub draws: usize,
    /// What they are built with.
    pub errors: Errors,
    /// Elements of the drawing.
    pub drawn: Counts,
    /// Elements that an edge splits, on average.
    pub split_mean: f64,
    /// The most of a structure.
    pub split_worst: usize,
    /// Elements without a direction of their own, split ones among them, on average.
    pub lost_mean: f64,
    /// The most of a structure.
    pub lost_worst: usize,
    /// The first seed with so many.
    pub worst_seed: u64,
    /// Elements that a facet deflects in the drawing and does not as built, on average.
    pub changed_mean: f64,
    /// The most of a structure.
    pub changed_worst: usize,
    /// How far directions are off before calibration, over all elements and structures, in degrees.
    pub direction_deg: Distribution,
    /// How far points at 4 m are off, in millimetres.
    pub point_at_4m_mm: Distribution,
    /// Facet by facet.
    pub facets: Vec<FacetTolerance>,
    /// What each kind of error does alone.
    pub sources: Vec<Source>,
    /// Directions by how far they are off.
    pub histogram: Histogram,
    /// What any calibration leaves; `None` where nobody asked.
    pub bound: Option<Bounds>,
    /// What simulated calibrations leave; `None` where nobody asked.
    pub calibrated: Option<Calibrated>,
}

/// The errors that structures are built with, as the scene states them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Errors {
    /// Turn of a facet about each axis, 1σ, in degrees.
    pub tilt_sd_deg: f64,
    /// Shift of a facet along each axis, 1σ, in millimetres.
    pub shift_sd_mm: f64,
    /// Departure of a mirror's thickness, 1σ, in millimetres.
    pub thickness_sd_mm: f64,
    /// Root mean square of a mirror's slope, in milliradians.
    pub slope_rms_mrad: f64,
    /// Yaw of the scanner in its housing, at most, in degrees.
    pub mount_yaw_tolerance_deg: f64,
    /// Pitch and roll of the scanner, at most, in degrees.
    pub mount_tilt_tolerance_deg: f64,
    /// Shift of the scanner, at most, in millimetres.
    pub mount_shift_tolerance_mm: f64,
}

/// Elements of the drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Counts {
    /// Deflected by one facet alone.
    pub deflected: usize,
    /// Split at an edge.
    pub split: usize,
    /// Without a direction of their own, split ones among them.
    pub lost: usize,
}

/// How a size is distributed; nothing without any.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Distribution {
    /// Root mean square.
    pub rms: Option<f64>,
    /// Median.
    pub median: Option<f64>,
    /// 95 % are at most this.
    pub p95: Option<f64>,
    /// Greatest.
    pub max: Option<f64>,
}

/// The elements of one facet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetTolerance {
    /// The facet.
    pub name: String,
    /// Elements that it deflects in the drawing.
    pub elements: usize,
    /// How far their directions are off, in degrees.
    pub direction_deg: Distribution,
    /// How far their points at 4 m are off, in millimetres.
    pub point_at_4m_mm: Distribution,
}

/// One kind of error alone.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Source {
    /// The kind.
    pub name: String,
    /// Root mean square of the directions' errors, in degrees.
    pub direction_rms_deg: Option<f64>,
    /// The same of points at 4 m, in millimetres.
    pub point_at_4m_rms_mm: Option<f64>,
}

/// Directions by how far they are off.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Histogram {
    /// Width of a bar, in degrees; the first begins at 0.
    pub width_deg: f64,
    /// Elements in each, over all structures.
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
            // At most the number of bars.
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

/// The least of 1, 2 and 5 times a power of ten that is no smaller.
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
    /// What structures of this drawing have in common; in the order of their seeds.
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
        let millimetres = |facet| values(|d| 1e3 * d.point, facet);
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
            point_at_4m_mm: Distribution::of(&millimetres(None)),
            facets: facets
                .map(|(number, facet)| FacetTolerance {
                    name: facet.name.clone(),
                    elements: bench.drawn_of(number),
                    direction_deg: Distribution::of(&degrees(Some(number))),
                    point_at_4m_mm: Distribution::of(&millimetres(Some(number))),
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
    fn a_histogram_counts_every_value_in_round_bars() {
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
