//! The surfaces that a ray can hit: polygon, curved mirror, box, cylinder or mesh.

use crate::hit::NONE;
use crate::mesh::Triangles;
use crate::ray::Ray;
use crate::solid::block::to_glam;
use crate::solid::{Block, Curved, Cylinder, Polygon};
use nalgebra::{Point3, Unit, Vector3};
use parry3d::bounding_volume::Aabb;
use parry3d::math::Vector;
use std::sync::Arc;

/// A surface or body that a ray can hit.
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
    /// A curved mirror.
    Curved(Arc<Curved>),
}

/// Padding of a bounding box, in meters: a plane polygon's box is flat, and rounding must not make a ray miss it.
const BOX_SLACK: f64 = 1e-9;

impl Shape {
    pub(crate) fn bounds(&self) -> Aabb {
        match self {
            Self::Polygon(polygon) => padded(polygon.corners.iter().copied()),
            Self::Block(block) => padded(block.corners().into_iter()),
            Self::Cylinder(cylinder) => padded(cylinder.corners().into_iter()),
            Self::Mesh(mesh) => padded(mesh.vertices().iter().copied()),
            Self::Curved(curved) => padded(curved.corners()),
        }
    }

    /// Returns the distance at which a ray hits the shape, and the triangle of a mesh, otherwise [`NONE`].
    pub(crate) fn hit(&self, ray: &Ray) -> Option<(f64, u32)> {
        match self {
            Self::Polygon(polygon) => Some((polygon.cast(ray)?, NONE)),
            Self::Block(block) => Some((block.cast(ray)?.0, NONE)),
            Self::Cylinder(cylinder) => Some((cylinder.cast(ray)?.0, NONE)),
            Self::Mesh(mesh) => {
                let hit = mesh.cast(ray)?;
                Some((hit.distance, hit.triangle))
            }
            Self::Curved(curved) => Some((curved.cast(ray)?, NONE)),
        }
    }

    /// Returns the distance at which a ray hits the shape, and the normal there.
    pub(crate) fn intersect(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        match self {
            Self::Polygon(polygon) => Some((polygon.cast(ray)?, polygon.normal)),
            Self::Block(block) => block.cast(ray),
            Self::Cylinder(cylinder) => cylinder.cast(ray),
            Self::Mesh(mesh) => mesh.intersect(ray),
            Self::Curved(curved) => {
                let distance = curved.cast(ray)?;
                Some((distance, curved.normal(ray, distance)))
            }
        }
    }

    /// Returns the lowest and highest corner of the bounding box.
    pub fn corners_of_box(&self) -> (Point3<f64>, Point3<f64>) {
        let bounds = self.bounds();
        let corner = |v: Vector| Point3::new(v.x, v.y, v.z);
        (corner(bounds.mins), corner(bounds.maxs))
    }

    /// Whether another shape is identical, in the same pose. Meshes are compared by reference.
    pub fn is_same(&self, other: &Self) -> bool {
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
            (Self::Curved(a), Self::Curved(b)) => {
                a.outline.corners == b.outline.corners && a.surface == b.surface
            }
            (Self::Polygon(_) | Self::Block(_) | Self::Cylinder(_) | Self::Mesh(_) | Self::Curved(_), _) => {
                false
            }
        }
    }

    /// Whether a point is inside a closed body: a ray from there first hits a back face.
    pub fn holds(&self, point: &Point3<f64>) -> bool {
        let ray = Ray {
            origin: *point,
            direction: Vector3::x_axis(),
        };
        self.intersect(&ray)
            .is_some_and(|(_, normal)| normal.dot(&ray.direction) > 0.0)
    }

    /// Returns the distance at which a ray that leaves the shape hits it again: only a curved mirror can be.
    pub(crate) fn hit_again(&self, ray: &Ray) -> Option<(f64, u32)> {
        match self {
            Self::Curved(curved) => Some((curved.cast_again(ray)?, NONE)),
            Self::Polygon(_) | Self::Block(_) | Self::Cylinder(_) | Self::Mesh(_) => None,
        }
    }

    /// Returns the distance at which a ray hits the shape.
    pub fn distance(&self, ray: &Ray) -> Option<f64> {
        Some(self.hit(ray)?.0)
    }
}

/// Returns the bounding box of points, padded by [`BOX_SLACK`].
fn padded(points: impl Iterator<Item = Point3<f64>>) -> Aabb {
    let mut aabb = Aabb::from_points(points.map(|p| to_glam(&p.coords)));
    aabb.mins -= Vector::splat(BOX_SLACK);
    aabb.maxs += Vector::splat(BOX_SLACK);
    aabb
}
