//! Residuals that need no truth: distances of lifted points from surveyed boards and walls.

use catoptric_calib::observations::{self, BoardInSensor};
use catoptric_calib::tracking;
use catoptric_model::{
    BeamEstimate, Calibration, CorrectedRange, Dataset, Deflection, Pose, PoseKind, PoseRecord,
};
use catoptric_model::{RangeBias, RawRange, Unreadable};
use nalgebra::Unit;
use rayon::prelude::*;
use serde::Serialize;

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

/// The surface that a beam is expected to hit.
struct Surface {
    predicted: f64,
    cos_incidence: f64,
    color: String,
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
/// spot. A reading there is corrected by all terms of Eq. (3), since board and incidence are known, and its residual is
/// the distance of the lifted point from the board's plane, cos θ_N·(r − d − s).
///
/// # Errors
/// [`Unreadable`] if the recording can no longer be read.
pub fn boards(dataset: &Dataset, calibration: &Calibration) -> Result<SurfaceResidual, Unreadable> {
    // A label on the wrong marker puts a board where it was not.
    let (dataset, _) = tracking::put_right(dataset);
    let dataset = dataset.as_ref();
    let rig_from_sensor = mount(dataset, calibration);
    let cone = observations::cone_half_angle(&dataset.session);
    collect(dataset, calibration, PoseKind::Facet, |pose| {
        let board = BoardInSensor::of(pose, &dataset.session, &rig_from_sensor);
        move |beam: usize, deflection: &Deflection| {
            let board = board.as_ref()?;
            let azimuth = observations::azimuth(&dataset.session, beam);
            let exit = deflection.exit_direction(azimuth);
            let hit = board.hit(&deflection.deflection_point(azimuth), &exit)?;
            let predicted = deflection.distance + hit.distance;
            board.holds(&hit, cone * predicted, 0.0).then(|| Surface {
                predicted,
                cos_incidence: board.plane.cos_incidence(&exit),
                color: board.color.clone(),
            })
        }
    })
}

/// Point-to-wall residual of every reading of the solved elements in the empty room: data no method fits angles to.
///
/// # Errors
/// As [`boards`].
pub fn walls(dataset: &Dataset, calibration: &Calibration) -> Result<SurfaceResidual, Unreadable> {
    let rig_from_sensor = mount(dataset, calibration);
    collect(dataset, calibration, PoseKind::Room, |pose| {
        let room_from_sensor = pose.room_from_rig * rig_from_sensor;
        move |beam: usize, deflection: &Deflection| {
            let room = dataset.session.room.as_ref()?;
            let azimuth = observations::azimuth(&dataset.session, beam);
            let origin = room_from_sensor * deflection.deflection_point(azimuth);
            let exit = deflection.exit_direction(azimuth);
            let exit = Unit::new_unchecked(room_from_sensor * exit.into_inner());
            let (s, wall) = room.cast(&origin, &exit)?;
            Some(Surface {
                predicted: deflection.distance + s,
                cos_incidence: wall.cos_incidence(&exit),
                color: room.color.clone(),
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
) -> Result<SurfaceResidual, Unreadable>
where
    E: Fn(usize, &Deflection) -> Option<Surface>,
{
    let bias = bias(dataset, calibration);
    let of_stretch = |record: &&PoseRecord| {
        let expect = expect(record);
        let visit = |estimate: &BeamEstimate| {
            Some(Visit {
                beam: estimate.beam,
                stretch: record.label.pose,
                on: expect(estimate.beam, &estimate.deflection()?)?,
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
    Ok(summarize(&visits.into_iter().flatten().collect::<Vec<_>>()))
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
