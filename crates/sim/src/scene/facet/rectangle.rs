//! Rectangle: a facet with a center and a normal.

use super::outline::{check_side, rectangle};
use super::turn::Turn;
use crate::findings::Findings;
use catoptric_model::place::KeyPath;
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A rectangular facet.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RectangleShape {
    /// Center, in millimeters.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
    pub center_mm: [f64; 3],
    /// Normal of the reflecting side; any length.
    #[schemars(inner(range(min = -100000.0, max = 100000.0)))]
    pub normal: [f64; 3],
    /// Extent parallel to the scan plane, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub width_mm: f64,
    /// Extent along the other side, in millimeters.
    #[schemars(range(min = 0.1, max = 10000.0))]
    pub height_mm: f64,
}

impl RectangleShape {
    pub(super) fn corners(&self) -> Option<Vec<Point3<f64>>> {
        rectangle(
            Point3::from(Vector3::from(self.center_mm) * 1e-3),
            self.normal.into(),
            [1e-3 * self.width_mm, 1e-3 * self.height_mm],
        )
    }

    pub(super) fn turn(&mut self, turn: &Turn) {
        self.center_mm = turn.point(self.center_mm);
        self.normal = turn.point(self.normal);
    }

    /// Reflects it along an axis.
    pub(super) fn reflect(&mut self, axis: usize) {
        self.center_mm[axis] = -self.center_mm[axis];
        self.normal[axis] = -self.normal[axis];
    }

    /// Checks it; `path` leads to it.
    pub(super) fn check(&self, path: &KeyPath, found: &mut Findings) {
        let Some(corners) = self.corners() else {
            let path = path.key("normal");
            found.add(
                &path,
                "has length 0; a normal of any other length is allowed",
                None,
            );
            return;
        };
        let help = "reverse the normal: it points from the mirror toward the scanner's side";
        check_side(&corners, &path.key("normal"), help, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use catoptric_cast::area_vector;
    use catoptric_model::beam;
    use nalgebra::Unit;

    #[test]
    fn a_rectangle_faces_along_its_normal() {
        let shape = RectangleShape {
            center_mm: [0.0, 94.0, 0.0],
            normal: [0.45, -0.33, -0.4036],
            width_mm: 68.0,
            height_mm: 20.0,
        };
        let corners = shape.corners().expect("it is a mirror");
        let m = Unit::new_normalize(Vector3::from(shape.normal));
        let area = area_vector(&corners);
        assert!((area.norm() * 0.5 - 0.068 * 0.02).abs() < 1e-12);
        assert!(beam::angle_between(&Unit::new_normalize(area), &m) < 1e-12);
        assert!((corners[0].z - corners[1].z).abs() < 1e-15);
    }
}
