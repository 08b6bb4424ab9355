//! White noise by color and distance: Table 4, and the spread in Table 2.

use crate::mount::mount_data::{DirectBoard, Selector};
use catoptric_model::characterization::NoiseRow;
use catoptric_model::{Dataset, Pose, Summary, TestKind};

/// Cosine of the largest incidence at which a board counts as face-on.
const FACE_ON: f64 = 0.95;

/// Largest difference from a board's own distance, relative to it, at which a reading counts as one at that distance.
const SAME_DISTANCE: f64 = 0.03;

/// Readings of one setting.
struct Pool {
    setting: usize,
    color: String,
    freedom: usize,
    /// Sums over the degrees of freedom: of squared deviations, and of distances.
    squares: f64,
    distances: f64,
}

/// Noise pooled over trials and over the beams that hit a board face-on, one setting at a time.
pub(super) fn table(
    dataset: &Dataset,
    summaries: &[Vec<Summary>],
    selector: &Selector,
    chosen: &[DirectBoard],
    rig_from_sensor: &Pose,
) -> Vec<NoiseRow> {
    let mut pools: Vec<Pool> = Vec::new();
    for board in chosen {
        let tested = dataset.poses[board.pose].label.test;
        let tested = tested.filter(|t| matches!(t.kind, TestKind::Distance | TestKind::Color));
        let (Some(test), Some(block)) = (tested, selector.linearize(board, rig_from_sensor)) else {
            continue;
        };
        let mut of_board = Pool {
            setting: test.setting,
            color: block.color,
            freedom: 0,
            squares: 0.0,
            distances: 0.0,
        };
        let distances = block.sightings.iter().map(|s| s.distance);
        let nearest = distances.fold(f64::INFINITY, f64::min);
        for (ray, seen) in board.rays.iter().zip(&block.sightings) {
            let summary = &summaries[board.pose][ray.beam];
            let same = seen.distance - nearest <= SAME_DISTANCE * nearest;
            if seen.cos_incidence >= FACE_ON && same && summary.count > 1 {
                let freedom = summary.count - 1;
                of_board.freedom += freedom;
                of_board.squares += summary.sd * summary.sd * freedom as f64;
                of_board.distances += freedom as f64 * seen.distance;
            }
        }
        match pools.iter_mut().find(|p| p.setting == of_board.setting) {
            Some(pool) => {
                pool.freedom += of_board.freedom;
                pool.squares += of_board.squares;
                pool.distances += of_board.distances;
            }
            None if of_board.freedom > 0 => pools.push(of_board),
            None => {}
        }
    }
    let row = |pool: Pool| {
        let freedom = pool.freedom as f64;
        NoiseRow {
            color: pool.color,
            distance_m: pool.distances / freedom,
            sd_mm: (pool.squares / freedom).sqrt() * 1e3,
            degrees_of_freedom: pool.freedom,
        }
    };
    pools.into_iter().map(row).collect()
}
