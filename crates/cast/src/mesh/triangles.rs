//! A placed triangle mesh that rays can be cast into.
//!
//! An f32 index over SIMD lanes finds candidate triangles; the hit is decided in f64 and is watertight. Results are
//! bit-identical with any instruction set, for a single ray or in a packet. Of triangles hit at exactly the same distance,
//! the one with the lowest index counts.

use crate::index::wide::WideBvh;
use crate::lanes::inlined;
use crate::mesh::data::Mesh;
use crate::mesh::exact::{Judge, TriangleHit};
use crate::mesh::finish::{RowHits, finish};
use crate::mesh::packet::{self, Found};
use crate::mesh::single;
use crate::packet::cast::{Caster, Packet, cast_all};
use crate::packet::rays::Rays;
use crate::packet::rows::LANES;
use crate::ray::Ray;
use catoptric_model::Pose;
use fearless_simd::{Level, Simd, dispatch};
use nalgebra::{Point3, Unit, Vector3};
use std::ops::Range;

/// A placed mesh with an index over its triangles.
pub struct Triangles {
    vertices: Vec<Point3<f64>>,
    triangles: Vec<[u32; 3]>,
    wide: WideBvh,
}

impl std::fmt::Debug for Triangles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Triangles({})", self.triangles.len())
    }
}

impl Triangles {
    /// Scales the mesh to meters by `scale`, then places it.
    pub fn new(mesh: &Mesh, scale: f64, frame_from_mesh: &Pose) -> Self {
        let place = |p: &Point3<f64>| frame_from_mesh * Point3::from(p.coords * scale);
        let vertices: Vec<Point3<f64>> = mesh.vertices().iter().map(place).collect();
        let triangles = mesh.triangles().to_vec();
        Self {
            wide: WideBvh::new(&vertices, &triangles),
            vertices,
            triangles,
        }
    }

    pub(crate) fn corners(&self, triangle: usize) -> [Point3<f64>; 3] {
        self.triangles[triangle].map(|v| self.vertices[v as usize])
    }

    /// Returns the vertices, in meters.
    pub fn vertices(&self) -> &[Point3<f64>] {
        &self.vertices
    }

    /// Iterates over the triangles, in meters.
    pub fn each(&self) -> impl Iterator<Item = [Point3<f64>; 3]> {
        (0..self.triangles.len()).map(|t| self.corners(t))
    }

    /// Returns all triangles, in meters.
    pub(crate) fn skin(&self) -> Vec<[Point3<f64>; 3]> {
        self.each().collect()
    }

    pub(crate) fn judge(&self) -> Judge<'_> {
        Judge {
            vertices: &self.vertices,
            triangles: &self.triangles,
        }
    }

    /// Returns the nearest hit of a ray.
    pub fn cast(&self, ray: &Ray) -> Option<TriangleHit> {
        let mut hits = [None];
        self.follow_each(Level::new(), |_| *ray, &mut hits);
        hits[0]
    }

    /// Finds the nearest hit of each ray, for incoherent rays.
    ///
    /// # Panics
    /// If the numbers of rays and result slots differ.
    pub fn cast_each(&self, rays: &Rays, hits: &mut [Option<TriangleHit>]) {
        InMesh::new(self, Level::new()).cast_each(rays, 0..rays.len(), hits);
    }

    /// Finds the nearest hit of each ray: fast for coherent rays, a narrow cone with nearly one origin.
    ///
    /// # Panics
    /// If the numbers of rays and result slots differ.
    pub fn cast_packets(&self, rays: &Rays, hits: &mut [Option<TriangleHit>]) {
        cast_all(&InMesh::new(self, Level::new()), rays, hits);
    }

    fn follow_each(&self, level: Level, rays: impl Fn(usize) -> Ray, hits: &mut [Option<TriangleHit>]) {
        let (judge, count) = (self.judge(), hits.len());
        dispatch!(level, simd => {
            let emit = inlined(#[inline(always)] |ray: usize, of_ray| hits[ray] = of_ray);
            single::follow(simd, &self.wide, &judge, count, &rays, emit);
        });
    }

    /// Emits the nearest hits of a packet, row by row, with the incidence if `CLOSING`. The packet's reach may exceed that
    /// of the mesh.
    #[inline(always)]
    pub(crate) fn hits_of_packet<S: Simd, const R: usize, const CLOSING: bool>(
        &self,
        simd: S,
        packet: &Packet<'_, R>,
        emit: impl FnMut(&RowHits<'_>),
    ) {
        let judge = self.judge();
        let mut found = Found::new(packet.rays.count);
        packet::follow(simd, &self.wide, packet, &judge, &mut found);
        finish::<S, R, CLOSING>(simd, found.triangles(), &packet.rays, &judge, emit);
    }

    /// Returns the normal of a triangle, for a ray that hits it.
    pub(crate) fn normal(&self, triangle: u32, ray: &Ray) -> Unit<Vector3<f64>> {
        self.judge().normal(triangle, ray)
    }

    /// Returns the dot product of a ray's direction and the normal of a triangle that it hits.
    pub(crate) fn closing(&self, triangle: u32, ray: &Ray) -> f64 {
        self.judge().closing(triangle, ray)
    }

    /// Returns distance and normal of the nearest hit of a ray.
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        let hit = self.cast(ray)?;
        Some((hit.distance, self.normal(hit.triangle, ray)))
    }
}

/// A mesh and the instruction set to cast with.
pub(crate) struct InMesh<'a> {
    mesh: &'a Triangles,
    level: Level,
}

impl<'a> InMesh<'a> {
    pub(crate) fn new(mesh: &'a Triangles, level: Level) -> Self {
        Self { mesh, level }
    }
}

impl Caster<Option<TriangleHit>> for InMesh<'_> {
    fn cast_each(&self, rays: &Rays, which: Range<usize>, hits: &mut [Option<TriangleHit>]) {
        assert_eq!(which.len(), hits.len(), "one result slot per ray");
        let ray = inlined(
            #[inline(always)]
            |ray: usize| rays.get(which.start + ray),
        );
        self.mesh.follow_each(self.level, ray, hits);
    }

    fn cast_rows<const R: usize>(
        &self,
        rays: &Rays,
        which: Range<usize>,
        hits: &mut [Option<TriangleHit>],
    ) -> bool {
        dispatch!(self.level, simd => {
            let mut packet = Packet::<R>::new(rays, which);
            let narrow = packet.surround(simd, self.mesh.wide.reach);
            if narrow {
                self.mesh.hits_of_packet::<_, R, false>(simd, &packet, inlined(#[inline(always)] |row: &RowHits<'_>| {
                    let places = hits.chunks_mut(LANES).nth(row.row).unwrap_or_default();
                    for (lane, place) in places.iter_mut().enumerate() {
                        let found = TriangleHit { triangle: row.triangle[lane], distance: row.distance[lane] };
                        *place = (row.some >> lane & 1 == 1).then_some(found);
                    }
                }));
            }
            narrow
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::random::Draws;
    use rayon::prelude::*;
    use std::collections::BTreeMap;

    /// Rays cast at the random mesh, half of them from inside and half from outside.
    const RAYS: u64 = 10_000_000;

    /// A closed mesh that is star-shaped about the origin: a subdivided octahedron with every vertex at a random distance.
    pub(crate) fn random_star(seed: u64, divisions: u32) -> Mesh {
        let mut vertices: Vec<Point3<f64>> = [
            [1.0, 0.0, 0.0],
            [-1.0, 0.0, 0.0],
            [0.0, 1.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.0],
            [0.0, 0.0, -1.0],
        ]
        .map(Point3::from)
        .to_vec();
        let mut triangles = Vec::new();
        for (x, y, z) in (0..8).map(|i| (i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1))) {
            let turns = (x + y + z) % 2 == 0;
            triangles.push(if turns { [x, y, z] } else { [x, z, y] });
        }
        for _ in 0..divisions {
            let mut middles = BTreeMap::new();
            let mut middle = |a: u32, b: u32| {
                *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let m = vertices[a as usize].coords + vertices[b as usize].coords;
                    vertices.push(Point3::from(m.normalize()));
                    u32::try_from(vertices.len() - 1).expect("a small mesh")
                })
            };
            triangles = triangles
                .iter()
                .flat_map(|&[a, b, c]| {
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
                })
                .collect();
        }
        let mut draws = Draws::new(seed, 0);
        for vertex in &mut vertices {
            vertex.coords *= 0.5 + draws.uniform();
        }
        Mesh::new(vertices, triangles).expect("a valid mesh")
    }

    #[test]
    fn a_closed_mesh_never_leaks() {
        let mesh = random_star(17, 4);
        let place = Pose::new(Vector3::new(0.3, -1.2, 0.7), Vector3::new(0.4, 0.1, -0.8));
        let placed = Triangles::new(&mesh, 1.0, &place);
        assert_eq!(placed.triangles.len(), 2048);
        const BATCH: u64 = 10_000;
        (0..RAYS / 2 / BATCH).into_par_iter().for_each(|batch| {
            let mut draws = Draws::new(3, batch);
            for shot in 0..BATCH {
                // A point inside: the star contains a ball of a third of its smallest radius.
                let inside = place * Point3::from(draws.normal3().normalize() * (0.1 * draws.uniform()));
                // Truncation picks a triangle uniformly.
                #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
                let number = (draws.uniform() * placed.triangles.len() as f64) as usize;
                let [a, b, c] = placed.corners(number);
                let target = match shot % 4 {
                    0 => a,
                    1 => a + (b - a) * draws.uniform(),
                    2 => Point3::from((a.coords + b.coords) * 0.5),
                    _ => a + (b - a) * draws.uniform() + (c - a) * draws.uniform(),
                };
                let outwards = Unit::new_normalize(target - inside);
                // From inside, every ray hits the back of a triangle.
                let ray = Ray {
                    origin: inside,
                    direction: outwards,
                };
                assert!(
                    placed.intersect(&ray).is_some(),
                    "leaks from {inside} towards {target}"
                );
                // From outside through the same point, no ray reaches the inside without a hit.
                let outside = inside + outwards.into_inner() * 4.0;
                let ray = Ray {
                    origin: outside,
                    direction: -outwards,
                };
                let (distance, _) = placed.intersect(&ray).expect("a hit from outside");
                assert!(distance < 4.0, "leaks from outside at {target}");
            }
        });
    }

    /// A cube with edges of `units`, its faces divided into unit squares and each square into two triangles along a random
    /// diagonal.
    fn lattice_cube(units: u32, seed: u64) -> Mesh {
        let mut draws = Draws::new(seed, 0);
        let (mut numbers, mut triangles) = (BTreeMap::new(), Vec::new());
        for (axis, side, a, b) in (0..3).flat_map(|axis| {
            let cells = (0..units).flat_map(move |a| (0..units).map(move |b| (a, b)));
            cells.flat_map(move |(a, b)| [0, units].map(|side| (axis, side, a, b)))
        }) {
            let mut corner = |a: u32, b: u32| {
                let mut place = [0; 3];
                (place[axis], place[(axis + 1) % 3], place[(axis + 2) % 3]) = (side, a, b);
                let next = u32::try_from(numbers.len()).expect("a small mesh");
                *numbers.entry(place).or_insert(next)
            };
            let square = [
                corner(a, b),
                corner(a + 1, b),
                corner(a + 1, b + 1),
                corner(a, b + 1),
            ];
            let first = usize::from(draws.uniform() < 0.5);
            let at = |k: usize| square[(first + k) % 4];
            for mut triangle in [[at(0), at(1), at(2)], [at(0), at(2), at(3)]] {
                if side == 0 {
                    triangle.swap(1, 2);
                }
                triangles.push(triangle);
            }
        }
        let mut vertices = vec![Point3::origin(); numbers.len()];
        for (place, number) in numbers {
            vertices[number as usize] = Point3::from(place.map(f64::from));
        }
        Mesh::new(vertices, triangles).expect("a valid mesh")
    }

    #[test]
    fn rays_exactly_on_edges_and_vertices_hit_the_shared_face() {
        // Quarter units along an axis are exact: a sixteenth of these rays hits vertices, and half of them hit edges or
        // diagonals, where an edge function is exactly zero.
        const UNITS: u32 = 8;
        for seed in 0..20 {
            let placed = Triangles::new(&lattice_cube(UNITS, seed), 1.0, &Pose::identity());
            for axis in 0..3 {
                for (a, b) in (1..4 * UNITS).flat_map(|a| (1..4 * UNITS).map(move |b| (a, b))) {
                    for sign in [-1.0, 1.0] {
                        let (mut from, mut along) = (Point3::origin(), Vector3::zeros());
                        (from[axis], along[axis]) = (3.25, sign);
                        (from[(axis + 1) % 3], from[(axis + 2) % 3]) =
                            (0.25 * f64::from(a), 0.25 * f64::from(b));
                        let ray = Ray {
                            origin: from,
                            direction: Unit::new_unchecked(along),
                        };
                        let (distance, normal) = placed.intersect(&ray).expect("a closed mesh");
                        let expected = if sign > 0.0 { f64::from(UNITS) - 3.25 } else { 3.25 };
                        assert_eq!((distance, normal.into_inner()), (expected, along), "from {from}");
                    }
                }
            }
        }
    }

    #[test]
    fn the_hit_distance_is_that_to_the_plane() {
        let mesh = random_star(5, 2);
        let placed = Triangles::new(&mesh, 2.0, &Pose::identity());
        let mut draws = Draws::new(9, 0);
        for _ in 0..10_000 {
            let ray = Ray {
                origin: Point3::origin(),
                direction: Unit::new_normalize(draws.normal3()),
            };
            let (found, normal) = placed.intersect(&ray).expect("a closed mesh");
            // By solving a + s(b − a) + t(c − a) = d·u for every triangle.
            let solved = (0..placed.triangles.len()).filter_map(|i| {
                let [a, b, c] = placed.corners(i);
                let columns = nalgebra::Matrix3::from_columns(&[b - a, c - a, -ray.direction.into_inner()]);
                let [s, t, d]: [f64; 3] = columns.lu().solve(&-a.coords)?.into();
                (s >= -1e-12 && t >= -1e-12 && s + t <= 1.0 + 1e-12 && d > 0.0).then_some(d)
            });
            let expected = solved.fold(f64::INFINITY, f64::min);
            assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
            assert!(normal.dot(&ray.direction) > 0.0, "the fronts face outward");
        }
    }

    #[test]
    fn damaged_meshes_are_refused() {
        use crate::mesh::data::MeshError;
        let corner = |x: f64| Point3::new(x, 0.0, 0.0);
        assert_eq!(Mesh::new(vec![], vec![]), Err(MeshError::Empty));
        let found = Mesh::new(vec![corner(0.0); 3], vec![[0, 1, 3]]);
        assert!(matches!(found, Err(MeshError::NoVertex { vertex: 3, .. })));
        let found = Mesh::new(vec![corner(f64::NAN); 3], vec![[0, 1, 2]]);
        assert_eq!(found, Err(MeshError::NotFinite { vertex: 0 }));
        // A triangle of zero area is never hit, and nothing panics.
        let sliver = Mesh::new(vec![corner(0.0), corner(1.0), corner(2.0)], vec![[0, 1, 2]]).expect("finite");
        let placed = Triangles::new(&sliver, 1.0, &Pose::identity());
        let ray = Ray {
            origin: Point3::new(0.5, 0.0, -1.0),
            direction: Vector3::z_axis(),
        };
        assert!(placed.intersect(&ray).is_none());
    }
}
