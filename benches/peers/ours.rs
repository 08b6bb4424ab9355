//! Our side of the comparison with other ray casters: nearest hits on the meshes that `compare.py` makes.
//!
//! `cargo bench --bench peers -- FOLDER MESH ENGINE RAYS THREADS SECONDS` prints one line of JSON and writes the
//! distances next to the inputs. Engines are `beamN` (N rays at a time as one beam), `single` (each ray separately),
//! `polygonsN` (every triangle as a polygon of a world, N rays at a time as one beam) and `parry` (in f64).
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout, clippy::print_stderr)]

use catoptric::cast::Mesh;
use catoptric::cast::Ray;
use catoptric::cast::{Hit, Polygon, Rays, Shape, TriangleHit, Triangles, World};
use catoptric::model::Pose;
use nalgebra::{Point3, Unit, Vector3};
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Reads a file of little-endian 32-bit words.
fn words<T>(path: &str, from: fn([u8; 4]) -> T) -> Vec<T> {
    let bytes = fs::read(path).unwrap_or_else(|e| panic!("{path}: {e}"));
    bytes
        .chunks_exact(4)
        .map(|b| from(b.try_into().unwrap()))
        .collect()
}

fn resident_mb() -> f64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|l| l.strip_prefix("VmRSS:"));
    line.and_then(|l| l.split_whitespace().next()?.parse::<f64>().ok())
        .map_or(0.0, |kb| kb / 1024.0)
}

/// Number of rays that a thread takes at a time.
const BLOCK: usize = 256;

/// Casts rays together and writes their distances.
type Caster<'a> = Box<dyn Fn(&Rays, &mut Found, &mut [f64]) + Sync + 'a>;

/// Buffers for their hits.
#[derive(Default)]
struct Found {
    met: Vec<Option<TriangleHit>>,
    hits: Vec<Option<Hit>>,
}

/// A ray from its six numbers in the file.
fn ray(r: &[f32]) -> Ray {
    Ray {
        origin: Point3::new(r[0].into(), r[1].into(), r[2].into()),
        // Not normalized again, so that all engines cast the same ray.
        direction: Unit::new_unchecked(Vector3::new(r[3].into(), r[4].into(), r[5].into())),
    }
}

/// Seconds for one pass over all rays, in blocks that threads take as they become free. Like every engine, it starts
/// from the rays of the file, six numbers in f32 each.
fn pass(cast: &Caster<'_>, together: usize, rays: &[f32], distances: &mut [f64], threads: usize) -> f64 {
    let next = AtomicUsize::new(0);
    let blocks: Vec<_> = distances.chunks_mut(BLOCK).map(std::sync::Mutex::new).collect();
    let start = Instant::now();
    let work = || {
        let (mut own, mut found) = (Rays::default(), Found::default());
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let Some(block) = blocks.get(number) else { break };
            let mut distances = block.lock().unwrap();
            let first = BLOCK * number;
            let rays = rays[6 * first..6 * (first + distances.len())].chunks(6 * together);
            for (rays, distances) in rays.zip(distances.chunks_mut(together)) {
                own.clear();
                own.extend(rays.chunks_exact(6).map(ray));
                cast(&own, &mut found, distances);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(work);
        }
        work();
    });
    start.elapsed().as_secs_f64()
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|a| a != "--bench").collect();
    let [folder, mesh, engine, set, threads, seconds] = arguments.as_slice() else {
        // Run together with all other benches, without inputs.
        eprintln!("benches/peers/compare.py runs this benchmark");
        return;
    };
    let (threads, seconds): (usize, f64) = (threads.parse().unwrap(), seconds.parse().unwrap());
    let floats = |name: &str| words(&format!("{folder}/{name}.f32"), f32::from_le_bytes);
    let vertices: Vec<Point3<f64>> = floats(&format!("{mesh}.vertices"))
        .chunks_exact(3)
        .map(|p| Point3::new(p[0].into(), p[1].into(), p[2].into()))
        .collect();
    let triangles: Vec<[u32; 3]> = words(&format!("{folder}/{mesh}.triangles.u32"), u32::from_le_bytes)
        .chunks_exact(3)
        .map(|t| t.try_into().unwrap())
        .collect();
    let rays = floats(&format!("{set}.rays"));
    let mesh_data = Mesh::new(vertices.clone(), triangles.clone()).unwrap();
    let before = resident_mb();
    let start = Instant::now();
    let placed = Triangles::new(&mesh_data, 1.0, &Pose::identity());
    let build = start.elapsed().as_secs_f64();
    let memory = resident_mb() - before;
    let parry;
    let distance = |met: Option<TriangleHit>| met.map_or(f64::INFINITY, |m| m.distance);
    let mut together = BLOCK;
    let cast: Caster<'_> = match engine.as_str() {
        "single" => {
            let placed = &placed;
            Box::new(move |rays, found, distances| {
                found.met.resize(rays.len(), None);
                placed.cast_each(rays, &mut found.met);
                for (place, met) in distances.iter_mut().zip(&found.met) {
                    *place = distance(*met);
                }
            })
        }
        "parry" => {
            let points = vertices
                .iter()
                .map(|p| parry3d::math::Vector::new(p.x, p.y, p.z))
                .collect();
            parry = parry3d::shape::TriMesh::new(points, triangles).unwrap();
            Box::new(|rays, _, distances| {
                use parry3d::query::RayCast;
                let vector = |v: &Vector3<f64>| parry3d::math::Vector::new(v.x, v.y, v.z);
                for (ray, distance) in rays.iter().zip(distances) {
                    let ray = parry3d::query::Ray::new(vector(&ray.origin.coords), vector(&ray.direction));
                    *distance = parry.cast_local_ray(&ray, 1e4, false).unwrap_or(f64::INFINITY);
                }
            })
        }
        polygons if polygons.starts_with("polygons") => {
            let count: usize = polygons["polygons".len()..].parse().unwrap();
            let polygon = |t: &[u32; 3]| Polygon::new(t.map(|v| vertices[v as usize]).to_vec()).unwrap();
            let world = World::new(triangles.iter().map(|t| Shape::Polygon(polygon(t))).collect());
            together = count;
            Box::new(move |rays, found, distances| {
                found.hits.resize(rays.len(), None);
                world.cast_packets(rays, None, &mut found.hits);
                for (place, hit) in distances.iter_mut().zip(&found.hits) {
                    *place = hit.map_or(f64::INFINITY, |c| c.distance);
                }
            })
        }
        beam => {
            let count: usize = beam.strip_prefix("beam").and_then(|n| n.parse().ok()).unwrap();
            let placed = &placed;
            together = count;
            Box::new(move |rays, found, distances| {
                found.met.resize(rays.len(), None);
                placed.cast_packets(rays, &mut found.met);
                for (place, met) in distances.iter_mut().zip(&found.met) {
                    *place = distance(*met);
                }
            })
        }
    };
    let mut distances = vec![f64::INFINITY; rays.len() / 6];
    let mut times = vec![pass(&cast, together, &rays, &mut distances, threads)];
    while times.iter().sum::<f64>() < seconds {
        times.push(pass(&cast, together, &rays, &mut distances, threads));
    }
    times.sort_by(f64::total_cmp);
    let rate = distances.len() as f64 / times[times.len() / 2] / 1e6;
    let bytes: Vec<u8> = distances.iter().flat_map(|d| d.to_le_bytes()).collect();
    fs::write(format!("{folder}/{engine}.{mesh}.{set}.f64"), bytes).unwrap();
    println!(
        "{{\"mrays\": {rate:.3}, \"best\": {:.3}, \"build_s\": {build:.4}, \"memory_mb\": {memory:.1}}}",
        distances.len() as f64 / times[0] / 1e6
    );
}
