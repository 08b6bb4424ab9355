//! A world: surfaces with an index over them, into which rays are cast.

use crate::hit::{Contact, Hit, NONE};
use crate::index::build::over_boxes;
use crate::index::wide::Node;
use crate::ray::{FARTHEST, Ray};
use crate::rounding::upwards;
use crate::shape::Shape;
use crate::solid::block::to_glam;
use nalgebra::{Unit, Vector3};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};

/// Surfaces with an index over them.
pub struct World {
    pub(crate) shapes: Vec<Shape>,
    bvh: Bvh,
    /// The same boxes as an eight-wide index, for packets.
    pub(crate) nodes: Vec<Node>,
    pub(crate) reach: f32,
}

impl World {
    /// Builds the index; a hit refers to a shape by its index in this list.
    pub fn new(shapes: Vec<Shape>) -> Self {
        let boxes: Vec<Aabb> = shapes.iter().map(Shape::bounds).collect();
        let corner = |v: Vector| Vector3::new(v.x, v.y, v.z);
        let corners: Vec<_> = boxes.iter().map(|b| (corner(b.mins), corner(b.maxs))).collect();
        let reach = corners
            .iter()
            .fold(0.0, |m: f64, (a, b)| m.max(a.amax()).max(b.amax()));
        let reach = upwards(reach);
        Self {
            bvh: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            shapes,
            nodes: over_boxes(&corners, reach),
            reach,
        }
    }

    /// Returns the shapes, in the order of the hits' indices.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Returns the nearest hit of a ray, ignoring `left`, the mirror that it just left.
    pub fn cast(&self, ray: &Ray, left: Option<usize>) -> Option<Hit> {
        Some(self.hit(&self.contact(ray, left)?, ray))
    }

    pub(crate) fn contact(&self, ray: &Ray, left: Option<usize>) -> Option<Contact> {
        let parry_ray = parry3d::query::Ray::new(to_glam(&ray.origin.coords), to_glam(&ray.direction));
        let (surface, distance) = self.bvh.cast_ray(&parry_ray, FARTHEST, |leaf, _| {
            let leaf = leaf as usize;
            if left == Some(leaf) {
                return None;
            }
            self.shapes[leaf].distance(ray)
        })?;
        let triangle = match &self.shapes[surface as usize] {
            Shape::Mesh(mesh) => mesh.nearest(ray)?.triangle,
            _ => NONE,
        };
        Some(Contact {
            surface,
            triangle,
            distance,
            closing: self.closing(surface, triangle, ray),
        })
    }

    /// Returns the dot product of a ray's direction and the normal of the surface at the hit; `triangle` matters for a mesh.
    pub(crate) fn closing(&self, surface: u32, triangle: u32, ray: &Ray) -> f64 {
        match &self.shapes[surface as usize] {
            Shape::Mesh(mesh) => mesh.closing(triangle, ray),
            _ => self.normal(surface, triangle, ray).dot(&ray.direction),
        }
    }

    /// Returns the normal of the surface at the hit; `triangle` matters for a mesh.
    fn normal(&self, surface: u32, triangle: u32, ray: &Ray) -> Unit<Vector3<f64>> {
        match &self.shapes[surface as usize] {
            Shape::Polygon(polygon) => polygon.normal,
            Shape::Mesh(mesh) => mesh.normal(triangle, ray),
            // The ray is known to hit it, so the fallback is never used.
            other => other.cast(ray).map_or(-ray.direction, |(_, normal)| normal),
        }
    }

    /// Completes a contact with the hit point and the normal.
    pub fn hit(&self, contact: &Contact, ray: &Ray) -> Hit {
        Hit {
            surface: contact.surface as usize,
            distance: contact.distance,
            point: ray.origin + ray.direction.into_inner() * contact.distance,
            normal: self.normal(contact.surface, contact.triangle, ray),
            closing: contact.closing,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solid::{Block, Polygon};
    use catoptric_model::Pose;
    use nalgebra::Point3;

    fn square(x: f64) -> Shape {
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        Shape::Polygon(
            Polygon::new(corners.map(|(y, z)| Point3::new(x, y, z)).to_vec()).expect("a nonzero area"),
        )
    }

    fn towards(y: f64, z: f64) -> Ray {
        Ray {
            origin: Point3::origin(),
            direction: Unit::new_normalize(Vector3::new(1.0, y, z)),
        }
    }

    #[test]
    fn the_nearest_surface_is_found_whatever_the_order() {
        for order in [[1.0, 2.0, 3.0], [3.0, 1.0, 2.0], [2.0, 3.0, 1.0]] {
            let world = World::new(order.map(square).to_vec());
            let hit = world.cast(&towards(0.1, 0.2), None).expect("a hit");
            assert_eq!(order[hit.surface], 1.0);
            assert!((hit.point.x - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn a_ray_past_the_edge_misses_and_one_on_it_hits() {
        let world = World::new(vec![square(1.0), square(-5.0)]);
        assert!(world.cast(&towards(1.0, 0.0), None).is_some());
        assert!(world.cast(&towards(1.0 + 1e-9, 0.0), None).is_none());
        assert!(world.cast(&towards(0.0, -1.0 - 1e-9), None).is_none());
    }

    #[test]
    fn the_mirror_just_left_is_not_hit_again() {
        let world = World::new(vec![square(1.0), square(2.0)]);
        assert_eq!(
            world.cast(&towards(0.0, 0.0), Some(0)).map(|h| h.surface),
            Some(1)
        );
    }

    #[test]
    fn a_box_is_hit_on_its_near_face() {
        let pose = Pose::translation(3.0, 0.0, 0.0);
        let world = World::new(vec![
            Shape::Block(Block::new(pose, Vector3::new(0.5, 1.0, 1.0))),
            square(9.0),
        ]);
        let hit = world.cast(&towards(0.0, 0.0), None).expect("a hit");
        assert!((hit.distance - 2.75).abs() < 1e-12 && hit.front());
        assert!((hit.normal.into_inner() + Vector3::x()).norm() < 1e-12);
    }
}
