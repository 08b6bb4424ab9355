//! Predicts how well the scene's own experiment can calibrate the layout, before anything is recorded.
//!
//! The bound of the whole experiment ([`limit`](fn@catoptric_calib::limit)) depends on geometry and on the number of
//! readings that each element has of each board, not on the values of their noise. So every board pose of the scene is
//! simulated once, with one ray per beam and without noise, and each reading is repeated as often as the scene says,
//! alternately above and below its noise-free value by the standard deviation of one reading. The structure is as built
//! under a seed, so that its facets have realistic slope errors.

use catoptric_assess::score::{bounds as bounds_anything, true_directions};
use catoptric_calib::{TrueDirection, limit};
use catoptric_model::{Dataset, PoseKind, PoseRecord, Readings};
use catoptric_sim::laboratory::Returns;
use catoptric_sim::{Laboratory, Scene, SimError};
use nalgebra::Matrix2;
use rayon::prelude::*;
use serde::Serialize;

/// The smallest error that any unbiased calibration from the scene's experiment can have.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Accuracy {
    /// Seed of the structure as built.
    pub seed: u64,
    /// Number of board poses of the experiment.
    pub board_poses: usize,
    /// Number of unsplit deflected elements whose boards determine both angles.
    pub determined: usize,
    /// Number of unsplit deflected elements whose boards do not.
    pub open: usize,
    /// Root mean square of the bound over the determined elements, in degrees per axis; `None` without any.
    pub per_axis_deg: Option<f64>,
    /// Largest bound of an element, in degrees per axis.
    pub worst_per_axis_deg: Option<f64>,
    /// Root mean square displacement of a point at 4 m, in millimeters.
    pub point_at_4m_mm: Option<f64>,
    /// Facet by facet.
    pub facets: Vec<FacetAccuracy>,
    /// Why there is no bound, if there is none.
    pub reason: Option<String>,
}

/// The same for one facet.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FacetAccuracy {
    /// The facet.
    pub name: String,
    /// Number of elements whose boards determine both angles.
    pub determined: usize,
    /// Number of elements whose boards do not.
    pub open: usize,
    /// Root mean square of the bound, in degrees per axis.
    pub per_axis_deg: Option<f64>,
}

/// Predicts the accuracy of a scene's own experiment on the structure as built under a seed.
///
/// If there is no bound (no boards or no room for them, no facets, errors switched off), the result holds the reason.
pub fn predict(scene: &Scene, seed: u64) -> Accuracy {
    let mut accuracy = Accuracy {
        seed,
        board_poses: 0,
        determined: 0,
        open: 0,
        per_axis_deg: None,
        worst_per_axis_deg: None,
        point_at_4m_mm: None,
        facets: Vec::new(),
        reason: None,
    };
    if let Err(reason) = find(scene, seed, &mut accuracy) {
        accuracy.reason = Some(reason);
    }
    accuracy
}

fn find(scene: &Scene, seed: u64, accuracy: &mut Accuracy) -> Result<(), String> {
    let text = |error: SimError| error.to_string();
    // The classes of elements depend on whole beams, the boards' information on directions alone.
    let truth = Laboratory::new(scene, seed)
        .and_then(|l| l.truth())
        .map_err(text)?;
    let laboratory = Laboratory::new(&sampled_once(scene), seed).map_err(text)?;
    let directions = true_directions(&truth);
    accuracy.board_poses = laboratory.board_poses();
    let session = laboratory.session().map_err(text)?;
    if directions.is_empty() {
        return Err("no element is deflected by one facet alone".to_owned());
    }
    if session.believed.range_noise_sd_mm == 0.0 {
        return Err("the scene has no errors, so nothing limits a calibration".to_owned());
    }
    let numbers: Vec<usize> = (0..laboratory.stretches()).collect();
    let readings = scene.experiment.scans_per_pose as usize;
    let poses: Result<Vec<Option<PoseRecord>>, SimError> = numbers
        .into_par_iter()
        .map(|number| record(&laboratory, number, readings))
        .collect();
    let mut dataset = Dataset {
        session,
        poses: poses.map_err(text)?.into_iter().flatten().collect(),
        id: None,
        warnings: Vec::new(),
    };
    // Omitted poses leave no gap in the numbering.
    for (number, pose) in dataset.poses.iter_mut().enumerate() {
        pose.label.pose = number;
    }
    let bounds = limit(&dataset, &directions).map_err(|error| error.to_string())?;
    let square = |d: &TrueDirection| {
        let bound: Matrix2<f64> = bounds.get(&d.beam).copied().flatten()?;
        // Along the axes cos φ·θ_a and φ.
        let cos = libm::cos(d.deflection.elevation);
        let to_tangent = Matrix2::new(cos, 0.0, 0.0, 1.0);
        let square = 0.5 * (cos * cos * bound[(0, 0)] + bound[(1, 1)]);
        bounds_anything(&(to_tangent * bound * to_tangent)).then_some(square)
    };
    let summary = |of: &dyn Fn(&TrueDirection) -> bool| {
        let some = || directions.iter().filter(|d| of(d));
        let squares: Vec<f64> = some().filter_map(square).collect();
        let mean = squares.iter().sum::<f64>() / squares.len() as f64;
        let worst = squares.iter().copied().reduce(f64::max);
        let rms = (!squares.is_empty()).then(|| mean.sqrt());
        (
            squares.len(),
            some().count() - squares.len(),
            rms,
            worst.map(f64::sqrt),
        )
    };
    let (determined, open, rms, worst) = summary(&|_| true);
    accuracy.determined = determined;
    accuracy.open = open;
    accuracy.per_axis_deg = rms.map(f64::to_degrees);
    accuracy.worst_per_axis_deg = worst.map(f64::to_degrees);
    // Both axes of a direction displace the point.
    accuracy.point_at_4m_mm = rms.map(|r| 4e3 * r * std::f64::consts::SQRT_2);
    accuracy.facets = scene
        .superstructure
        .facet
        .iter()
        .map(|facet| {
            let (determined, open, rms, _) = summary(&|d| d.facet == facet.name);
            FacetAccuracy {
                name: facet.name.clone(),
                determined,
                open,
                per_axis_deg: rms.map(f64::to_degrees),
            }
        })
        .collect();
    rms.map(|_| ())
        .ok_or_else(|| "no element is determined by the scene's boards".to_owned())
}

/// Returns the scene with one ray per beam and one scan per stretch, in which every marker is detected.
fn sampled_once(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.scanner.sub_rays = 1;
    scene.experiment.scans_per_pose = 1;
    scene.experiment.room_scans = 1;
    scene.mocap.dropout = 0.0;
    scene.flight.clear();
    scene
}

/// Returns the data that a calibration needs of a stretch, with readings spread by their noise; `None` for a stretch
/// that it does not use.
fn record(laboratory: &Laboratory, number: usize, readings: usize) -> Result<Option<PoseRecord>, SimError> {
    let returns = laboratory.returns(number)?;
    let stretch = laboratory.record(number, &returns);
    let kind = stretch.label.kind;
    if !matches!(kind, PoseKind::Direct | PoseKind::Facet) || stretch.label.test.is_some() {
        return Ok(None);
    }
    let Ok(mut record) = stretch.into_record() else {
        return Ok(None);
    };
    record.label.scans = readings;
    record.readings = Readings::in_memory(record.beams(), spread(&returns, readings));
    Ok(Some(record))
}

/// Returns the readings scan by scan: alternately above and below the noise-free range, with the sample standard
/// deviation of the noise.
fn spread(returns: &Returns, readings: usize) -> Vec<f64> {
    // An even number of values ±a has the sample variance a²·n/(n − 1).
    let share = ((readings.max(2) - 1) as f64 / readings.max(2) as f64).sqrt();
    let mut ranges = Vec::with_capacity(readings * returns.len());
    for scan in 0..readings {
        let last_of_odd = readings % 2 == 1 && scan + 1 == readings;
        let sign = match (last_of_odd, scan % 2) {
            (true, _) => 0.0,
            (false, 0) => 1.0,
            (false, _) => -1.0,
        };
        ranges.extend(returns.iter().map(|found| match found {
            Some(found) => found.range() + sign * share * found.noise_sd,
            None => f64::INFINITY,
        }));
    }
    ranges
}
