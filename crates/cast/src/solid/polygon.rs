//! Exact intersection of a ray with a convex plane polygon.

use crate::ray::{FARTHEST, Ray};
use nalgebra::{Point3, Unit, Vector3};

/// A convex plane polygon; its front is the side from which the corners are counterclockwise.
#[derive(Debug, Clone)]
pub struct Polygon {
    /// A point of the plane: the first corner.
    pub origin: Point3<f64>,
    /// Normal of the front.
    pub normal: Unit<Vector3<f64>>,
    /// The corners.
    pub corners: Vec<Point3<f64>>,
    /// For every edge, the inward unit vector in the plane, and its dot product with any point of the edge.
    pub(crate) edges: Vec<(Vector3<f64>, f64)>,
}

/// Slack at a polygon's edge, in meters: polygons that share an edge leave no gap, and the slack is six orders of
/// magnitude below any distance that matters.
pub(crate) const EDGE_SLACK: f64 = 1e-12;

impl Polygon {
    /// Returns the polygon with these corners, or `None` if their area is zero.
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

    /// Returns the distance at which a ray hits the polygon, from either side.
    pub(crate) fn cast(&self, ray: &Ray) -> Option<f64> {
        let closing = self.normal.dot(&ray.direction);
        let distance = self.normal.dot(&(self.origin - ray.origin)) / closing;
        // A ray parallel to the plane yields an infinity or NaN, which fails the comparison.
        if !(distance > 0.0 && distance < FARTHEST) {
            return None;
        }
        let point = ray.origin + ray.direction.into_inner() * distance;
        self.contains(&point).then_some(distance)
    }

    /// Whether a point of the plane is within the outline.
    pub fn contains(&self, point: &Point3<f64>) -> bool {
        self.edges
            .iter()
            .all(|(inwards, edge)| inwards.dot(&point.coords) >= edge - EDGE_SLACK)
    }

    /// Returns the same outline with front and back exchanged.
    pub fn turned(&self) -> Option<Self> {
        Self::new(self.corners.iter().rev().copied().collect())
    }
}

/// Returns twice the vector area of a polygon (Newell): its direction is the normal of the side from which the corners are
/// counterclockwise.
pub fn area_vector(corners: &[Point3<f64>]) -> Vector3<f64> {
    let closed = corners.iter().zip(corners.iter().cycle().skip(1));
    closed.map(|(a, b)| a.coords.cross(&b.coords)).sum()
}
