//! Checks that mirrors stand clear of each other, of the posts and of the scanner: where one body passes through another.
//!
//! A mirror is its reflecting face as drawn, without what carries it. Faces may share an edge or a corner, and an edge may
//! lie on another face: what is less than [`CLEARANCE_M`] deep is a touch, as drawings round their numbers.

use super::outline::{Face, Obstacles};
use crate::findings::Findings;
use crate::scene::facet::outline::rounded;
use crate::scene::{HousingBox, PostShape, Scene};
use catoptric_model::Pose;
use catoptric_model::frame::yaw_pitch_roll;
use catoptric_model::place::KeyPath;
use nalgebra::{Point3, Translation3, Vector3};

/// How deep one body may reach into another: what a workshop can make, and more than drawings round.
const CLEARANCE_M: f64 = 1e-4;

pub(super) fn check(scene: &Scene, obstacles: &Obstacles, found: &mut Findings) {
    let drawn = &scene.superstructure;
    let housing = scene.scanner.housing_boxes();
    let boxes: Vec<HousingBox> = housing.iter().copied().chain(windows(housing)).collect();
    for (i, face) in obstacles.facets.iter().enumerate() {
        let Some(face) = face else { continue };
        let mut add = |what: &str, at: Point3<f64>| {
            found.add(
                &KeyPath::of("superstructure").key("facet").index(i),
                format_args!(
                    "({:?}) passes through {what} at ({}, {}, {}) mm in the sensor frame",
                    drawn.facet[i].name,
                    rounded(at.x * 1e3),
                    rounded(at.y * 1e3),
                    rounded(at.z * 1e3)
                ),
                format!("they may touch; up to {} mm is taken for that", CLEARANCE_M * 1e3),
            );
        };
        // One other mirror is enough: a row of mirrors that is too close is one mistake, not a mistake for each pair.
        let other = obstacles.facets[..i].iter().enumerate().find_map(|(k, other)| {
            let other = other.as_ref()?;
            Some((k, face.meets(other).or_else(|| other.meets(face))?))
        });
        if let Some((k, at)) = other {
            add(&format!("facet {:?}", drawn.facet[k].name), at);
        }
        if let Some(at) = boxes.iter().find_map(|part| face.inside_box(&upright(part), part.size_mm)) {
            add("the scanner's housing", at);
        }
        let post = drawn.post.iter().find_map(|post| {
            let turn = yaw_pitch_roll(
                post.yaw_deg.to_radians(),
                post.pitch_deg.to_radians(),
                post.roll_deg.to_radians(),
            );
            let pose = Pose::from_parts(Translation3::from(Vector3::from(post.center_mm) * 1e-3), turn);
            let at = match (&post.shape, post.size_mm) {
                (Some(PostShape::Cylinder(c)), _) => {
                    face.inside_cylinder(&pose, 0.5e-3 * c.diameter_mm, 0.5e-3 * c.height_mm)
                }
                // A mesh is often a holder with a slot for its mirror, drawn in whatever detail.
                (Some(PostShape::Mesh(_)), _) | (None, None) => None,
                (None, Some(size)) => face.inside_box(&pose, size),
            };
            Some((&post.name, at?))
        });
        if let Some((name, at)) = post {
            add(&format!("post {name:?}"), at);
        }
    }
}

fn upright(part: &HousingBox) -> Pose {
    Pose::translation(
        part.center_mm[0] * 1e-3,
        part.center_mm[1] * 1e-3,
        part.center_mm[2] * 1e-3,
    )
}

/// The windows of a housing: what lies between a box below the scan plane and one above it.
fn windows(housing: &[HousingBox]) -> Vec<HousingBox> {
    let edge = |part: &HousingBox, axis: usize, sign: f64| part.center_mm[axis] + sign * 0.5 * part.size_mm[axis];
    let below = housing.iter().filter(|part| edge(part, 2, 1.0) <= 0.0);
    let pairs = below.flat_map(|low| {
        let above = housing.iter().filter(|part| edge(part, 2, -1.0) >= 0.0);
        above.map(move |high| (low, high))
    });
    pairs
        .filter_map(|(low, high)| {
            let mut window = *low;
            for axis in 0..3 {
                let (from, to) = if axis == 2 {
                    (edge(low, 2, 1.0), edge(high, 2, -1.0))
                } else {
                    (
                        edge(low, axis, -1.0).max(edge(high, axis, -1.0)),
                        edge(low, axis, 1.0).min(edge(high, axis, 1.0)),
                    )
                };
                window.center_mm[axis] = 0.5 * (from + to);
                window.size_mm[axis] = to - from;
            }
            (window.size_mm.iter().all(|size| *size > 0.0)).then_some(window)
        })
        .collect()
}

impl Face {
    /// Where this face passes through another one; `None` where they touch or stand apart.
    fn meets(&self, other: &Self) -> Option<Point3<f64>> {
        let normal = other.plane.normal.into_inner();
        let height = |p: &Point3<f64>| normal.dot(&p.coords) - other.plane.offset;
        let apart = |heights: &[f64]| {
            heights.iter().all(|h| *h > -CLEARANCE_M) || heights.iter().all(|h| *h < CLEARANCE_M)
        };
        let heights: Vec<f64> = self.corners.iter().map(height).collect();
        let flat = heights.iter().all(|h| h.abs() < CLEARANCE_M);
        if !flat && apart(&heights) {
            return None;
        }
        // What of this face is above or below the other one, whose outline runs counter-clockwise about its normal.
        let mut over = self.corners.clone();
        let edges = other.corners.iter().zip(other.corners.iter().cycle().skip(1));
        for (from, to) in edges {
            let Some(outward) = (to - from).cross(&normal).try_normalize(0.0) else {
                continue;
            };
            over = clipped(&over, &outward, outward.dot(&from.coords) - CLEARANCE_M);
        }
        let heights: Vec<f64> = over.iter().map(height).collect();
        if over.len() < 3 || (!flat && apart(&heights)) {
            return None;
        }
        if flat {
            return Some(middle(&over));
        }
        let ends = over.iter().zip(over.iter().cycle().skip(1));
        let crossings = ends.filter_map(|(a, b)| {
            let (below, above) = (height(a), height(b));
            (below * above <= 0.0 && below != above).then(|| a + (b - a) * (below / (below - above)))
        });
        Some(middle(&crossings.collect::<Vec<_>>()))
    }

    /// Where it reaches into a box.
    fn inside_box(&self, frame_from_box: &Pose, size_mm: [f64; 3]) -> Option<Point3<f64>> {
        let box_from_frame = frame_from_box.inverse();
        let mut rest: Vec<Point3<f64>> = self.corners.iter().map(|c| box_from_frame * c).collect();
        for (axis, size) in size_mm.iter().enumerate() {
            rest = between(&rest, axis, 0.5e-3 * size - CLEARANCE_M);
        }
        (!rest.is_empty()).then(|| frame_from_box * middle(&rest))
    }

    /// Where it reaches into a cylinder about its own z axis.
    fn inside_cylinder(&self, frame_from_cylinder: &Pose, radius: f64, half_height: f64) -> Option<Point3<f64>> {
        let cylinder_from_frame = frame_from_cylinder.inverse();
        let corners: Vec<Point3<f64>> = self.corners.iter().map(|c| cylinder_from_frame * c).collect();
        let rest = between(&corners, 2, half_height - CLEARANCE_M);
        // The point of the rest nearest to the axis: seen along it, the rest is a convex outline.
        let nearest = nearest_to_axis(&rest)?;
        let reach = libm::hypot(nearest.x, nearest.y);
        (reach < radius - CLEARANCE_M).then(|| frame_from_cylinder * nearest)
    }
}

/// The part of a convex outline with a coordinate between −half and half.
fn between(corners: &[Point3<f64>], axis: usize, half: f64) -> Vec<Point3<f64>> {
    let mut up = Vector3::zeros();
    up[axis] = 1.0;
    clipped(&clipped(corners, &up, half), &-up, half)
}

/// The part of a convex outline with normal · p ≤ offset (Sutherland and Hodgman 1974).
fn clipped(corners: &[Point3<f64>], normal: &Vector3<f64>, offset: f64) -> Vec<Point3<f64>> {
    let beyond = |p: &Point3<f64>| normal.dot(&p.coords) - offset;
    let mut rest = Vec::with_capacity(corners.len() + 1);
    for (a, b) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let (at_a, at_b) = (beyond(a), beyond(b));
        if at_a <= 0.0 {
            rest.push(*a);
        }
        if (at_a < 0.0 && at_b > 0.0) || (at_a > 0.0 && at_b < 0.0) {
            rest.push(a + (b - a) * (at_a / (at_a - at_b)));
        }
    }
    rest
}

/// The point of a convex outline nearest to the z axis.
fn nearest_to_axis(corners: &[Point3<f64>]) -> Option<Point3<f64>> {
    let edges = || corners.iter().zip(corners.iter().cycle().skip(1));
    let first = corners.first()?;
    let turns: Vec<f64> = edges().map(|(a, b)| a.x * b.y - a.y * b.x).collect();
    // The axis passes through it.
    let encloses = turns.iter().all(|t| *t > 0.0) || turns.iter().all(|t| *t < 0.0);
    if encloses {
        let normal = catoptric_cast::area_vector(corners);
        return Some(Point3::new(0.0, 0.0, normal.dot(&first.coords) / normal.z));
    }
    let on_edges = edges().map(|(a, b)| {
        let along = b - a;
        let length = along.x * along.x + along.y * along.y;
        let share = if length > 0.0 {
            (-(a.x * along.x + a.y * along.y) / length).clamp(0.0, 1.0)
        } else {
            0.0
        };
        a + along * share
    });
    on_edges.min_by(|a, b| libm::hypot(a.x, a.y).total_cmp(&libm::hypot(b.x, b.y)))
}

fn middle(points: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
    Point3::from(sum / points.len() as f64)
}

#[cfg(test)]
mod tests;
