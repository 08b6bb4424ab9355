//! Rays moved into another frame, and normals moved back: one, or eight at a time with the same operations in the same
//! order.

use crate::cast::Hit;
use crate::footprint::Ray;
use catoptric_model::Pose;
use fearless_simd::{Level, Simd, dispatch, f64x8, prelude::*};
use nalgebra::{Point3, Unit, UnitQuaternion, Vector3};

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
    dispatch!(Level::new(), simd => place(simd, rays, other_from_ray, out));
}

#[inline(always)]
fn place<S: Simd>(simd: S, rays: &[Ray], pose: &Pose, out: &mut Vec<Ray>) {
    let turn = pose.rotation.coords;
    let turn = splat(simd, [turn.x, turn.y, turn.z, turn.w]);
    let shift = splat(simd, pose.translation.vector.into());
    for group in rays.chunks(LANES) {
        let (mut origins, mut directions) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, ray) in group.iter().enumerate() {
            for k in 0..3 {
                origins[k][lane] = ray.origin[k];
                directions[k][lane] = ray.direction[k];
            }
        }
        let origin = rotate(simd, &turn, &origins);
        let direction = rotate(simd, &turn, &directions);
        for k in 0..3 {
            (origin[k] + shift[k]).store_slice(&mut origins[k]);
            direction[k].store_slice(&mut directions[k]);
        }
        let of = |v: &[[f64; LANES]; 3], lane: usize| Vector3::new(v[0][lane], v[1][lane], v[2][lane]);
        out.extend((0..group.len().min(LANES)).map(|lane| Ray {
            origin: Point3::from(of(&origins, lane)),
            direction: Unit::new_unchecked(of(&directions, lane)),
        }));
    }
}

/// Appends |N·d| of rays with the normals that they meet, which are turned into the frame of the rays first; where a ray
/// meets nothing it is any number.
pub(super) fn incidences(
    rays: &[Ray],
    hits: &[Option<Hit>],
    ray_from_hit: Option<&UnitQuaternion<f64>>,
    out: &mut Vec<f64>,
) {
    dispatch!(Level::new(), simd => incide(simd, rays, hits, ray_from_hit, out));
}

#[inline(always)]
fn incide<S: Simd>(
    simd: S,
    rays: &[Ray],
    hits: &[Option<Hit>],
    turn: Option<&UnitQuaternion<f64>>,
    out: &mut Vec<f64>,
) {
    let turn = turn.map(|turn| splat(simd, [turn.i, turn.j, turn.k, turn.w]));
    for (rays, hits) in rays.chunks(LANES).zip(hits.chunks(LANES)) {
        let (mut directions, mut normals) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for (lane, (ray, hit)) in rays.iter().zip(hits).enumerate() {
            let Some(hit) = hit else { continue };
            for k in 0..3 {
                directions[k][lane] = ray.direction[k];
                normals[k][lane] = hit.normal[k];
            }
        }
        let normal = match &turn {
            Some(turn) => rotate(simd, turn, &normals),
            None => load(simd, &normals),
        };
        let direction = load(simd, &directions);
        let cosine = normal[0] * direction[0] + normal[1] * direction[1] + normal[2] * direction[2];
        let mut all = [0.0; LANES];
        cosine.abs().store_slice(&mut all);
        out.extend_from_slice(&all[..rays.len()]);
    }
}

#[inline(always)]
fn load<S: Simd>(simd: S, v: &[[f64; LANES]; 3]) -> [f64x8<S>; 3] {
    [
        f64x8::simd_from(simd, v[0]),
        f64x8::simd_from(simd, v[1]),
        f64x8::simd_from(simd, v[2]),
    ]
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
    let v = load(simd, v);
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
    use nalgebra::Translation3;

    #[test]
    fn incidences_are_those_of_each_alone_to_the_bit() {
        let pose = Pose::from_parts(
            Translation3::new(0.3, -1.7, 2.9),
            UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -1.1, 0.7)),
        );
        let unit = |i: u32, a: f64| {
            let x = f64::from(i);
            Unit::new_normalize(Vector3::new(a, 0.3 * x - 2.0, -0.07 * x * x))
        };
        let ray = |i| Ray {
            origin: Point3::origin(),
            direction: unit(i, 1.0),
        };
        let hit = |i: u32| {
            (i % 5 != 3).then(|| Hit {
                surface: 0,
                distance: 1.0,
                point: Point3::origin(),
                normal: unit(i, -0.4),
                front: true,
            })
        };
        for (count, moved) in [(0, true), (7, true), (8, false), (19, true), (19, false)] {
            let rays: Vec<Ray> = (0..count).map(ray).collect();
            let hits: Vec<Option<Hit>> = (0..count).map(hit).collect();
            let (mut out, turn) = (Vec::new(), pose.rotation.inverse());
            incidences(&rays, &hits, moved.then_some(&turn), &mut out);
            assert_eq!(out.len(), rays.len());
            for ((ray, hit), cosine) in rays.iter().zip(&hits).zip(out) {
                let Some(hit) = hit else { continue };
                let normal = match moved {
                    true => pose.inverse_transform_unit_vector(&hit.normal),
                    false => hit.normal,
                };
                assert_eq!(cosine, normal.dot(&ray.direction).abs());
            }
        }
    }

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
