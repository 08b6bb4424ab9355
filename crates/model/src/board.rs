//! Target boards: the plane whose range a beam measures, and the rectangle that bounds it.

use crate::error::ModelError;
use crate::frame::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// The plane of a target, through `point` with unit `normal`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardPlane {
    /// A point c of the plane.
    pub point: Point3<f64>,
    /// Unit normal n; its sign has no effect on a range.
    pub normal: Unit<Vector3<f64>>,
}

impl BoardPlane {
    /// The plane through a point with a given normal.
    pub fn new(point: Point3<f64>, normal: Unit<Vector3<f64>>) -> Self {
        Self { point, normal }
    }

    /// The plane z = 0 of a board with a known pose.
    pub fn of_pose(a_from_board: &Pose) -> Self {
        Self {
            point: Point3::from(a_from_board.translation.vector),
            normal: Unit::new_unchecked(a_from_board.rotation * Vector3::z()),
        }
    }

    /// The plane through the three target points P_p1, P_p2, P_p3.
    ///
    /// # Errors
    /// [`ModelError::CollinearPoints`] if the points do not span a plane.
    #[doc(alias = "P_p1")]
    pub fn from_points(p1: Point3<f64>, p2: Point3<f64>, p3: Point3<f64>) -> Result<Self, ModelError> {
        let cross = (p2 - p1).cross(&(p3 - p1));
        let longest = (p2 - p1).norm().max((p3 - p1).norm());
        Unit::try_new(cross, longest * longest * 1e-12)
            .map(|normal| Self::new(p1, normal))
            .ok_or(ModelError::CollinearPoints {
                area_m2: 0.5 * cross.norm(),
            })
    }

    /// Distance along a ray to the plane: s = n·(c − p)/(n·v). `None` if the ray runs along the plane or away.
    #[inline]
    pub fn distance_along(&self, origin: &Point3<f64>, direction: &Unit<Vector3<f64>>) -> Option<f64> {
        let closing = self.normal.dot(direction);
        let s = self.normal.dot(&(self.point - origin)) / closing;
        (closing != 0.0 && s > 0.0).then_some(s)
    }

    /// Cosine of the incidence θ_N between the board's normal and a ray, `0 ≤ cos θ_N ≤ 1`.
    #[doc(alias = "theta_N")]
    #[inline]
    pub fn cos_incidence(&self, direction: &Unit<Vector3<f64>>) -> f64 {
        self.normal.dot(direction).abs().min(1.0)
    }
}

/// A rectangle in its own plane z = 0, centered on the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    /// Extent along x, in meters.
    pub width: f64,
    /// Extent along y, in meters.
    pub height: f64,
}

impl Rectangle {
    /// Whether a point of the plane is inside by at least `margin` meters (outside, if the margin is negative).
    pub fn contains(&self, point_in_board: &Point3<f64>, margin: f64) -> bool {
        point_in_board.x.abs() <= 0.5 * self.width - margin
            && point_in_board.y.abs() <= 0.5 * self.height - margin
    }

    /// The four corners, counter-clockwise seen from +z.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let (x, y) = (0.5 * self.width, 0.5 * self.height);
        [
            Point3::new(-x, -y, 0.0),
            Point3::new(x, -y, 0.0),
            Point3::new(x, y, 0.0),
            Point3::new(-x, y, 0.0),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_points_determine_their_plane() {
        let points = [
            Point3::new(1.0, 0.0, 0.2),
            Point3::new(1.0, 2.0, -0.1),
            Point3::new(1.5, 0.3, 1.0),
        ];
        let plane =
            BoardPlane::from_points(points[0], points[1], points[2]).expect("the points span a plane");
        for p in points {
            assert!(plane.normal.dot(&(p - plane.point)).abs() < 1e-15);
        }
    }

    #[test]
    fn collinear_points_are_rejected() {
        let at = |t: f64| Point3::new(1.0 + t, 2.0 * t, -t);
        assert!(matches!(
            BoardPlane::from_points(at(0.0), at(0.5), at(1.0)),
            Err(ModelError::CollinearPoints { .. })
        ));
    }
}
