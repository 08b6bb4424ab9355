//! A fast lower bound on the distance from a point to what is in the room.
//!
//! Light traveling from mirror to mirror of the structure stays within a ball around the sensor. No part of the room
//! that is farther away can be in its path.

mod grid;

use catoptric_cast::{Polygon, Shape};
use grid::Grid;
use nalgebra::{Point3, Vector3};

/// Bounds on where a shape of the room is.
#[derive(Debug, Clone)]
pub(super) enum Extent {
    /// A plane outline: its plane, and for every edge the half plane that it bounds, as unit normal and offset.
    Outline(Vec<(Vector3<f64>, f64)>),
    /// A box around any other shape.
    Box(Point3<f64>, Point3<f64>),
    /// A mesh that the sensor flies past or within.
    Mesh(Grid),
}

/// Margin of a box, as a fraction of its diagonal: the triangles of a cylinder are flat.
const MARGIN: f64 = 0.01;

/// Slack of the bound, in meters, far above rounding.
const SLACK: f64 = 1e-6;

impl Extent {
    /// The extent of a shape; that of a mesh is finer for a sensor that flies.
    pub(super) fn of(shape: &Shape, flies: bool) -> Self {
        match shape {
            Shape::Mesh(mesh) if flies => {
                let (low, high) = shape.corners_of_box();
                Self::Mesh(Grid::of(mesh.each(), (&low, &high)))
            }
            Shape::Polygon(polygon) => Self::Outline(outline(polygon)),
            Shape::Mesh(mesh) => around(mesh.vertices().iter().copied()),
            _ => around(shape.triangles().into_iter().flatten()),
        }
    }

    /// Whether all of it is farther than a distance from a point, in meters; false in case of doubt.
    pub(super) fn is_beyond(&self, point: &Point3<f64>, distance: f64) -> bool {
        let distance = distance + SLACK;
        match self {
            Self::Outline(sides) => sides.iter().enumerate().any(|(i, (normal, offset))| {
                let beyond = offset - normal.dot(&point.coords);
                // Either side of the plane, but only the outside of an edge.
                beyond > distance || (i == 0 && -beyond > distance)
            }),
            Self::Box(low, high) => {
                let out = (low - point).sup(&(point - high)).sup(&Vector3::zeros());
                out.norm() > distance
            }
            Self::Mesh(grid) => grid.is_beyond(point, distance),
        }
    }
}

fn outline(polygon: &Polygon) -> Vec<(Vector3<f64>, f64)> {
    let normal = polygon.normal.into_inner();
    let next = polygon.corners.iter().cycle().skip(1);
    let edges = polygon.corners.iter().zip(next).filter_map(|(a, b)| {
        let inwards = normal.cross(&(b - a)).try_normalize(f64::MIN_POSITIVE)?;
        Some((inwards, inwards.dot(&a.coords)))
    });
    std::iter::once((normal, normal.dot(&polygon.origin.coords)))
        .chain(edges)
        .collect()
}

fn around(points: impl Iterator<Item = Point3<f64>>) -> Extent {
    let (mut low, mut high) = (
        Point3::from(Vector3::repeat(f64::INFINITY)),
        Point3::from(Vector3::repeat(f64::NEG_INFINITY)),
    );
    for point in points {
        low = low.inf(&point);
        high = high.sup(&point);
    }
    let margin = Vector3::repeat(MARGIN * (high - low).norm());
    Extent::Box(low - margin, high + margin)
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_cast::Block;
    use catoptric_model::Pose;

    #[test]
    fn bounds_are_below_the_distance_and_not_far_below() {
        let square = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let corners = square.map(|(x, y)| Point3::new(x, y, 2.0)).to_vec();
        let polygon = Extent::of(
            &Shape::Polygon(Polygon::new(corners).expect("it has an area")),
            false,
        );
        let origin = Point3::origin();
        assert!(polygon.is_beyond(&origin, 1.99) && !polygon.is_beyond(&origin, 2.0));
        // Next to it, in its plane.
        let beside = Point3::new(4.0, 0.0, 2.0);
        assert!(polygon.is_beyond(&beside, 2.99) && !polygon.is_beyond(&beside, 3.0));
        let size = Vector3::new(1.0, 1.0, 1.0);
        let block = Extent::of(
            &Shape::Block(Block::new(Pose::translation(3.0, 0.0, 0.0), size)),
            false,
        );
        assert!(block.is_beyond(&origin, 2.45) && !block.is_beyond(&origin, 2.5));
        assert!(!block.is_beyond(&Point3::new(3.1, 0.2, 0.0), 0.0));
    }
}
