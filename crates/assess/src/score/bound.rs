//! The Cramér–Rao bounds at the true angles: for the whole experiment, for each element from its own boards alone, and
//! which elements their own boards leave open.

use catoptric_calib::covariance::{MountUncertainty, budget};
use catoptric_calib::observability::weakness;
use catoptric_calib::observations::BoardInSensor;
use catoptric_calib::{CalibError, TrueDirection, limit};
use catoptric_calib::{locate, observations, pose};
use catoptric_model::{Dataset, Pose, PoseKind, Unreadable};
use catoptric_sim::Truth;
use catoptric_sim::truth::BeamClass;
use nalgebra::{Matrix2, Point3};
use std::collections::{BTreeMap, BTreeSet};

/// How well the elements can be known from the boards.
#[derive(Debug, Default)]
pub struct Knowable {
    /// Limit of the experiment for each beam, as a covariance of (θ_a, φ) in rad².
    pub(super) limits: BTreeMap<usize, Matrix2<f64>>,
    /// Lower bound on the covariance of (θ_a, φ), in rad², of an unbiased estimate of one element from its own boards,
    /// for every beam that is deflected once.
    pub(super) bounds: BTreeMap<usize, Matrix2<f64>>,
    /// Elements, deflected and unsplit, that their own boards leave open: fewer than two boards are hit, or the standard
    /// deviation of a direction is not below [`WEAKEST_SD`](catoptric_calib::observability::WEAKEST_SD).
    pub(super) open: BTreeSet<usize>,
}

/// Returns the true direction of every beam that is deflected once and unsplit.
pub fn true_directions(truth: &Truth) -> Vec<TrueDirection> {
    let deflected = truth.beams.iter().filter(|b| b.status == BeamClass::Deflected);
    let directions = deflected.filter_map(|b| {
        Some(TrueDirection {
            beam: b.beam,
            facet: b.facets.first()?.clone(),
            deflection: b.deflection()?,
        })
    });
    directions.collect()
}

/// Lower bound on the covariance of (θ_a, φ), in rad², of any estimate from this dataset, for every beam that is
/// deflected once and unsplit: facets, boards, mounting and biases are common to all of them.
fn of_experiment(dataset: &Dataset, truth: &Truth) -> Result<BTreeMap<usize, Matrix2<f64>>, Unreadable> {
    let believed = &dataset.session.believed;
    if believed.range_noise_sd_mm == 0.0 {
        // Nothing is believed to be in the way.
        return Ok(BTreeMap::new());
    }
    let limits = match limit(dataset, &true_directions(truth)) {
        Ok(limits) => limits,
        Err(CalibError::Unreadable(error)) => return Err(error),
        // What cannot be calibrated has no limit.
        Err(_) => BTreeMap::new(),
    };
    let known = limits.into_iter().filter_map(|(beam, c)| Some((beam, c?)));
    Ok(known.collect())
}

/// Computes how well every beam that is deflected once can be known from the boards of a dataset.
///
/// The boards are those that the true ray meets farther from the edge than its spot; the mounting is as uncertain as
/// this dataset leaves it. A method that ties elements together, by their facet, may do better.
///
/// # Errors
/// [`Unreadable`] if the recording of the dataset can no longer be read.
pub fn knowable(dataset: &Dataset, truth: &Truth) -> Result<Knowable, Unreadable> {
    let session = &dataset.session;
    let summaries = locate::summaries(dataset)?;
    let mount = pose::estimate(dataset, &summaries).uncertainty;
    let rig_from_sensor = Pose::from(&truth.rig_from_sensor);
    let boards: Vec<_> = dataset
        .poses
        .iter()
        .zip(&summaries)
        .filter(|(record, _)| record.label.kind == PoseKind::Facet)
        .filter_map(|(record, summary)| {
            Some((BoardInSensor::of(record, session, &rig_from_sensor)?, summary))
        })
        .collect();
    let cone = observations::cone_half_angle(session);
    let noise_sd = session.believed.range_noise_sd_mm * 1e-3;
    let mut knowable = Knowable {
        limits: of_experiment(dataset, truth)?,
        ..Knowable::default()
    };
    for beam in &truth.beams {
        let Some(deflection) = beam.deflection() else {
            continue;
        };
        let azimuth = observations::azimuth(session, beam.beam);
        let exit = deflection.exit_direction(azimuth);
        let origin: Point3<f64> = deflection.deflection_point(azimuth);
        let views: Vec<_> = boards
            .iter()
            .filter_map(|(board, summary)| {
                let count = summary.get(beam.beam)?.count;
                let hit = board.hit(&origin, &exit)?;
                let spot = cone * (deflection.distance + hit.distance);
                (count > 0 && board.holds(&hit, spot, 0.0)).then(|| board.view(noise_sd, count))
            })
            .collect();
        if let Some(bound) = budget(session, &mount, azimuth, &deflection, &views).and_then(|b| b.bound()) {
            knowable.bounds.insert(beam.beam, bound);
        }
        // The uncertainty of the mounting rotates all beams together, whatever the boards.
        let boards_alone = budget(session, &MountUncertainty::none(), azimuth, &deflection, &views);
        let is_open =
            views.len() < 2 || boards_alone.is_some_and(|b| weakness(&b, deflection.elevation).is_some());
        if beam.status == BeamClass::Deflected && is_open {
            knowable.open.insert(beam.beam);
        }
    }
    Ok(knowable)
}
