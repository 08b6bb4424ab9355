//! Residuals that need no truth: distances of lifted points from surveyed boards and walls.

use super::allowed::Allowance;
use super::statistics::percentile;
use catoptric_calib::observations::{self, BoardInSensor};
use catoptric_calib::tracking;
use catoptric_model::{
    BeamEstimate, Calibration, CorrectedRange, Dataset, Deflection, Pose, PoseKind, PoseRecord,
};
use catoptric_model::{RangeBias, RawRange, Unreadable};
use nalgebra::Unit;
use rayon::prelude::*;
use serde::Serialize;
use std::collections::BTreeMap;

/// Distances of lifted points from the surfaces they were measured on, positive behind the surface, in millimeters.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SurfaceResidual {
    /// Stretches that contributed.
    pub stretches: usize,
    /// Elements that contributed.
    pub elements: usize,
    /// Readings that contributed.
    pub readings: usize,
    /// Mean over the readings, their common error.
    pub mean: f64,
    /// Root mean square over the readings.
    pub rms: f64,
}

/// Standard deviation of a mean of readings that are whole millimeters, in millimeters.
pub(super) const ROUNDING_MM: f64 = 0.3;

/// The surface that a beam is expected to hit.
struct Surface {
    predicted: f64,
    cos_incidence: f64,
    color: String,
    /// Variance of the range of many readings, in square meters; `None` if it is not asked for.
    allowed: Option<f64>,
}

/// Residuals, and their size in units of what is allowed.
pub(super) struct Judged {
    pub(super) residual: SurfaceResidual,
    /// Median over elements and stretches of the squared mean residual over its variance; NaN if it was not asked for.
    pub(super) normalized: f64,
    /// The same for the elements of each mirror.
    pub(super) by_mirror: Vec<Normalized>,
}

/// Size of the residuals of one mirror's elements in units of what is allowed.
#[derive(Debug, Clone)]
pub(super) struct Normalized {
    pub(super) facet: String,
    /// Median over elements and stretches of the squared mean residual over its variance.
    pub(super) median: f64,
}

/// One element's residuals over one stretch.
struct Visit {
    beam: usize,
    stretch: usize,
    on: Surface,
    readings: usize,
    sum: f64,
    sum_of_squares: f64,
}

/// Point-to-board residuals of the readings of the solved elements on the boards of their facets.
///
/// An element is on a board if its outgoing ray, as calibrated, hits the board's face farther from the edge than its
/// spot. A reading there is corrected by all terms of Eq. (3), since board and incidence are known, and for glass in front
/// of the mirror. Its residual is the distance of the lifted point from the board's plane, cos θ_N·(r − d − s).
///
/// # Errors
/// [`Unreadable`] if the recording can no longer be read.
pub fn boards(dataset: &Dataset, calibration: &Calibration) -> Result<SurfaceResidual, Unreadable> {
    Ok(judged_boards(dataset, calibration, false)?.residual)
}

pub(super) fn judged_boards(
    dataset: &Dataset,
    calibration: &Calibration,
    judge: bool,
) -> Result<Judged, Unreadable> {
    // A label on the wrong marker puts a board where it was not.
    let (dataset, _) = tracking::put_right(dataset);
    let dataset = dataset.as_ref();
    let rig_from_sensor = mount(dataset, calibration);
    let cone = observations::cone_half_angle(&dataset.session);
    let allowance = judge.then(|| Allowance::of(dataset, calibration));
    let allowance = allowance.as_ref();
    collect(dataset, calibration, PoseKind::Facet, |pose| {
        let board = BoardInSensor::of(pose, &dataset.session, &rig_from_sensor);
        move |estimate: &BeamEstimate, deflection: &Deflection| {
            let board = board.as_ref()?;
            let azimuth = observations::azimuth(&dataset.session, estimate.beam);
            let exit = deflection.exit_direction(azimuth);
            let (bare, delay) = dataset.session.without_glass(azimuth, deflection);
            let hit = board.hit(&bare.deflection_point(azimuth), &exit)?;
            let predicted = bare.distance + hit.distance + delay;
            board.holds(&hit, cone * predicted, 0.0).then(|| Surface {
                predicted,
                cos_incidence: board.plane.cos_incidence(&exit),
                color: board.color.clone(),
                allowed: allowance.and_then(|a| a.variance(estimate, deflection, &board.view(0.0, 1))),
            })
        }
    })
}

/// Point-to-wall residual of every reading of the solved elements in the empty room: data no method fits angles to.
///
/// # Errors
/// As [`boards`].
pub fn walls(dataset: &Dataset, calibration: &Calibration) -> Result<SurfaceResidual, Unreadable> {
    Ok(judged_walls(dataset, calibration, false)?.residual)
}

pub(super) fn judged_walls(
    dataset: &Dataset,
    calibration: &Calibration,
    judge: bool,
) -> Result<Judged, Unreadable> {
    let allowance = judge.then(|| Allowance::of(dataset, calibration));
    let allowance = allowance.as_ref();
    let rig_from_sensor = mount(dataset, calibration);
    collect(dataset, calibration, PoseKind::Room, |pose| {
        let room_from_sensor = pose.room_from_rig * rig_from_sensor;
        move |estimate: &BeamEstimate, deflection: &Deflection| {
            let room = dataset.session.room.as_ref()?;
            let azimuth = observations::azimuth(&dataset.session, estimate.beam);
            let (bare, delay) = dataset.session.without_glass(azimuth, deflection);
            let origin = room_from_sensor * bare.deflection_point(azimuth);
            let in_sensor = deflection.exit_direction(azimuth);
            let exit = Unit::new_unchecked(room_from_sensor * in_sensor.into_inner());
            let (s, wall) = room.cast(&origin, &exit)?;
            Some(Surface {
                predicted: bare.distance + s + delay,
                cos_incidence: wall.cos_incidence(&exit),
                color: room.color.clone(),
                allowed: allowance.and_then(|a| {
                    let view = a.of_wall(&wall, &room_from_sensor, &room.color);
                    a.variance(estimate, deflection, &view)
                }),
            })
        }
    })
}

/// Returns the mounting as calibrated, or as drawn if the calibration has none.
pub fn mount(dataset: &Dataset, calibration: &Calibration) -> Pose {
    match &calibration.rig_from_sensor {
        Some(estimate) => estimate.pose(),
        None => Pose::from(&dataset.session.nominal_rig_from_sensor),
    }
}

/// Returns the biases as calibrated, or as believed if the calibration has none.
pub fn bias<'a>(dataset: &'a Dataset, calibration: &'a Calibration) -> &'a RangeBias {
    calibration
        .bias
        .as_ref()
        .unwrap_or(&dataset.session.believed.bias)
}

/// Collects residuals over all stretches of a kind; `expect` returns the surface that a beam hits in one of them.
fn collect<E>(
    dataset: &Dataset,
    calibration: &Calibration,
    kind: PoseKind,
    expect: impl Fn(&PoseRecord) -> E + Sync,
) -> Result<Judged, Unreadable>
where
    E: Fn(&BeamEstimate, &Deflection) -> Option<Surface>,
{
    let bias = bias(dataset, calibration);
    let of_stretch = |record: &&PoseRecord| {
        let expect = expect(record);
        let visit = |estimate: &BeamEstimate| {
            Some(Visit {
                beam: estimate.beam,
                stretch: record.label.pose,
                on: expect(estimate, &estimate.deflection()?)?,
                readings: 0,
                sum: 0.0,
                sum_of_squares: 0.0,
            })
        };
        let on_it = calibration.beams.iter().filter(|b| b.beam < record.beams());
        let mut visits: Vec<Visit> = on_it.filter_map(visit).collect();
        if visits.is_empty() {
            return Ok(visits);
        }
        for scan in record.scans() {
            let scan = scan?;
            for visit in &mut visits {
                visit.add(RawRange(scan[visit.beam]), bias);
            }
        }
        visits.retain(|v| v.readings > 0);
        Ok(visits)
    };
    let stretches: Vec<&PoseRecord> = dataset.of_kind(kind).collect();
    let visits: Vec<Vec<Visit>> = stretches.par_iter().map(of_stretch).collect::<Result<_, _>>()?;
    let visits: Vec<Visit> = visits.into_iter().flatten().collect();
    let believed = &dataset.session.believed;
    let squares: Vec<(usize, f64)> = visits
        .iter()
        .filter_map(|v| {
            let noise_sd_mm = believed.noise_sd(v.on.predicted, &v.on.color) * 1e3;
            Some((v.beam, v.normalized_square(noise_sd_mm)?))
        })
        .collect();
    let all: Vec<f64> = squares.iter().map(|(_, square)| *square).collect();
    Ok(Judged {
        residual: summarize(&visits),
        normalized: percentile(&all, 0.5),
        by_mirror: by_mirror(dataset, calibration, &squares),
    })
}

/// The squared residuals of some beams by mirror: the one that the calibration names, else the one whose fan as drawn is
/// nearest.
fn by_mirror(dataset: &Dataset, calibration: &Calibration, squares: &[(usize, f64)]) -> Vec<Normalized> {
    let session = &dataset.session;
    let scan = &session.scanner.scan;
    let place = |beam: usize| {
        let named = calibration.beam(beam).and_then(|b| b.facet.as_ref());
        let named = named.and_then(|name| session.facets.iter().position(|f| f.name == *name));
        named
            .or_else(|| (0..session.facets.len()).min_by_key(|f| scan.beside(session.facets[*f].beams, beam)))
    };
    let mut of_mirror: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for (beam, square) in squares {
        if let Some(facet) = place(*beam) {
            of_mirror.entry(facet).or_default().push(*square);
        }
    }
    let normalized = |(facet, squares): (usize, Vec<f64>)| Normalized {
        facet: session.facets[facet].name.clone(),
        median: percentile(&squares, 0.5),
    };
    of_mirror.into_iter().map(normalized).collect()
}

impl Visit {
    fn add(&mut self, raw: RawRange, bias: &RangeBias) {
        if !raw.0.is_finite() {
            return;
        }
        let on = &self.on;
        let CorrectedRange(corrected) = bias.correct(raw, on.predicted, on.cos_incidence, &on.color);
        let residual = on.cos_incidence * (corrected - on.predicted) * 1e3;
        self.readings += 1;
        self.sum += residual;
        self.sum_of_squares += residual * residual;
    }

    fn mean(&self) -> f64 {
        self.sum / self.readings as f64
    }

    /// Squared mean residual in units of its variance, which includes the noise of a mean: as believed, or as large as
    /// the readings scatter.
    fn normalized_square(&self, noise_sd_mm: f64) -> Option<f64> {
        let cos = self.on.cos_incidence;
        let scatter = (self.sum_of_squares / self.readings as f64 - self.mean().powi(2)).max(0.0);
        let noise = scatter.max((cos * noise_sd_mm).powi(2)) / self.readings as f64;
        let variance = cos * cos * self.on.allowed? * 1e6 + noise + ROUNDING_MM * ROUNDING_MM;
        Some(self.mean().powi(2) / variance)
    }

    fn mean_square(&self) -> f64 {
        // By way of the root mean square, to its last digit.
        (self.sum_of_squares / self.readings as f64).sqrt().powi(2)
    }
}

fn summarize(visits: &[Visit]) -> SurfaceResidual {
    let count = |key: fn(&Visit) -> usize| {
        let distinct: std::collections::BTreeSet<usize> = visits.iter().map(key).collect();
        distinct.len()
    };
    let readings: usize = visits.iter().map(|v| v.readings).sum();
    let weighted = |value: fn(&Visit) -> f64| {
        visits.iter().map(|v| v.readings as f64 * value(v)).sum::<f64>() / readings as f64
    };
    SurfaceResidual {
        stretches: count(|v| v.stretch),
        elements: count(|v| v.beam),
        readings,
        mean: weighted(Visit::mean),
        rms: weighted(Visit::mean_square).sqrt(),
    }
}
