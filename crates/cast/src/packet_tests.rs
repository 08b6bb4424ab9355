//! Compares packets with single rays, with a brute-force test of every triangle and surface, and with parry.

use crate::hit::Hit;
use crate::mesh::data::Mesh;
use crate::mesh::exact::TriangleHit;
use crate::mesh::triangles::tests::random_star;
use crate::mesh::triangles::{InMesh, Triangles};
use crate::packet::cast::{Caster, cast_all};
use crate::packet::rays::Rays;
use crate::random::Draws;
use crate::ray::{FARTHEST, Ray};
use crate::shape::Shape;
use crate::solid::block::to_glam;
use crate::solid::{Block, Cylinder, Polygon};
use crate::world::World;
use catoptric_model::Pose;
use fearless_simd::Level;
use nalgebra::{Point3, Unit, Vector3};
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use rayon::prelude::*;
use std::sync::Arc;

/// The widest instruction set of this machine, every narrower one that it supports, and the fallback.
fn levels() -> Vec<Level> {
    let best = Level::new();
    #[cfg(any(target_arch = "x86", target_arch = "x86_64"))]
    let others = [
        best.as_avx2().map(Level::Avx2),
        best.as_sse4_2().map(Level::Sse4_2),
        best.as_sse2().map(Level::Sse2),
    ];
    #[cfg(not(any(target_arch = "x86", target_arch = "x86_64")))]
    let others = [Some(Level::baseline()), None, None];
    std::iter::once(best)
        .chain(others.into_iter().flatten())
        .collect()
}

fn vector(draws: &mut Draws, size: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| size * (2.0 * draws.uniform() - 1.0))
}

/// A narrow cone of rays with origins up to `apart` from each other.
fn cone(draws: &mut Draws, from: Point3<f64>, towards: Point3<f64>, count: usize, apart: f64) -> Rays {
    let middle = (towards - from).normalize();
    let width = 0.03 * draws.uniform();
    (0..count)
        .map(|i| Ray {
            origin: from + vector(draws, apart),
            direction: if i == 0 {
                Unit::new_normalize(towards - from)
            } else {
                Unit::new_normalize(middle + vector(draws, width))
            },
        })
        .collect()
}

/// The nearest hit by brute force.
fn tried(mesh: &Triangles, ray: &Ray, count: u32) -> Option<TriangleHit> {
    let judge = mesh.judge();
    let found = (0..count).filter_map(|triangle| {
        let distance = judge.meet(ray, triangle)?;
        Some(TriangleHit { triangle, distance })
    });
    found.min_by(|a, b| {
        a.distance
            .total_cmp(&b.distance)
            .then(a.triangle.cmp(&b.triangle))
    })
}

/// Triangles of all sizes, including needles and duplicates, some on a common grid.
fn soup(seed: u64, count: u32) -> Mesh {
    let mut draws = Draws::new(seed, 0);
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let size = libm::pow(10.0, -3.0 * draws.uniform());
        let middle = Point3::from(vector(&mut draws, 3.0));
        let first = u32::try_from(vertices.len()).expect("a small mesh");
        let thin = if draws.uniform() < 0.2 { 1e-6 } else { 1.0 };
        let grid = draws.uniform() < 0.3;
        for _ in 0..3 {
            let p = middle + vector(&mut draws, size).component_mul(&Vector3::new(1.0, thin, 1.0));
            let p = if grid {
                p.map(|c| (4.0 * c).round() / 4.0)
            } else {
                p
            };
            vertices.push(p);
        }
        triangles.push([first, first + 1, first + 2]);
        if draws.uniform() < 0.05 {
            triangles.push([first + 1, first + 2, first]);
        }
    }
    Mesh::new(vertices, triangles).expect("a valid mesh")
}

#[test]
fn packets_and_rays_agree_with_brute_force_on_every_instruction_set() {
    let of_seed = |number: usize| {
        let seed = number as u64;
        let source = soup(seed, [3, 8, 60, 700][number % 4]);
        // Far away, every rounding error of f32 is larger.
        let place = if number % 3 == 2 { 300.0 } else { 0.3 };
        let mesh = Triangles::new(&source, 1.0, &Pose::translation(place, -0.2 * place, 0.4 * place));
        let count = u32::try_from(source.triangles().len()).expect("a small mesh");
        let mut draws = Draws::new(seed, 1);
        let mut hits = 0;
        for shot in 0..60 {
            // Some rays start exactly at, or aim exactly at, a vertex or the middle of an edge.
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            let [a, b, _] = mesh.corners((draws.uniform() * f64::from(count)) as usize);
            let towards = if shot % 2 == 0 {
                a
            } else {
                nalgebra::center(&a, &b)
            };
            let from = if shot % 7 == 0 {
                b
            } else {
                Point3::from(vector(&mut draws, 4.0))
            };
            if from == towards {
                continue;
            }
            let apart = [0.0, 0.005, 0.3][shot % 3];
            let size = [1, 5, 16, 19, 64, 100, 128, 140][shot % 8];
            let rays = cone(&mut draws, from, towards, size, apart);
            let expected: Vec<_> = rays.iter().map(|ray| tried(&mesh, &ray, count)).collect();
            hits += expected.iter().flatten().count();
            for level in levels() {
                let mut found = vec![None; rays.len()];
                cast_all(&InMesh::new(&mesh, level), &rays, &mut found);
                assert_eq!(found, expected, "seed {seed}, shot {shot}, a packet at {level:?}");
                let mut found = vec![None; rays.len()];
                InMesh::new(&mesh, level).cast_each(&rays, 0..rays.len(), &mut found);
                assert_eq!(found, expected, "seed {seed}, shot {shot}, each ray at {level:?}");
            }
        }
        hits
    };
    let hits: usize = (0..40).into_par_iter().map(of_seed).sum();
    assert!(hits > 4_000, "{hits} hits");
}

#[test]
fn no_packet_leaks_out_of_a_closed_mesh() {
    let source = random_star(17, 4);
    let place = Pose::new(Vector3::new(0.3, -1.2, 0.7), Vector3::new(0.4, 0.1, -0.8));
    let mesh = Triangles::new(&source, 1.0, &place);
    (0..2048_usize).into_par_iter().for_each(|triangle| {
        let mut draws = Draws::new(5, triangle as u64);
        let [a, b, c] = mesh.corners(triangle);
        let inside = place * Point3::from(draws.normal3().normalize() * (0.1 * draws.uniform()));
        for target in [a, nalgebra::center(&a, &b), nalgebra::center(&b, &c)] {
            let rays = cone(&mut draws, inside, target, 32, 0.01);
            let mut found = vec![None; rays.len()];
            mesh.cast_packets(&rays, &mut found);
            assert!(found.iter().all(Option::is_some), "leaks towards {target}");
        }
    });
}

#[test]
fn hits_agree_with_parry() {
    const BEAMS: u64 = 8_000;
    let source = random_star(3, 5);
    let mesh = Triangles::new(&source, 1.0, &Pose::identity());
    let points = source.vertices().iter().map(|p| to_glam(&p.coords)).collect();
    let parry = parry3d::shape::TriMesh::new(points, source.triangles().to_vec()).expect("a valid mesh");
    let off: usize = (0..BEAMS)
        .into_par_iter()
        .map(|beam| {
            use parry3d::query::RayCast;
            let mut draws = Draws::new(8, beam);
            let (from, towards) = (vector(&mut draws, 3.0), vector(&mut draws, 0.8));
            let rays = cone(&mut draws, Point3::from(from), Point3::from(towards), 64, 0.0);
            let mut found = vec![None; rays.len()];
            mesh.cast_packets(&rays, &mut found);
            let off = rays.iter().zip(&found).filter(|(ray, found)| {
                let ray = parry3d::query::Ray::new(to_glam(&ray.origin.coords), to_glam(&ray.direction));
                let expected = parry.cast_local_ray(&ray, FARTHEST, false);
                let difference = match (found, expected) {
                    (Some(found), Some(expected)) => (found.distance - expected).abs(),
                    (None, None) => 0.0,
                    _ => f64::INFINITY,
                };
                assert!(
                    !(1e-6..=1e-3).contains(&difference),
                    "{found:?} against {expected:?}"
                );
                difference > 1e-3
            });
            off.count()
        })
        .sum();
    // Of half a million rays.
    assert!(off <= 2, "{off} rays");
}

/// Asserts that a hit is the nearest by brute force over all surfaces, and the one found through parry's index.
fn agrees(world: &World, parry: &Bvh, ray: &Ray, except: Option<usize>, found: Option<&Hit>) {
    let of_shape = |number: usize| {
        let other = except != Some(number);
        other.then(|| world.shapes()[number].distance(ray)).flatten()
    };
    let tried = (0..world.shapes().len()).filter_map(|number| Some((of_shape(number)?, number)));
    let tried = tried.min_by(|a, b| a.partial_cmp(b).expect("finite distances"));
    let found = found.map(|hit| (hit.distance, hit.surface as usize));
    assert_eq!(found, tried, "by brute force");
    let parry_ray = parry3d::query::Ray::new(to_glam(&ray.origin.coords), to_glam(&ray.direction));
    let walked = parry.cast_ray(&parry_ray, FARTHEST, |leaf, _| of_shape(leaf as usize));
    assert_eq!(
        found.map(|f| f.0),
        walked.map(|(_, distance)| distance),
        "by parry"
    );
}

#[test]
fn a_world_casts_packets_as_it_casts_single_rays() {
    let star = Arc::new(Triangles::new(
        &random_star(4, 3),
        0.7,
        &Pose::translation(2.0, 0.0, 0.0),
    ));
    for seed in 0..30 {
        let mut draws = Draws::new(seed, 0);
        let mut shapes = vec![
            Shape::Mesh(Arc::clone(&star)),
            Shape::Block(Block::new(
                Pose::translation(0.0, 2.0, 0.0),
                Vector3::new(1.0, 0.5, 0.7),
            )),
            Shape::Cylinder(Cylinder::new(Pose::translation(0.0, -2.0, 0.0), 0.4, 1.0)),
        ];
        shapes.extend((0..40).filter_map(|_| {
            let at = Point3::from(vector(&mut draws, 5.0));
            let (u, v) = (draws.normal3(), draws.normal3());
            let corners = [at, at + u, at + u + v, at + v * 0.7].to_vec();
            Some(Shape::Polygon(Polygon::new(corners)?))
        }));
        let world = World::new(shapes);
        let boxes: Vec<_> = world.shapes().iter().map(Shape::bounds).collect();
        let parry = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let mut hits = [0; 3];
        for shot in 0..200_usize {
            let from = Point3::from(vector(&mut draws, 4.0));
            let towards = Point3::from(vector(&mut draws, 2.5));
            let rays = cone(
                &mut draws,
                from,
                towards,
                [1, 16, 19, 61, 130][shot % 5],
                [0.0, 0.004][shot % 2],
            );
            for except in [
                None,
                world.cast(&rays.get(0), None).map(|hit| hit.surface as usize),
            ] {
                for level in levels() {
                    let mut found = vec![None; rays.len()];
                    world.cast_packets_at(level, &rays, except, &mut found);
                    for (ray, found) in rays.iter().zip(&found) {
                        assert_eq!(*found, world.cast_at(level, &ray, except), "{level:?}");
                        agrees(&world, &parry, &ray, except, found.as_ref());
                        if let Some(hit) = found {
                            hits[hit.surface.min(2) as usize] += 1;
                        }
                    }
                }
            }
        }
        assert!(hits.iter().all(|n| *n > 0), "{hits:?}");
    }
}

/// Beyond the range of f32 nothing is found, and nothing panics.
#[test]
fn no_finite_coordinate_makes_the_index_panic() {
    for size in [
        1e5, 1e12, 1e18, 1e20, 1e30, 1e37, 1e38, 3.5e38, 1e39, 1e100, 1e200, 1e308,
    ] {
        let mut source = soup(3, 300);
        for number in [0, 7, 400] {
            let mut vertices = source.vertices().to_vec();
            vertices[number].coords[number % 3] = if number == 7 { -size } else { size };
            source = Mesh::new(vertices, source.triangles().to_vec()).expect("finite");
            let mesh = Arc::new(Triangles::new(&source, 1.0, &Pose::identity()));
            let far = Pose::translation(size, 0.0, 0.0);
            let world = World::new(vec![
                Shape::Mesh(Arc::clone(&mesh)),
                Shape::Block(Block::new(far, Vector3::new(1.0, 0.5, 0.7))),
                Shape::Cylinder(Cylinder::new(far, 0.4, size)),
            ]);
            for from in [0.0, -size, size] {
                let mut draws = Draws::new(1, 0);
                let target = Point3::from(vector(&mut draws, 2.0));
                let rays = cone(&mut draws, Point3::new(from, 0.0, 0.0), target, 64, 0.0);
                let mut found = vec![None; rays.len()];
                world.cast_packets(&rays, None, &mut found);
                for (ray, found) in rays.iter().zip(&found) {
                    let alone = world.cast(&ray, None);
                    if size < 1e18 {
                        assert_eq!(alone, *found, "{size:e}");
                    }
                }
            }
        }
    }
}

#[test]
fn an_empty_world_and_an_empty_packet_have_no_hits() {
    let world = World::new(Vec::new());
    let mut draws = Draws::new(1, 0);
    let rays = cone(&mut draws, Point3::origin(), Point3::new(1.0, 0.0, 0.0), 16, 0.0);
    let mut hits = vec![None; 16];
    world.cast_packets(&rays, None, &mut hits);
    assert!(hits.iter().all(Option::is_none));
    world.cast_packets(&Rays::default(), None, &mut []);
}
