//! Table 1: spot extents as noted, and lines fitted to them.

use crate::readings::observations::BoardInSensor;
use catoptric_model::characterization::{SpotLaw, SpotRow};
use catoptric_model::{Dataset, Pose};

/// The noted spots, with the tracked distance of the board.
pub(super) fn rows(dataset: &Dataset, rig_from_sensor: &Pose) -> Vec<SpotRow> {
    let row = |record: &catoptric_model::PoseRecord| {
        let spot = record.label.test?.spot?;
        let seen = BoardInSensor::of(record, &dataset.session, rig_from_sensor)?;
        Some(SpotRow {
            pose: record.label.pose,
            distance_m: seen.plane.point.coords.norm(),
            spot,
        })
    };
    dataset.poses.iter().filter_map(row).collect()
}

/// Least-squares lines through the extents.
pub(super) fn law(rows: &[SpotRow]) -> Option<SpotLaw> {
    let n = rows.len() as f64;
    let mean = rows.iter().map(|r| r.distance_m).sum::<f64>() / n;
    let spread: f64 = rows.iter().map(|r| (r.distance_m - mean).powi(2)).sum();
    if rows.len() < 2 || spread == 0.0 {
        return None;
    }
    let line = |extent: &dyn Fn(&SpotRow) -> f64| {
        let middle = rows.iter().map(extent).sum::<f64>() / n;
        let slope = rows
            .iter()
            .map(|r| (r.distance_m - mean) * extent(r))
            .sum::<f64>()
            / spread;
        (slope, middle - slope * mean)
    };
    let (width_slope_mrad, width_offset_mm) = line(&|r| r.spot.width_mm);
    let (height_slope_mrad, height_offset_mm) = line(&|r| r.spot.height_mm);
    Some(SpotLaw {
        width_slope_mrad,
        width_offset_mm,
        height_slope_mrad,
        height_offset_mm,
    })
}
