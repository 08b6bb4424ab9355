//! A world: surfaces with one index over them, into which rays are cast one by one or in packets.

mod packet;

use crate::hit::{Hit, NONE, SurfacePoint};
use crate::index::build::over_boxes;
use crate::index::line::Line;
use crate::index::traversal::Traversal;
use crate::index::wide::{Child, Node};
use crate::lanes::inlined;
use crate::ray::{FARTHEST, Ray};
use crate::rounding::upwards;
use crate::shape::Shape;
use fearless_simd::{Level, dispatch};
use nalgebra::{Unit, Vector3};
use parry3d::math::Vector;

/// Surfaces with an index over them.
pub struct World {
    pub(crate) shapes: Vec<Shape>,
    pub(crate) nodes: Vec<Node>,
    pub(crate) reach: f32,
}

impl World {
    /// Builds the index; a hit refers to a shape by its index in this list.
    pub fn new(shapes: Vec<Shape>) -> Self {
        let corner = |v: Vector| Vector3::new(v.x, v.y, v.z);
        let boxes: Vec<_> = shapes
            .iter()
            .map(|shape| {
                let bounds = shape.bounds();
                (corner(bounds.mins), corner(bounds.maxs))
            })
            .collect();
        let reach = boxes
            .iter()
            .fold(0.0, |m: f64, (a, b)| m.max(a.amax()).max(b.amax()));
        let reach = upwards(reach);
        Self {
            shapes,
            nodes: over_boxes(&boxes, reach),
            reach,
        }
    }

    /// Returns the shapes, in the order of the hits' indices.
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// Returns the nearest hit of a ray, ignoring the surface `except`, as a rule the mirror that the ray leaves; a curved
    /// mirror can be hit again. Of surfaces at exactly the same distance, the one with the lowest index counts.
    pub fn cast(&self, ray: &Ray, except: Option<usize>) -> Option<Hit> {
        self.cast_at(Level::new(), ray, except)
    }

    pub(crate) fn cast_at(&self, level: Level, ray: &Ray, except: Option<usize>) -> Option<Hit> {
        let (mut distance, mut surface, mut triangle) = (FARTHEST, NONE, NONE);
        let line = Line::new(ray, self.reach);
        dispatch!(level, simd => {
            let boxes = inlined(#[inline(always)] |node: &Node, limit: f32| line.boxes(simd, node, limit));
            let visit = inlined(#[inline(always)] |child: Child| {
                let number = child.number();
                let found = if except == Some(number) {
                    self.shapes[number].hit_again(ray)
                } else {
                    self.shapes[number].hit(ray)
                };
                if let Some((to_shape, of_mesh)) = found
                    && (to_shape, numbered(number)) < (distance, surface)
                {
                    (distance, surface, triangle) = (to_shape, numbered(number), of_mesh);
                }
                upwards(distance)
            });
            Traversal::new().run(&self.nodes, upwards(FARTHEST), boxes, visit);
        });
        (surface != NONE).then(|| Hit {
            surface,
            triangle,
            distance,
            closing: self.closing(surface, triangle, ray, distance),
        })
    }

    /// Returns the dot product of a ray's direction and the normal of the surface at the hit; `triangle` matters for a mesh.
    pub(crate) fn closing(&self, surface: u32, triangle: u32, ray: &Ray, distance: f64) -> f64 {
        match &self.shapes[surface as usize] {
            Shape::Mesh(mesh) => mesh.closing(triangle, ray),
            Shape::Polygon(_) | Shape::Block(_) | Shape::Cylinder(_) | Shape::Curved(_) => {
                self.normal(surface, triangle, ray, distance).dot(&ray.direction)
            }
        }
    }

    /// Returns the normal of the surface at the hit; `triangle` matters for a mesh.
    fn normal(&self, surface: u32, triangle: u32, ray: &Ray, distance: f64) -> Unit<Vector3<f64>> {
        match &self.shapes[surface as usize] {
            Shape::Polygon(polygon) => polygon.normal,
            Shape::Mesh(mesh) => mesh.normal(triangle, ray),
            Shape::Curved(curved) => curved.normal(ray, distance),
            // The ray is known to hit it, so the fallback is never used.
            body @ (Shape::Block(_) | Shape::Cylinder(_)) => {
                body.intersect(ray).map_or(-ray.direction, |(_, normal)| normal)
            }
        }
    }

    /// Returns the point of the surface that a ray hits, given its hit.
    pub fn surface_point(&self, hit: &Hit, ray: &Ray) -> SurfacePoint {
        SurfacePoint {
            surface: hit.surface as usize,
            distance: hit.distance,
            point: ray.origin + ray.direction.into_inner() * hit.distance,
            normal: self.normal(hit.surface, hit.triangle, ray, hit.distance),
            closing: hit.closing,
        }
    }
}

/// Returns a surface's index as u32; nodes of the index limit it to fewer bits.
#[allow(clippy::cast_possible_truncation)]
pub(crate) fn numbered(surface: usize) -> u32 {
    surface as u32
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
            assert_eq!(order[hit.surface as usize], 1.0);
            let point = world.surface_point(&hit, &towards(0.1, 0.2)).point;
            assert!((point.x - 1.0).abs() < 1e-15);
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
        let normal = world.surface_point(&hit, &towards(0.0, 0.0)).normal;
        assert!((normal.into_inner() + Vector3::x()).norm() < 1e-12);
    }
}
