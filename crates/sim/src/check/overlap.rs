//! Checks that mirrors stand clear of each other and of the scanner: where one body passes through another.
//!
//! A mirror is its reflecting face as drawn; one that is not flat is made of triangles. Posts are left out: they carry mirrors, which pass through them. Faces may share an edge or a corner, and an edge may
//! lie on another face: what is less than [`CLEARANCE_M`] deep is a touch, as drawings round their numbers.

use super::outline::{Face, Obstacles};
use crate::findings::Findings;
use crate::scene::facet::outline::rounded;
use crate::scene::{HousingBox, Scene};
use catoptric_model::place::KeyPath;
use nalgebra::{Point3, Vector3};

/// How deep one body may reach into another: what a workshop can make, and more than drawings round.
const CLEARANCE_M: f64 = 1e-4;

pub(super) fn check(scene: &Scene, obstacles: &Obstacles, found: &mut Findings) {
    let drawn = &scene.superstructure;
    let housing = scene.scanner.housing_boxes();
    let balls: Vec<Ball> = obstacles.facets.iter().map(Ball::around).collect();
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
            let other = other.as_ref().filter(|_| balls[i].touches(&balls[k]))?;
            Some((k, meeting(&face.pieces(), &other.pieces())?))
        });
        if let Some((k, at)) = other {
            add(&format!("facet {:?}", drawn.facet[k].name), at);
        }
        let into = |part: &HousingBox| face.pieces().into_iter().find_map(|piece| piece.inside(part));
        if let Some(at) = boxes.iter().find_map(into) {
            add("the scanner's housing", at);
        }
    }
}

/// Where one of some faces passes through one of others.
fn meeting(some: &[&Face], others: &[&Face]) -> Option<Point3<f64>> {
    let mut pairs = some.iter().flat_map(|a| others.iter().map(move |b| (a, b)));
    pairs.find_map(|(a, b)| a.meets(b).or_else(|| b.meets(a)))
}

/// A ball around a face, since most faces are far from each other.
struct Ball {
    center: Point3<f64>,
    radius: f64,
}

impl Ball {
    /// Around nothing, it touches nothing.
    fn around(face: &Option<Face>) -> Self {
        let pieces = face.as_ref().map(Face::pieces).unwrap_or_default();
        let corners: Vec<Point3<f64>> = pieces.iter().flat_map(|f| f.corners.iter().copied()).collect();
        let center = middle(&corners);
        let radius = corners.iter().map(|c| (c - center).norm()).fold(0.0, f64::max);
        Self { center, radius }
    }

    fn touches(&self, other: &Self) -> bool {
        let reach = self.radius + other.radius;
        (self.center - other.center).norm_squared() <= reach * reach
    }
}

/// The windows of a housing: what lies between a box below the scan plane and one above it, as wide as the wider of them.
fn windows(housing: &[HousingBox]) -> Vec<HousingBox> {
    let edge =
        |part: &HousingBox, axis: usize, sign: f64| part.center_mm[axis] + sign * 0.5 * part.size_mm[axis];
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
                        edge(low, axis, -1.0).min(edge(high, axis, -1.0)),
                        edge(low, axis, 1.0).max(edge(high, axis, 1.0)),
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
    /// Itself, or the triangles that stand for it.
    fn pieces(&self) -> Vec<&Self> {
        if self.triangles.is_empty() {
            vec![self]
        } else {
            self.triangles.iter().collect()
        }
    }

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
    fn inside(&self, part: &HousingBox) -> Option<Point3<f64>> {
        let mut rest = self.corners.clone();
        for axis in 0..3 {
            let mut up = Vector3::zeros();
            up[axis] = 1.0;
            let (middle, half) = (
                1e-3 * part.center_mm[axis],
                0.5e-3 * part.size_mm[axis] - CLEARANCE_M,
            );
            rest = clipped(&clipped(&rest, &up, half + middle), &-up, half - middle);
        }
        (!rest.is_empty()).then(|| middle(&rest))
    }
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

fn middle(points: &[Point3<f64>]) -> Point3<f64> {
    let sum: Vector3<f64> = points.iter().map(|p| p.coords).sum();
    Point3::from(sum / points.len() as f64)
}

#[cfg(test)]
mod tests;
