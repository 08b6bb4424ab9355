//! Rays against surfaces: polygons, boxes, cylinders and triangle meshes, one ray at a time or many in lanes.
//!
//! Facets, boards and walls are exact plane polygons; posts and the housing are exact boxes and cylinders. All are in one
//! bounding volume hierarchy; a mesh has its own below it. A ray that leaves a mirror excludes that mirror by index, never
//! by an epsilon.
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
//! ```

#[cfg(test)]
mod beam_tests;
mod hit;
mod index;
mod lanes;
mod mesh;
mod packet;
#[cfg(test)]
mod random;
mod ray;
mod rounding;
mod shape;
mod skin;
mod solid;
mod sweep;
mod world;

pub use hit::{Contact, Hit};
pub use mesh::{Mesh, MeshError, Met, Triangles};
pub use packet::{BUNDLE, Rays};
pub use ray::{Ray, placed};
pub use shape::Shape;
pub use skin::{CYLINDER_FACES, Triangle, volume};
pub use solid::{Block, Cylinder, Polygon, area_vector};
pub use world::World;
