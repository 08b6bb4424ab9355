//! Rays moved into another frame: one, or eight at a time with the same operations in the same order.

use crate::footprint::Ray;
use catoptric_model::Pose;
use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};

const LANES: usize = 8;

/// A ray moved into another frame.
pub(super) fn placed(ray: &Ray, other_from_ray: &Pose) -> Ray {
    Ray {
        origin: other_from_ray * ray.origin,
        direction: other_from_ray * ray.direction,
    }
}

/// Appends rays moved into another frame: what [`placed`] makes of each of them, to the bit.
pub(super) fn place_all(rays: &[Ray], other_from_ray: &Pose, out: &mut Vec<Ray>) {
    let first = out.len();
    out.extend_from_slice(rays);
    let (groups, rest) = out[first..].as_chunks_mut::<LANES>();
    dispatch!(Level::new(), simd => place(simd, groups, other_from_ray));
    for ray in rest {
        *ray = placed(ray, other_from_ray);
    }
}

#[inline(always)]
fn place<S: Simd>(simd: S, groups: &mut [[Ray; LANES]], pose: &Pose) {
    let turn = pose.rotation.coords;
    let turn = splat(simd, [turn.x, turn.y, turn.z, turn.w]);
    let shift = splat(simd, pose.translation.vector.into());
    for group in groups {
        let (mut origins, mut directions) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, ray) in group.iter().enumerate() {
            for k in 0..3 {
                origins[k][lane] = ray.origin[k];
                directions[k][lane] = ray.direction[k];
            }
        }
        let turned = rotate(simd, &turn, &origins);
        for k in 0..3 {
            (turned[k] + shift[k]).store_slice(&mut origins[k]);
        }
        let turned = rotate(simd, &turn, &directions);
        for k in 0..3 {
            turned[k].store_slice(&mut directions[k]);
        }
        for (lane, ray) in group.iter_mut().enumerate() {
            for k in 0..3 {
                ray.origin[k] = origins[k][lane];
                ray.direction.as_mut_unchecked()[k] = directions[k][lane];
            }
        }
    }
}

#[inline(always)]
fn splat<S: Simd, const N: usize>(simd: S, of: [f64; N]) -> [f64x8<S>; N] {
    let mut all = [f64x8::splat(simd, 0.0); N];
    for k in 0..N {
        all[k] = f64x8::splat(simd, of[k]);
    }
    all
}

/// t·w + q × t + v with t = 2·(q × v), not fused, as for a vector alone.
#[inline(always)]
fn rotate<S: Simd>(simd: S, [x, y, z, w]: &[f64x8<S>; 4], v: &[[f64; LANES]; 3]) -> [f64x8<S>; 3] {
    let v = [
        f64x8::simd_from(simd, v[0]),
        f64x8::simd_from(simd, v[1]),
        f64x8::simd_from(simd, v[2]),
    ];
    let (q, two) = ([*x, *y, *z], f64x8::splat(simd, 2.0));
    let t = cross(&q, &v);
    let t = [t[0] * two, t[1] * two, t[2] * two];
    let across = cross(&q, &t);
    [
        t[0] * *w + across[0] + v[0],
        t[1] * *w + across[1] + v[1],
        t[2] * *w + across[2] + v[2],
    ]
}

#[inline(always)]
fn cross<S: Simd>(a: &[f64x8<S>; 3], b: &[f64x8<S>; 3]) -> [f64x8<S>; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Point3, Translation3, Unit, UnitQuaternion, Vector3};

    #[test]
    fn many_rays_are_moved_as_each_alone_to_the_bit() {
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
        let mut out = Vec::new();
        for count in [0, 1, 7, 8, 9, 19, 64] {
            let rays: Vec<Ray> = (0..count).map(ray).collect();
            out.clear();
            place_all(&rays, &pose, &mut out);
            let each: Vec<Ray> = rays.iter().map(|ray| placed(ray, &pose)).collect();
            assert_eq!(out, each, "{count} rays");
        }
    }
}
