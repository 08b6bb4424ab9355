//! White noise by color and distance: Table 4, and the spread in Table 2.

use crate::mount_data::{DirectBoard, Selector};
use catoptric_model::characterization::NoiseRow;
use catoptric_model::{Dataset, Pose, Summary, TestKind};

/// Cosine of the largest incidence at which a reading counts as one of a face-on board.
const FACE_ON: f64 = 0.95;

/// Largest difference from a board's own distance, in parts of it, at which a reading counts as one at that distance.
const SAME_DISTANCE: f64 = 0.03;

/// Pooled over trials and over the beams that meet a board face on, setting by setting.
pub(super) fn table(
    dataset: &Dataset,
    summaries: &[Vec<Summary>],
    selector: &Selector,
    chosen: &[DirectBoard],
    rig_from_sensor: &Pose,
) -> Vec<NoiseRow> {
    let mut rows: Vec<(usize, NoiseRow, f64, f64)> = Vec::new();
    for board in chosen {
        let tested = dataset.poses[board.pose].label.test;
        let tested = tested.filter(|t| matches!(t.kind, TestKind::Distance | TestKind::Color));
        let (Some(test), Some(block)) = (tested, selector.linearize(board, rig_from_sensor)) else {
            continue;
        };
        let nearest = block
            .sightings
            .iter()
            .map(|s| s.distance)
            .fold(f64::INFINITY, f64::min);
        for (ray, seen) in board.rays.iter().zip(&block.sightings) {
            let summary = &summaries[board.pose][ray.beam];
            let same = seen.distance - nearest <= SAME_DISTANCE * nearest;
            if seen.cos_incidence < FACE_ON || !same || summary.count < 2 {
                continue;
            }
            let freedom = summary.count - 1;
            let squares = summary.sd * summary.sd * freedom as f64;
            let row = match rows.iter_mut().find(|(setting, ..)| *setting == test.setting) {
                Some(row) => row,
                None => {
                    let row = NoiseRow {
                        color: block.color.clone(),
                        distance_m: 0.0,
                        sd_mm: 0.0,
                        degrees_of_freedom: 0,
                    };
                    rows.push((test.setting, row, 0.0, 0.0));
                    let last = rows.len() - 1;
                    &mut rows[last]
                }
            };
            row.1.degrees_of_freedom += freedom;
            row.2 += squares;
            row.3 += freedom as f64 * seen.distance;
        }
    }
    rows.into_iter()
        .map(|(_, row, squares, distances)| {
            let freedom = row.degrees_of_freedom as f64;
            NoiseRow {
                distance_m: distances / freedom,
                sd_mm: (squares / freedom).sqrt() * 1e3,
                ..row
            }
        })
        .collect()
}
