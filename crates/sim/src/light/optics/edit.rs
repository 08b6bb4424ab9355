//! Which of the known paths a change of the structure can affect.
//!
//! A path stays the same, bit for bit, if no surface that it hit has changed and no new one comes between the ends of
//! its legs. So moving a facet affects the paths that hit it where it was, and those that pass through the box around
//! where it is now.

use super::path::{End, RayPath};
use super::setting::Setting;
use catoptric_cast::Ray;
use nalgebra::{Point3, Vector3};

/// Where the rays of a beam passed the structure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trail {
    /// Each leg with its length, infinite in the open.
    legs: Vec<(Ray, f64)>,
    /// Surfaces at the ends of legs.
    met: Vec<usize>,
    /// Whether it is not known where all rays passed.
    unknown: bool,
}

/// The differences between two structures that have the same number of surfaces of the same kinds.
#[derive(Debug, Clone, PartialEq)]
pub struct Edit {
    /// Whether a surface has changed.
    changed: Vec<bool>,
    /// Boxes around the changed surfaces, as they are now.
    boxes: Vec<(Point3<f64>, Point3<f64>)>,
}

/// Margin of a box around its contents, in meters: far above rounding.
const SLACK: f64 = 1e-6;

impl Setting<'_> {
    /// The paths of the rays of a beam, as from [`Setting::trace_beam`], and their trail.
    pub fn trace_with_trail(&self, rays: &[Ray]) -> (Vec<RayPath>, Trail) {
        let mut trail = Trail::default();
        let mut last = rays.to_vec();
        let paths = self.trace_and_visit(rays, |ray, bounce| {
            let length = (bounce.point - last[ray].origin).norm();
            trail.add(last[ray], length, Some(bounce.surface));
            last[ray] = bounce.after;
        });
        for path in &paths {
            match path.end {
                End::Hit(hit) => trail.add(path.last, hit.distance, Some(hit.surface)),
                End::Escaped => trail.add(path.last, f64::INFINITY, None),
                // Where it was trapped is not known.
                End::Trapped => trail.unknown = true,
            }
        }
        (paths, trail)
    }
}

impl Trail {
    /// Makes it one that any change affects: more rays counted than have left it.
    pub fn take_any(&mut self) {
        self.unknown = true;
    }

    fn add(&mut self, leg: Ray, length: f64, met: Option<usize>) {
        self.legs.push((leg, length));
        if let Some(surface) = met
            && !self.met.contains(&surface)
        {
            self.met.push(surface);
        }
    }
}

impl Edit {
    /// The changes from one structure to another; `None` if they do not have the same surfaces in the same order, or if
    /// either setting holds more than a structure.
    pub fn between(old: &Setting<'_>, new: &Setting<'_>) -> Option<Self> {
        let (before, after) = (old.structure_alone()?.shapes(), new.structure_alone()?.shapes());
        if before.len() != after.len() || old.contents.max_bounces != new.contents.max_bounces {
            return None;
        }
        let mut edit = Self {
            changed: Vec::with_capacity(after.len()),
            boxes: Vec::new(),
        };
        for (surface, (was, is)) in before.iter().zip(after).enumerate() {
            if !old.is_same_kind(new, surface) {
                return None;
            }
            let same = was.is_same(is) && old.reflects_identically(new, surface);
            edit.changed.push(!same);
            if !same {
                let (low, high) = is.corners_of_box();
                let slack = Vector3::repeat(SLACK);
                edit.boxes.push((low - slack, high + slack));
            }
        }
        Some(edit)
    }

    /// Whether the paths that left a trail may be different now.
    pub fn may_change(&self, trail: &Trail) -> bool {
        let meets = |(leg, length): &(Ray, f64)| self.boxes.iter().any(|b| passes(leg, *length, b));
        !self.boxes.is_empty()
            && (trail.unknown || trail.met.iter().any(|s| self.changed[*s]) || trail.legs.iter().any(meets))
    }
}

/// Whether a leg may pass through a box.
fn passes(leg: &Ray, length: f64, (low, high): &(Point3<f64>, Point3<f64>)) -> bool {
    let (mut enters, mut leaves) = (-SLACK, length + SLACK);
    for k in 0..3 {
        let (from, per) = (leg.origin[k], 1.0 / leg.direction[k]);
        if per.is_infinite() {
            // Parallel to these sides: outside of them or between them along the whole leg.
            if from < low[k] || from > high[k] {
                return false;
            }
            continue;
        }
        let (a, b) = ((low[k] - from) * per, (high[k] - from) * per);
        enters = enters.max(a.min(b));
        leaves = leaves.min(a.max(b));
    }
    enters <= leaves
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Unit;

    #[test]
    fn legs_pass_boxes_between_their_ends_only() {
        let of = (Point3::new(1.0, -1.0, -1.0), Point3::new(2.0, 1.0, 1.0));
        let ray = |y: f64, direction: Vector3<f64>| Ray {
            origin: Point3::new(0.0, y, 0.0),
            direction: Unit::new_normalize(direction),
        };
        let along = ray(0.0, Vector3::x());
        assert!(passes(&along, f64::INFINITY, &of) && passes(&along, 1.0, &of));
        assert!(!passes(&along, 0.9, &of));
        assert!(!passes(&ray(0.0, -Vector3::x()), f64::INFINITY, &of));
        assert!(!passes(&ray(1.1, Vector3::x()), f64::INFINITY, &of));
        assert!(passes(&ray(1.0, Vector3::x()), f64::INFINITY, &of));
        assert!(passes(&ray(2.0, Vector3::new(1.0, -1.0, 0.0)), 3.0, &of));
    }
}
