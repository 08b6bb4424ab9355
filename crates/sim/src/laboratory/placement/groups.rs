//! Cuts the beams of a scan into groups, one board for each: beams that the same facet deflects, or undeflected neighbors.

use crate::light::optics::{End, RayPath};
use crate::scene::Board;
use catoptric_cast::Ray;
use catoptric_model::{Pose, Rectangle, ScanGeometry};
use nalgebra::Unit;

/// Margin of a board's edge that no beam of its group should hit, in meters, and its growth with distance: beams leave
/// up to a few degrees off the drawing.
const EDGE_MARGIN: (f64, f64) = (0.02, 0.05);

/// Beams that one board serves.
pub(super) struct Group {
    pub(super) facet: Option<usize>,
    pub(super) first: usize,
    pub(super) last: usize,
    /// The rays of the group's beams that leave toward the board, in the room frame.
    pub(super) rays: Vec<Ray>,
}

/// Narrowest undeflected sector in which boards are set up, in radians.
const MIN_SECTOR: f64 = 20.0 * std::f64::consts::PI / 180.0;

/// The facet by which a chief ray leaves, if it leaves by exactly one.
fn leaves_by(path: &RayPath) -> Option<usize> {
    match (path.end, path.facets()) {
        (End::Escaped, &[facet]) => Some(facet),
        _ => None,
    }
}

/// First and last beam of every facet in the drawing.
pub fn served_beams(paths: &[RayPath], facets: usize, scan: &ScanGeometry) -> Vec<Option<[usize; 2]>> {
    (0..facets)
        .map(|facet| {
            let served = (0..paths.len()).filter(|&b| leaves_by(&paths[b]) == Some(facet));
            scan.shortest_run(&served.collect::<Vec<_>>())
        })
        .collect()
}

/// Each facet's beams, cut into equal groups no wider than the span.
pub(super) fn facet_groups(
    paths: &[RayPath],
    scan: &ScanGeometry,
    facets: usize,
    span_deg: f64,
) -> Vec<(usize, usize, usize)> {
    let mut groups = Vec::new();
    for (facet, served) in served_beams(paths, facets, scan).into_iter().enumerate() {
        let Some(served) = served else { continue };
        for [first, last] in cut(scan, served, span_deg) {
            groups.push((facet, first, last));
        }
    }
    groups
}

/// A run of beams cut into the fewest equal pieces no wider than the span.
fn cut(scan: &ScanGeometry, run: [usize; 2], span_deg: f64) -> Vec<[usize; 2]> {
    let run: Vec<usize> = scan.run(run).collect();
    let beams = run.len();
    let span = span_deg.to_radians() / scan.step();
    // Both are small positive numbers.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let pieces = ((beams as f64 / span).ceil() as usize).clamp(1, beams);
    (0..pieces)
        .map(|k| [run[beams * k / pieces], run[beams * (k + 1) / pieces - 1]])
        .collect()
}

/// Runs of undeflected beams around the board centers, spread over the free sectors.
pub(super) fn direct_groups(
    paths: &[RayPath],
    scan: &ScanGeometry,
    count: usize,
    span_deg: f64,
) -> Vec<[usize; 2]> {
    let sectors = free_sectors(paths, scan);
    let total: usize = sectors.iter().map(Vec::len).sum();
    if total == 0 {
        return Vec::new();
    }
    // Centers evenly over the free beams laid end to end. Successive poses jump by a third of the way, so that
    // neighbors in tilt are not neighbors in azimuth.
    let half = 0.5 * span_deg.to_radians() / scan.step();
    (0..count)
        .map(|k| {
            let slot = (k % 3) * count.div_ceil(3) + k / 3;
            let along = (2 * (slot % count) + 1) * total / (2 * count);
            let mut rest = along;
            let sector = sectors.iter().find(|s| {
                let here = rest < s.len();
                if !here {
                    rest -= s.len();
                }
                here
            });
            let sector = sector.unwrap_or(&sectors[0]);
            let center = rest;
            // Small positive number.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let half = half as usize;
            [
                sector[center.saturating_sub(half)],
                sector[(center + half).min(sector.len() - 1)],
            ]
        })
        .collect()
}

/// The beams of every undeflected sector that is wide enough for a board, in the order of the scan.
fn free_sectors(paths: &[RayPath], scan: &ScanGeometry) -> Vec<Vec<usize>> {
    let free = |b: usize| matches!(paths[b].end, End::Escaped) && paths[b].facets().is_empty();
    let mut sectors: Vec<Vec<usize>> = Vec::new();
    for b in (0..paths.len()).filter(|&b| free(b)) {
        match sectors.last_mut() {
            Some(sector) if sector.last().is_some_and(|last| last + 1 == b) => sector.push(b),
            _ => sectors.push(vec![b]),
        }
    }
    // A sector that goes over the seam of a scan that closes is one.
    let meet = |sectors: &[Vec<usize>]| {
        let ends = sectors.first().zip(sectors.last());
        let ends = ends.and_then(|(first, last)| first.first().zip(last.last()));
        sectors.len() > 1 && ends.is_some_and(|(first, last)| scan.neighbors(*last)[1] == Some(*first))
    };
    if meet(&sectors) {
        let first = sectors.remove(0);
        if let Some(last) = sectors.last_mut() {
            last.extend(first);
        }
    }
    sectors.retain(|s| (s.len() - 1) as f64 * scan.step() >= MIN_SECTOR);
    sectors
}

impl Group {
    pub(super) fn new(
        facet: Option<usize>,
        scan: &ScanGeometry,
        [first, last]: [usize; 2],
        paths: &[RayPath],
        room_from_sensor: &Pose,
    ) -> Self {
        let leaves = |path: &RayPath| match facet {
            Some(_) => leaves_by(path) == facet,
            None => path.facets().is_empty() && matches!(path.end, End::Escaped),
        };
        let rays = scan
            .run([first, last])
            .map(|beam| &paths[beam])
            .filter(|p| leaves(p))
            .map(|p| Ray {
                origin: room_from_sensor * p.last.origin,
                direction: Unit::new_unchecked(room_from_sensor.rotation * p.last.direction.into_inner()),
            })
            .collect();
        Self {
            facet,
            first,
            last,
            rays,
        }
    }

    /// The ray of the middle beam.
    pub(super) fn middle(&self) -> Option<&Ray> {
        self.rays.get(self.rays.len() / 2)
    }

    /// Share of the group's rays that hit a board well inside its edges.
    pub(super) fn caught(&self, board: &Board, room_from_board: &Pose) -> f64 {
        let outline = Rectangle {
            width: board.width_mm * 1e-3,
            height: board.height_mm * 1e-3,
        };
        let inside = |ray: &&Ray| {
            let origin = room_from_board.inverse_transform_point(&ray.origin);
            let direction = room_from_board.inverse_transform_vector(&ray.direction);
            let distance = -origin.z / direction.z;
            distance > 0.0
                && outline.contains(
                    &(origin + direction * distance),
                    EDGE_MARGIN.0 + EDGE_MARGIN.1 * distance,
                )
        };
        self.rays.iter().filter(inside).count() as f64 / self.rays.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_cover_their_run_without_overlap() {
        let ust = ScanGeometry::default();
        let groups = cut(&ust, [100, 279], 16.0);
        assert_eq!(groups, vec![[100, 159], [160, 219], [220, 279]]);
        assert_eq!(cut(&ust, [5, 5], 16.0), vec![[5, 5]]);
    }
}
