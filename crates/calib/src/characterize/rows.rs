//! One row for every stretch: the reading of the beam nearest to the board's center.

use crate::mount::mount_data::{DirectBoard, Selector};
use crate::readings::observations::{BoardInSensor, azimuth};
use catoptric_model::characterization::StretchRow;
use catoptric_model::frame::tangent_basis;
use catoptric_model::{Dataset, Pose, Summary, beam};

/// The rows of selected boards, in the order of recording.
pub(super) fn of(
    dataset: &Dataset,
    summaries: &[Vec<Summary>],
    selector: &Selector,
    chosen: &[DirectBoard],
    rig_from_sensor: &Pose,
) -> Vec<StretchRow> {
    let row = |board: &DirectBoard| {
        let record = &dataset.poses[board.pose];
        let seen = BoardInSensor::of(record, &dataset.session, rig_from_sensor)?;
        let block = selector.linearize(board, rig_from_sensor)?;
        let off_center = |beam: usize| {
            let u = beam::direction(azimuth(&dataset.session, beam));
            let hit = seen.hit(&nalgebra::Point3::origin(), &u);
            hit.map_or(f64::INFINITY, |hit| hit.in_board.coords.norm())
        };
        let beams = board.rays.iter().map(|r| r.beam).enumerate();
        let (index, beam) = beams.min_by(|a, b| off_center(a.1).total_cmp(&off_center(b.1)))?;
        let sighting = block.sightings[index];
        let u = beam::direction(azimuth(&dataset.session, beam));
        // The normal on the sensor's side, and whether it is turned toward larger azimuths.
        let toward = seen.plane.normal.into_inner() * -seen.plane.normal.dot(&u).signum();
        let side = if toward.dot(&tangent_basis(&u).0) < 0.0 {
            -1.0
        } else {
            1.0
        };
        let summary = &summaries[board.pose][beam];
        let test = record.label.test;
        Some(StretchRow {
            pose: record.label.pose,
            test: test.map(|t| t.kind),
            setting: test.map(|t| t.setting),
            trial: test.map(|t| t.trial),
            board: record.label.board.clone()?,
            color: block.color.clone(),
            beam,
            distance_m: sighting.distance,
            incidence_deg: side * libm::acos(sighting.cos_incidence).to_degrees(),
            readings: summary.count,
            mean_error_mm: (sighting.mean.0 - sighting.distance) * 1e3,
            sd_mm: summary.sd * 1e3,
        })
    };
    chosen.iter().filter_map(row).collect()
}
