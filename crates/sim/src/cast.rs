//! Rays against surfaces: the one user of parry.
//!
//! Facets, boards and walls are exact plane polygons, posts and housing exact boxes and cylinders, all in one bounding
//! volume hierarchy; a mesh has one of its own below it. A ray that leaves a mirror excludes that mirror by its index,
//! never by an epsilon.

mod beam;
#[cfg(test)]
mod beam_tests;
mod build;
mod bundle;
mod cylinder;
mod each;
mod exact;
mod finish;
mod lanes;
mod pending;
mod pyramid;
mod rays;
mod rows;
mod single;
mod skin;
mod sweep;
mod triangles;
mod wide;

pub use cylinder::Cylinder;
pub use rays::Rays;
pub(crate) use rays::placed;
pub use skin::{CYLINDER_FACES, Triangle, volume};
pub use triangles::{Met, Triangles};

use crate::footprint::Ray;
use crate::layout::area_vector;
use catoptric_model::Pose;
use fearless_simd::Level;
use nalgebra::{Point3, Unit, Vector3};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use parry3d::partitioning::{Bvh, BvhBuildStrategy};
use parry3d::query::RayCast;
use parry3d::shape::Cuboid;
use std::sync::Arc;

/// A convex plane polygon; its front is the side from which the corners run counter-clockwise.
#[derive(Debug, Clone)]
pub struct Polygon {
    /// A point of the plane: the first corner.
    pub origin: Point3<f64>,
    /// Normal of the front.
    pub normal: Unit<Vector3<f64>>,
    /// The corners.
    pub corners: Vec<Point3<f64>>,
    /// For every edge, the unit vector in the plane that points inwards, and its product with the edge's points.
    edges: Vec<(Vector3<f64>, f64)>,
}

/// A box in its own pose.
#[derive(Debug, Clone)]
pub struct Block {
    sensor_from_block: Pose,
    cuboid: Cuboid,
}

/// A shape that light can meet.
#[derive(Debug, Clone)]
pub enum Shape {
    /// A polygon.
    Polygon(Polygon),
    /// A box.
    Block(Block),
    /// A cylinder.
    Cylinder(Cylinder),
    /// A mesh.
    Mesh(Arc<Triangles>),
}

/// Where a ray meets a surface.
#[derive(Debug, Clone, Copy)]
pub struct Hit {
    /// Index of the surface.
    pub surface: usize,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
    /// The point.
    pub point: Point3<f64>,
    /// Normal of the surface, on the side of its front.
    pub normal: Unit<Vector3<f64>>,
    /// Product of the ray's direction with the normal: the cosine of the incidence, less than zero where the front was met.
    pub closing: f64,
}

/// Where a ray meets a surface, without what follows from that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Index of the surface.
    pub surface: u32,
    /// Number of its triangle, if it is a mesh.
    triangle: u32,
    /// Distance from the ray's origin, in metres.
    pub distance: f64,
    /// Product of the ray's direction with the normal of the surface's front, as of a [`Hit`].
    pub closing: f64,
}

/// Surfaces with an index over them.
pub struct World {
    shapes: Vec<Shape>,
    bvh: Bvh,
    /// The same boxes for beams.
    nodes: Vec<wide::Node>,
    reach: f32,
}

/// Number of a surface or a triangle that is none.
const NONE: u32 = u32::MAX;

/// Farthest distance at which anything is looked for, in metres: beyond any scanner's range.
const FARTHEST: f64 = 1e4;

/// Rays that [`World::cast_beam`] and [`Triangles::nearest_of_beam`] take at once.
pub const BUNDLE: usize = rows::MOST;

/// Slack at a polygon's edge, in metres: two polygons that share an edge leave no gap between them, and the slack is
/// smaller than any distance that matters by six orders of magnitude.
const EDGE_SLACK: f64 = 1e-12;

/// Slack of a bounding box, in metres: a plane polygon's box is flat, and rounding must not push a ray past it.
const BOX_SLACK: f64 = 1e-9;

impl Polygon {
    /// The polygon with these corners. `None` if they span no area.
    pub fn new(corners: Vec<Point3<f64>>) -> Option<Self> {
        let normal = Unit::try_new(area_vector(&corners), f64::MIN_POSITIVE)?;
        let next = corners.iter().cycle().skip(1);
        let edges = corners
            .iter()
            .zip(next)
            .filter_map(|(a, b)| {
                let inwards = Unit::try_new(normal.cross(&(b - a)), f64::MIN_POSITIVE)?;
                Some((inwards.into_inner(), inwards.dot(&a.coords)))
            })
            .collect();
        Some(Self {
            origin: *corners.first()?,
            normal,
            corners,
            edges,
        })
    }

    /// Distance at which a ray meets the polygon, from either side.
    fn cast(&self, ray: &Ray) -> Option<f64> {
        let closing = self.normal.dot(&ray.direction);
        let distance = self.normal.dot(&(self.origin - ray.origin)) / closing;
        // A ray along the plane gives an infinity or NaN, which fails the comparison.
        if !(distance > 0.0 && distance < FARTHEST) {
            return None;
        }
        let point = ray.origin + ray.direction.into_inner() * distance;
        self.contains(&point).then_some(distance)
    }

    /// Whether a point of its plane lies within its outline.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        self.edges
            .iter()
            .all(|(inwards, edge)| inwards.dot(&point.coords) >= edge - EDGE_SLACK)
    }

    /// The same outline, seen from the other side.
    pub fn turned(&self) -> Option<Self> {
        Self::new(self.corners.iter().rev().copied().collect())
    }
}

impl Block {
    /// A box of the given extents, in metres, centered on its own frame.
    pub fn new(sensor_from_block: Pose, size: Vector3<f64>) -> Self {
        Self {
            sensor_from_block,
            cuboid: Cuboid::new(to_glam(&(size * 0.5))),
        }
    }

    /// Distance and outward normal where a ray enters the box, or leaves it if it starts inside.
    fn cast(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        let origin = self.sensor_from_block.inverse_transform_point(&ray.origin);
        let direction = self.sensor_from_block.inverse_transform_vector(&ray.direction);
        let local = parry3d::query::Ray::new(to_glam(&origin.coords), to_glam(&direction));
        let hit = self
            .cuboid
            .cast_local_ray_and_get_normal(&local, FARTHEST, false)?;
        let normal = self.sensor_from_block * Vector3::new(hit.normal.x, hit.normal.y, hit.normal.z);
        (hit.time_of_impact > 0.0).then(|| (hit.time_of_impact, Unit::new_normalize(normal)))
    }

    fn corners(&self) -> Vec<Point3<f64>> {
        let h = self.cuboid.half_extents;
        (0..8)
            .map(|i| {
                let sign = |bit: u8| if i & bit == 0 { -1.0 } else { 1.0 };
                self.sensor_from_block * Point3::new(sign(1) * h.x, sign(2) * h.y, sign(4) * h.z)
            })
            .collect()
    }
}

impl Shape {
    fn bounds(&self) -> Aabb {
        match self {
            Self::Polygon(polygon) => padded(polygon.corners.iter().copied()),
            Self::Block(block) => padded(block.corners().into_iter()),
            Self::Cylinder(cylinder) => padded(cylinder.corners().into_iter()),
            Self::Mesh(mesh) => padded(mesh.vertices().iter().copied()),
        }
    }

    /// Distance at which a ray meets it, and its normal there.
    fn cast(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        match self {
            Self::Polygon(polygon) => Some((polygon.cast(ray)?, polygon.normal)),
            Self::Block(block) => block.cast(ray),
            Self::Cylinder(cylinder) => cylinder.cast(ray),
            Self::Mesh(mesh) => mesh.cast(ray),
        }
    }

    /// Two corners of a box that holds it.
    pub(crate) fn corners_of_box(&self) -> (Point3<f64>, Point3<f64>) {
        let bounds = self.bounds();
        let corner = |v: Vector| Point3::new(v.x, v.y, v.z);
        (corner(bounds.mins), corner(bounds.maxs))
    }

    /// Whether another is the very same shape in the same place. Meshes are, where they are one.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Polygon(a), Self::Polygon(b)) => a.corners == b.corners,
            (Self::Block(a), Self::Block(b)) => {
                a.sensor_from_block == b.sensor_from_block && a.cuboid == b.cuboid
            }
            (Self::Cylinder(a), Self::Cylinder(b)) => {
                a.frame_from_cylinder == b.frame_from_cylinder
                    && (a.radius, a.half_height) == (b.radius, b.half_height)
            }
            (Self::Mesh(a), Self::Mesh(b)) => Arc::ptr_eq(a, b),
            _ => false,
        }
    }

    /// Whether a point is inside a closed body: what a ray from there meets first is a back.
    pub(crate) fn holds(&self, point: &Point3<f64>) -> bool {
        let ray = Ray {
            origin: *point,
            direction: Vector3::x_axis(),
        };
        self.cast(&ray)
            .is_some_and(|(_, normal)| normal.dot(&ray.direction) > 0.0)
    }

    /// Distance at which a ray meets it.
    pub(crate) fn distance(&self, ray: &Ray) -> Option<f64> {
        Some(self.cast(ray)?.0)
    }
}

impl World {
    /// Indexes the shapes; a hit names a shape by its place in this list.
    pub fn new(shapes: Vec<Shape>) -> Self {
        let boxes: Vec<Aabb> = shapes.iter().map(Shape::bounds).collect();
        let corner = |v: Vector| Vector3::new(v.x, v.y, v.z);
        let corners: Vec<_> = boxes.iter().map(|b| (corner(b.mins), corner(b.maxs))).collect();
        let reach = corners
            .iter()
            .fold(0.0, |m: f64, (a, b)| m.max(a.amax()).max(b.amax()));
        let reach = build::upwards(reach);
        Self {
            bvh: Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes),
            shapes,
            nodes: build::over_boxes(&corners, reach),
            reach,
        }
    }

    /// The shapes, in the order in which hits name them.
    pub(crate) fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// The nearest surface along a ray, `left` (the mirror it just left) aside.
    pub fn cast(&self, ray: &Ray, left: Option<usize>) -> Option<Hit> {
        Some(self.hit(&self.contact(ray, left)?, ray))
    }

    fn contact(&self, ray: &Ray, left: Option<usize>) -> Option<Contact> {
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

    /// Product of the direction of a ray with the normal of a surface where it meets it, if it is a mesh on a triangle.
    fn closing(&self, surface: u32, triangle: u32, ray: &Ray) -> f64 {
        match &self.shapes[surface as usize] {
            Shape::Mesh(mesh) => mesh.closing(triangle, ray),
            _ => self.normal(surface, triangle, ray).dot(&ray.direction),
        }
    }

    /// Normal of a surface where a ray meets it, if it is a mesh on a triangle.
    fn normal(&self, surface: u32, triangle: u32, ray: &Ray) -> Unit<Vector3<f64>> {
        match &self.shapes[surface as usize] {
            Shape::Polygon(polygon) => polygon.normal,
            Shape::Mesh(mesh) => mesh.normal(triangle, ray),
            // It is met.
            other => other.cast(ray).map_or(-ray.direction, |(_, normal)| normal),
        }
    }

    /// The nearest surface along each of some rays, `left` aside: what [`World::cast`] says of each of them but for the point
    /// and the normal, which [`World::hit`] adds; faster if they are a narrow cone from nearly one point. Of surfaces at
    /// the very same distance the first counts.
    ///
    /// # Panics
    /// If there are not as many places for what they meet.
    pub fn cast_beam(&self, rays: &Rays, left: Option<usize>, contacts: &mut [Option<Contact>]) {
        self.cast_beam_at(Level::new(), rays, left, contacts);
    }

    /// All there is to know of where a ray meets a surface.
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

impl Hit {
    /// Whether the front was met.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}

impl Contact {
    /// Whether the front was met.
    pub fn front(&self) -> bool {
        self.closing < 0.0
    }

    /// Cosine of the incidence, from 0 to 1.
    pub fn cos_incidence(&self) -> f64 {
        self.closing.abs()
    }
}

/// A box around points, a little larger than they need.
fn padded(points: impl Iterator<Item = Point3<f64>>) -> Aabb {
    let mut aabb = Aabb::from_points(points.map(|p| to_glam(&p.coords)));
    aabb.mins -= Vector::splat(BOX_SLACK);
    aabb.maxs += Vector::splat(BOX_SLACK);
    aabb
}

fn to_glam(v: &Vector3<f64>) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(x: f64) -> Shape {
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        Shape::Polygon(
            Polygon::new(corners.map(|(y, z)| Point3::new(x, y, z)).to_vec()).expect("it has an area"),
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
            let hit = world.cast(&towards(0.1, 0.2), None).expect("something is there");
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
    fn the_mirror_just_left_is_not_met_again() {
        let world = World::new(vec![square(1.0), square(2.0)]);
        assert_eq!(
            world.cast(&towards(0.0, 0.0), Some(0)).map(|h| h.surface),
            Some(1)
        );
    }

    #[test]
    fn a_box_is_met_on_its_near_face() {
        let pose = Pose::translation(3.0, 0.0, 0.0);
        let world = World::new(vec![
            Shape::Block(Block::new(pose, Vector3::new(0.5, 1.0, 1.0))),
            square(9.0),
        ]);
        let hit = world.cast(&towards(0.0, 0.0), None).expect("it is in the way");
        assert!((hit.distance - 2.75).abs() < 1e-12 && hit.front());
        assert!((hit.normal.into_inner() + Vector3::x()).norm() < 1e-12);
    }
}
