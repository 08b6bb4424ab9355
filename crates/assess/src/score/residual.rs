//! Residuals that need no truth: distances of lifted points from surveyed boards and walls.

use super::statistics::{mean, rms};
use catoptric_calib::observations::{self, BoardInSensor};
use catoptric_calib::tracking;
use catoptric_model::{Calibration, CorrectedRange, Dataset, Deflection, Pose, PoseKind, PoseRecord};
use catoptric_model::{RangeBias, RawRange, beam};
use nalgebra::Unit;
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

/// Mean and mean square of one element's residuals over one stretch.
struct Visit {
    beam: usize,
    stretch: usize,
    readings: usize,
    mean: f64,
    mean_square: f64,
}

/// Point-to-board residuals of the readings of the solved elements on the boards of their facets.
///
/// An element is on a board if its outgoing ray, as calibrated, hits the board's face farther from the edge than its
/// spot. A reading there is corrected by all terms of Eq. (3), since board and incidence are known, and its residual is
/// the distance of the lifted point from the board's plane, cos θ_N·(r − d − s).
pub fn boards(dataset: &Dataset, calibration: &Calibration) -> SurfaceResidual {
    // A label on the wrong marker would misplace a board.
    let (dataset, _) = tracking::put_right(dataset);
    let dataset = dataset.as_ref();
    let rig_from_sensor = mount(dataset, calibration);
    let cone = observations::cone_half_angle(&dataset.session);
    collect(dataset, calibration, PoseKind::Facet, |pose| {
        let board = BoardInSensor::of(pose, &dataset.session, &rig_from_sensor);
        move |beam: usize, deflection: &Deflection| {
            let board = board.as_ref()?;
            let exit = deflection.exit_direction(beam::azimuth(beam));
            let hit = board.hit(&deflection.deflection_point(beam::azimuth(beam)), &exit)?;
            let predicted = deflection.distance + hit.distance;
            board.holds(&hit, cone * predicted, 0.0).then(|| Surface {
                predicted,
                cos_incidence: board.plane.cos_incidence(&exit),
                color: board.color.clone(),
            })
        }
    })
}

/// Point-to-wall residuals of the readings of the solved elements in the empty room, to which no method fits angles.
pub fn walls(dataset: &Dataset, calibration: &Calibration) -> SurfaceResidual {
    let rig_from_sensor = mount(dataset, calibration);
    collect(dataset, calibration, PoseKind::Room, |pose| {
        let room_from_sensor = pose.room_from_rig * rig_from_sensor;
        move |beam: usize, deflection: &Deflection| {
            let room = dataset.session.room.as_ref()?;
            let origin = room_from_sensor * deflection.deflection_point(beam::azimuth(beam));
            let exit = deflection.exit_direction(beam::azimuth(beam));
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
    expect: impl Fn(&PoseRecord) -> E,
) -> SurfaceResidual
where
    E: Fn(usize, &Deflection) -> Option<Surface>,
{
    let bias = bias(dataset, calibration);
    let mut visits = Vec::new();
    for pose in dataset.of_kind(kind) {
        let expect = expect(pose);
        for estimate in calibration.beams.iter().filter(|b| b.beam < pose.beams) {
            let Some(deflection) = estimate.deflection() else {
                continue;
            };
            let Some(on) = expect(estimate.beam, &deflection) else {
                continue;
            };
            let residuals: Vec<f64> = pose
                .readings(estimate.beam)
                .filter(|r| r.is_finite())
                .map(|r| {
                    let CorrectedRange(corrected) =
                        bias.correct(RawRange(r), on.predicted, on.cos_incidence, &on.color);
                    on.cos_incidence * (corrected - on.predicted) * 1e3
                })
                .collect();
            if !residuals.is_empty() {
                visits.push(Visit {
                    beam: estimate.beam,
                    stretch: pose.label.pose,
                    readings: residuals.len(),
                    mean: mean(residuals.iter().copied()),
                    mean_square: rms(residuals.iter().copied()).powi(2),
                });
            }
        }
    }
    summarize(&visits)
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
        mean: weighted(|v| v.mean),
        rms: weighted(|v| v.mean_square).sqrt(),
    }
}
