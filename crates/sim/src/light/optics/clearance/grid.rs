//! A grid of the cells that hold part of a mesh: a room that is a single mesh surrounds the sensor without being near
//! it.

use nalgebra::{Point3, Vector3};
use std::ops::RangeInclusive;

/// Maximum number of cells along the longest side of a mesh.
const MAX_CELLS: f64 = 128.0;

/// Minimum side of a cell, in meters.
const MIN_SIDE: f64 = 0.05;

/// A grid over a mesh.
#[derive(Debug, Clone)]
pub(in crate::light::optics) struct Grid {
    low: Point3<f64>,
    high: Point3<f64>,
    side: f64,
    counts: [usize; 3],
    taken: Vec<bool>,
}

impl Grid {
    /// The grid of triangles that are between two corners.
    pub(super) fn of(
        triangles: impl Iterator<Item = [Point3<f64>; 3]>,
        (low, high): (&Point3<f64>, &Point3<f64>),
    ) -> Self {
        let size = high - low;
        let side = (size.max() / MAX_CELLS).max(MIN_SIDE);
        // At most MAX_CELLS + 1.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let counts = [0, 1, 2].map(|k| (size[k] / side).floor() as usize + 1);
        let mut grid = Self {
            low: *low,
            high: *high,
            side,
            counts,
            taken: vec![false; counts.iter().product()],
        };
        for triangle in triangles {
            grid.add(&triangle);
        }
        grid
    }

    fn add(&mut self, [a, b, c]: &[Point3<f64>; 3]) {
        let [xs, ys, zs] = self.cells(&a.inf(b).inf(c), &a.sup(b).sup(c));
        let normal = (b - a).cross(&(c - a));
        // A plane is in a cell only if it is closer to the cell's center than the corners are.
        let reach = normal.norm() * self.side * 0.867;
        let middle = self.low + Vector3::repeat(0.5 * self.side) - a;
        for z in zs {
            for y in ys.clone() {
                for x in xs.clone() {
                    let from = middle + Vector3::new(x as f64, y as f64, z as f64) * self.side;
                    if normal.dot(&from).abs() <= reach {
                        let number = self.number(x, y, z);
                        self.taken[number] = true;
                    }
                }
            }
        }
    }

    /// Whether no triangle is within a distance of a point, in meters; false in case of doubt.
    pub(super) fn is_beyond(&self, point: &Point3<f64>, distance: f64) -> bool {
        let out = (self.low - point)
            .sup(&(point - self.high))
            .sup(&Vector3::zeros());
        if out.norm() > distance {
            return true;
        }
        let around = Vector3::repeat(distance);
        let [xs, ys, zs] = self.cells(&(point - around), &(point + around));
        zs.into_iter().all(|z| {
            ys.clone()
                .all(|y| xs.clone().all(|x| !self.taken[self.number(x, y, z)]))
        })
    }

    fn number(&self, x: usize, y: usize, z: usize) -> usize {
        x + self.counts[0] * (y + self.counts[1] * z)
    }

    /// The cells between two corners; positions beyond the border count as border cells.
    fn cells(&self, low: &Point3<f64>, high: &Point3<f64>) -> [RangeInclusive<usize>; 3] {
        [0, 1, 2].map(|k| {
            let last = (self.counts[k] - 1) as f64;
            // Clamped to the grid.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let cell = |x: f64| ((x - self.low[k]) / self.side).floor().clamp(0.0, last) as usize;
            cell(low[k])..=cell(high[k])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_within_a_distance_is_overlooked_and_the_middle_of_a_room_is_clear() {
        let corner = |i: usize| {
            let of = |bit: usize, far: f64| if i & bit == 0 { 0.0 } else { far };
            Point3::new(of(1, 8.0), of(2, 6.0), of(4, 3.0))
        };
        // Floor, a wall, and a slope through the room.
        let triangles = [[0, 1, 2], [1, 3, 2], [0, 1, 4], [1, 5, 4], [0, 2, 7]].map(|t| t.map(corner));
        let grid = Grid::of(triangles.iter().copied(), (&corner(0), &corner(7)));
        let step = |i: u32, far: f64| f64::from(i) * far / 16.0;
        let mut clear = 0;
        for i in 0..=16 {
            for j in 0..=16 {
                for k in 0..=16 {
                    let point = Point3::new(step(i, 8.0), step(j, 6.0), step(k, 3.0));
                    for distance in [0.01, 0.2, 0.7] {
                        let near = triangles.iter().any(|t| is_within(&point, t, distance));
                        let beyond = grid.is_beyond(&point, distance);
                        assert!(!(near && beyond), "{point} {distance}");
                        clear += u32::from(beyond);
                    }
                }
            }
        }
        assert!(clear > 3000, "{clear}");
        assert!(grid.is_beyond(&Point3::new(-1.0, 1.0, 0.0), 0.9));
    }

    /// Whether one of many points of a triangle is within a distance.
    fn is_within(point: &Point3<f64>, [a, b, c]: &[Point3<f64>; 3], distance: f64) -> bool {
        let steps = 24_u32;
        let share = |i: u32| f64::from(i) / f64::from(steps);
        (0..=steps).any(|i| {
            (0..=steps - i).any(|j| {
                let on = a + (b - a) * share(i) + (c - a) * share(j);
                (on - point).norm() <= distance
            })
        })
    }
}
