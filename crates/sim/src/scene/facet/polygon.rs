//! Polygon: a facet with given corners.

use super::outline::{check_outline, check_side};
use super::turn::Turn;
use crate::findings::Findings;
use catoptric_model::place::KeyPath;
use nalgebra::{Point3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A facet with given corners.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PolygonShape {
    /// Corners of a convex plane polygon, in millimeters, counter-clockwise seen from the reflecting side.
    #[schemars(length(min = 3))]
    #[schemars(inner(inner(range(min = -100000.0, max = 100000.0))))]
    pub corners_mm: Vec<[f64; 3]>,
}

impl PolygonShape {
    pub(super) fn corners(&self) -> Vec<Point3<f64>> {
        let corners = self.corners_mm.iter();
        corners.map(|c| Point3::from(Vector3::from(*c) * 1e-3)).collect()
    }

    pub(super) fn turn(&mut self, turn: &Turn) {
        for corner in &mut self.corners_mm {
            *corner = turn.point(*corner);
        }
    }

    /// Reflects the corners along an axis and reverses their order, since a reflection reverses the orientation.
    pub(super) fn reflect(&mut self, axis: usize) {
        for corner in &mut self.corners_mm {
            corner[axis] = -corner[axis];
        }
        self.corners_mm.reverse();
    }

    /// Checks it; `path` leads to it. That there are three corners is up to the schema.
    pub(super) fn check(&self, path: &KeyPath, found: &mut Findings) {
        let (corners, path) = (self.corners(), path.key("corners_mm"));
        if corners.len() < 3 || !check_outline(&corners, &path, found) {
            return;
        }
        let help = "list the corners in the opposite order: counter-clockwise seen from the scanner's side";
        check_side(&corners, &path, help, found);
    }
}
