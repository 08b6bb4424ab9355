//! Rays in structure-of-arrays form. Eight at a time are transformed into another frame, by the same operations in the
//! same order as for a single ray.

use crate::lanes::{inlined, unfused};
use crate::packet::rows::{F64Rows, HALF, LANES as ROW, MOST};
use crate::ray::Ray;
use catoptric_model::Pose;
use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};
use nalgebra::{Point3, Unit, Vector3};
use std::ops::Range;

const LANES: usize = HALF;

/// Rays that are appended per block.
const BLOCK: usize = 64;

/// Rays as a structure of arrays: one array per coordinate, origins in meters, directions of length 1.
///
/// ```
/// # use catoptric_cast::{Ray, Rays};
/// # use nalgebra::{Point3, Vector3};
/// let ray = Ray { origin: Point3::new(0.0, 0.0, 0.1), direction: Vector3::x_axis() };
/// let rays: Rays = [ray, ray].into_iter().collect();
/// assert_eq!((rays.len(), rays.get(1)), (2, ray));
/// ```
#[derive(Debug, Clone, Default)]
pub struct Rays {
    count: usize,
    /// One packet longer than `count`, so that a full packet can be read from any ray on; the rest is padding, never
    /// read as data.
    origin: [Vec<f64>; 3],
    direction: [Vec<f64>; 3],
}

impl Rays {
    /// Returns the number of rays.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no rays.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Removes all rays and keeps the allocated memory.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Makes room for `more` rays and the padding.
    fn make_room(&mut self, more: usize) {
        let wanted = self.count + more + MOST;
        if self.origin[0].len() < wanted {
            for row in self.origin.iter_mut().chain(&mut self.direction) {
                row.resize(wanted, 0.0);
            }
        }
    }

    /// Appends a range of other rays.
    pub fn extend_from(&mut self, others: &Self, which: Range<usize>) {
        assert!(which.end <= others.count, "range within the rays");
        self.make_room(which.len());
        let own = self.count..self.count + which.len();
        for k in 0..3 {
            self.origin[k][own.clone()].copy_from_slice(&others.origin[k][which.clone()]);
            self.direction[k][own.clone()].copy_from_slice(&others.direction[k][which.clone()]);
        }
        self.count = own.end;
    }

    /// Appends a range of other rays, transformed into another frame: bit-identical to [`placed`](crate::placed).
    pub fn extend_placed(&mut self, others: &Self, which: Range<usize>, other_from_ray: &Pose) {
        assert!(which.end <= others.count, "range within the rays");
        self.make_room(which.len());
        let own = self.count;
        self.count += which.len();
        dispatch!(Level::new(), simd => self.place(simd, own, others, which, other_from_ray));
    }

    /// Reads and writes whole groups of eight, also beyond the last ray: the padding has room for them.
    #[inline(always)]
    fn place<S: Simd>(&mut self, simd: S, own: usize, others: &Self, which: Range<usize>, pose: &Pose) {
        let splat = inlined(
            #[inline(always)]
            |x: f64| f64x8::splat(simd, x),
        );
        let turn = pose.rotation.coords;
        let (q, w) = ([splat(turn.x), splat(turn.y), splat(turn.z)], splat(turn.w));
        let shift = &pose.translation.vector;
        let shift = [splat(shift.x), splat(shift.y), splat(shift.z)];
        let load = inlined(
            #[inline(always)]
            |rows: &[Vec<f64>; 3], from: usize| {
                [
                    f64x8::from_slice(simd, &rows[0][from..from + LANES]),
                    f64x8::from_slice(simd, &rows[1][from..from + LANES]),
                    f64x8::from_slice(simd, &rows[2][from..from + LANES]),
                ]
            },
        );
        for done in (0..which.len()).step_by(LANES) {
            let (from, to) = (which.start + done, own + done);
            let origin = rotate(simd, &q, w, &load(&others.origin, from));
            let direction = rotate(simd, &q, w, &load(&others.direction, from));
            for k in 0..3 {
                (origin[k] + shift[k]).store_slice(&mut self.origin[k][to..to + LANES]);
                direction[k].store_slice(&mut self.direction[k][to..to + LANES]);
            }
        }
    }

    /// Returns one ray.
    ///
    /// # Panics
    /// If the index is out of range.
    #[inline(always)]
    pub fn get(&self, ray: usize) -> Ray {
        assert!(ray < self.count, "ray index in range");
        let [ox, oy, oz] = &self.origin;
        let [dx, dy, dz] = &self.direction;
        Ray {
            origin: Point3::new(ox[ray], oy[ray], oz[ray]),
            // Stored with unit length; renormalizing could change the last bit.
            direction: Unit::new_unchecked(Vector3::new(dx[ray], dy[ray], dz[ray])),
        }
    }

    /// Iterates over the rays.
    pub fn iter(&self) -> impl Iterator<Item = Ray> {
        (0..self.count).map(|ray| self.get(ray))
    }

    /// Returns the origins and the directions, by axis: `R` rows from ray `from` on.
    #[inline(always)]
    pub(crate) fn rows<'a, const R: usize>(&'a self, from: usize) -> [F64Rows<'a, R>; 2] {
        let three = inlined(
            #[inline(always)]
            |of: &'a [Vec<f64>; 3]| {
                [
                    first_rows(&of[0][from..]),
                    first_rows(&of[1][from..]),
                    first_rows(&of[2][from..]),
                ]
            },
        );
        [three(&self.origin), three(&self.direction)]
    }
}

/// Returns the first `R` rows.
#[inline(always)]
fn first_rows<const R: usize>(of: &[f64]) -> &[[f64; ROW]; R] {
    match of.as_chunks().0.first_chunk() {
        Some(rows) => rows,
        None => unreachable!("the arrays are one packet longer than the rays"),
    }
}

impl Extend<Ray> for Rays {
    fn extend<T: IntoIterator<Item = Ray>>(&mut self, rays: T) {
        let mut rays = rays.into_iter();
        let mut next = rays.next();
        while next.is_some() {
            // In blocks, so that memory is checked and bounds are taken once per block.
            self.make_room(BLOCK);
            let from = self.count;
            let [x, y, z] = self.origin.each_mut().map(|row| &mut row[from..from + BLOCK]);
            let [u, v, w] = self.direction.each_mut().map(|row| &mut row[from..from + BLOCK]);
            let mut own = 0;
            while own < BLOCK
                && let Some(Ray { origin, direction }) = next
            {
                (x[own], y[own], z[own]) = (origin.x, origin.y, origin.z);
                (u[own], v[own], w[own]) = (direction.x, direction.y, direction.z);
                own += 1;
                next = rays.next();
            }
            self.count += own;
        }
    }
}

impl FromIterator<Ray> for Rays {
    fn from_iter<T: IntoIterator<Item = Ray>>(rays: T) -> Self {
        let mut all = Self::default();
        all.extend(rays);
        all
    }
}

/// t·w + q × t + v with t = 2·(q × v).
#[inline(always)]
fn rotate<S: Simd>(simd: S, q: &[f64x8<S>; 3], w: f64x8<S>, v: &[f64x8<S>; 3]) -> [f64x8<S>; 3] {
    let two = f64x8::splat(simd, 2.0);
    let t = unfused::cross(q, v);
    let t = [t[0] * two, t[1] * two, t[2] * two];
    let across = unfused::cross(q, &t);
    [
        t[0] * w + across[0] + v[0],
        t[1] * w + across[1] + v[1],
        t[2] * w + across[2] + v[2],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::placed;
    use nalgebra::{Translation3, UnitQuaternion};

    #[test]
    fn many_rays_transform_bit_identically_to_single_rays() {
        let pose = Pose::from_parts(
            Translation3::new(0.3, -1.7, 2.9),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7)),
        );
        let ray = |i: u32| {
            let x = f64::from(i);
            Ray {
                origin: Point3::new(0.01 * x, -0.003 * x * x, 0.1 / (1.0 + x)),
                direction: Unit::new_normalize(Vector3::new(1.0, 0.1 * x, -0.07 * x * x)),
            }
        };
        let all: Rays = (0..64).map(ray).collect();
        let mut moved = Rays::default();
        for count in [0, 1, 7, 8, 9, 19, 61] {
            moved.clear();
            // At an offset in both source and destination.
            moved.extend([ray(0)]);
            moved.extend_placed(&all, 3..3 + count, &pose);
            let each: Vec<Ray> = (3..3 + count).map(|i| placed(&all.get(i), &pose)).collect();
            assert_eq!(moved.iter().skip(1).collect::<Vec<_>>(), each, "{count} rays");
        }
    }
}
