//! Rays against surfaces: polygons, curved mirrors, boxes, cylinders and triangle meshes, one ray at a time or many in lanes.
//!
//! Facets, boards and walls are exact plane polygons, and curved facets exact quadrics over them; posts and the housing are
//! exact boxes and cylinders. All are in one
//! bounding volume hierarchy, eight children wide, whether a ray is cast alone or in a packet; a mesh has its own of the
//! same kind below it. A ray that leaves a mirror excludes that mirror by index, never by an epsilon. Indices are built and
//! traversed in f32 and conservatively; what is hit, and how far away, is decided in f64.
//!
//! ```
//! use catoptric_cast::{Polygon, Ray, Shape, World};
//! use nalgebra::{Point3, Vector3};
//!
//! let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)].map(|(y, z)| Point3::new(2.0, y, z));
//! let wall = Polygon::new(corners.to_vec()).expect("a nonzero area");
//! let world = World::new(vec![Shape::Polygon(wall)]);
//! let ray = Ray { origin: Point3::origin(), direction: Vector3::x_axis() };
//! let hit = world.cast(&ray, None).expect("a hit on the wall");
//! assert_eq!((hit.surface, hit.distance), (0, 2.0));
//! assert_eq!(world.surface_point(&hit, &ray).point, Point3::new(2.0, 0.0, 0.0));
//! ```
//!
//! # For readers who know Embree
//!
//! | Embree | here |
//! |---|---|
//! | `RTCScene`, committed | [`World`]; [`World::new`] builds its index |
//! | `RTCGeometry`, `geomID` | [`Shape`]; [`Hit::surface`] is its place in the world's list |
//! | triangle mesh, `primID` | [`Mesh`], placed as [`Triangles`]; [`TriangleHit::triangle`] |
//! | `RTCRay`, `tfar` | [`Ray`], without `tnear` and `tfar`; [`Hit::distance`] |
//! | `RTCHit` | [`Hit`]; instead of the normal it has the cosine of the incidence, which a range needs |
//! | interpolation from `u`, `v` and `Ng` | [`World::surface_point`], called once, for the hits that need the point and the normal |
//! | `rtcIntersect1` | [`World::cast`], [`Triangles::cast`] |
//! | `rtcIntersect16`, coherent | [`World::cast_packets`], [`Triangles::cast_packets`], with [`PACKET`] rays each |
//! | incoherent ray streams | [`Triangles::cast_each`] |
//! | intersection filter | the index to leave out, `except` |
//! | `RTC_SCENE_FLAG_ROBUST` | always: edges are watertight, in f64 |

#[cfg(test)]
mod curved_tests;
mod hit;
mod index;
mod lanes;
mod mesh;
mod packet;
#[cfg(test)]
mod packet_tests;
#[cfg(test)]
mod random;
mod ray;
mod rounding;
mod shape;
mod skin;
mod solid;
mod world;

pub use hit::{Hit, SurfacePoint};
pub use mesh::{Mesh, MeshError, TriangleHit, Triangles};
pub use packet::{PACKET, Rays};
pub use ray::{Ray, placed};
pub use shape::Shape;
pub use skin::{CYLINDER_FACES, Triangle, volume};
pub use solid::{Block, Curved, Cylinder, Polygon, area_vector};
pub use world::World;
