//! The Cramér–Rao bounds at the true angles: for the whole experiment, for each element from its own boards alone, and
//! which elements their own boards leave open.

use catoptric_calib::covariance::{MountUncertainty, budget};
use catoptric_calib::observability::{WEAKEST_SD, weakness};
use catoptric_calib::observations::BoardInSensor;
use catoptric_calib::{CalibError, MIN_BOARDS, TrueDirection, limit};
use catoptric_calib::{locate, observations, pose};
use catoptric_model::{Dataset, Pose, PoseKind, PoseLabel, Unreadable};
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
    /// Elements, deflected and unsplit, whose own boards determine both angles well.
    pub(super) well: BTreeSet<usize>,
}

/// Standard deviation up to which boards determine a direction well, in radians (1°).
const WELL_KNOWN_SD: f64 = std::f64::consts::PI / 180.0;

/// Whether a bound on (cos φ·δθ, δφ) bounds anything: its largest standard deviation is not above
/// [`WEAKEST_SD`](catoptric_calib::observability::WEAKEST_SD), beyond which the linearized bound of an open direction has
/// no meaning.
pub fn bounds(bound: &Matrix2<f64>) -> bool {
    largest_sd(bound) <= WEAKEST_SD
}

/// Standard deviation along the axis where it is largest.
pub(super) fn largest_sd(covariance: &Matrix2<f64>) -> f64 {
    covariance.symmetric_eigenvalues().max().max(0.0).sqrt()
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
    let mut directions = true_directions(truth);
    directions.retain(|d| d.beam < dataset.session.scanner.scan.beams());
    let limits = match limit(dataset, &directions) {
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
            Some((
                BoardInSensor::of(record, session, &rig_from_sensor)?,
                summary,
                &record.label,
            ))
        })
        .collect();
    let cone = observations::cone_half_angle(session);
    let mut knowable = Knowable {
        limits: of_experiment(dataset, truth)?,
        ..Knowable::default()
    };
    for beam in truth
        .beams
        .iter()
        .filter(|b| b.beam < session.scanner.scan.beams())
    {
        let Some(deflection) = beam.deflection() else {
            continue;
        };
        let azimuth = observations::azimuth(session, beam.beam);
        let exit = deflection.exit_direction(azimuth);
        let origin: Point3<f64> = deflection.deflection_point(azimuth);
        let seen: Vec<_> = boards
            .iter()
            .filter_map(|(board, summary, label)| {
                let count = summary.get(beam.beam)?.count;
                let hit = board.hit(&origin, &exit)?;
                let spot = cone * (deflection.distance + hit.distance);
                let noise_sd = session
                    .believed
                    .noise_sd(deflection.distance + hit.distance, &board.color);
                (count > 0 && board.holds(&hit, spot, 0.0)).then(|| (board.view(noise_sd, count), *label))
            })
            .collect();
        let views: Vec<_> = seen.iter().map(|(view, _)| *view).collect();
        if let Some(bound) = budget(session, &mount, azimuth, &deflection, &views).and_then(|b| b.bound()) {
            knowable.bounds.insert(beam.beam, bound);
        }
        // The uncertainty of the mounting rotates all beams together, whatever the boards.
        let boards_alone = budget(session, &MountUncertainty::none(), azimuth, &deflection, &views);
        let is_open = views.len() < 2
            || boards_alone
                .as_ref()
                .is_some_and(|b| weakness(b, deflection.elevation).is_some());
        if beam.status != BeamClass::Deflected {
            continue;
        }
        // A board that was set up for another facet may be hit by accident; nobody has to use it.
        let meant = |label: &PoseLabel| label.facet.as_ref().is_none_or(|name| beam.facets.contains(name));
        let meant: Vec<_> = seen
            .iter()
            .filter(|(_, label)| meant(label))
            .map(|(view, _)| *view)
            .collect();
        let boards_meant = budget(session, &MountUncertainty::none(), azimuth, &deflection, &meant);
        let cos = deflection.elevation.cos();
        let to_tangent = Matrix2::new(cos, 0.0, 0.0, 1.0);
        // Without believed errors there is no bound, and whatever is not open is known.
        let alone = boards_meant
            .and_then(|b| b.bound())
            .map(|b| to_tangent * b * to_tangent);
        let well = alone.is_none_or(|b| largest_sd(&b) <= WELL_KNOWN_SD);
        if is_open {
            knowable.open.insert(beam.beam);
        } else if meant.len() >= MIN_BOARDS && well {
            knowable.well.insert(beam.beam);
        }
    }
    Ok(knowable)
}
