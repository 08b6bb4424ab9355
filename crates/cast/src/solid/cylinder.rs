//! Closed-form intersection of a ray with a solid cylinder with flat caps.

use crate::ray::Ray;
use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// A solid cylinder about the z axis of its frame, centered on the origin.
#[derive(Debug, Clone)]
pub struct Cylinder {
    pub(crate) frame_from_cylinder: Pose,
    pub(crate) radius: f64,
    pub(crate) half_height: f64,
}

/// Distance along a ray, and the outward normal there in the cylinder's frame.
type Side = (f64, Vector3<f64>);

impl Cylinder {
    /// A cylinder of the given diameter and height, in meters.
    pub fn new(frame_from_cylinder: Pose, diameter: f64, height: f64) -> Self {
        Self {
            frame_from_cylinder,
            radius: 0.5 * diameter,
            half_height: 0.5 * height,
        }
    }

    /// Returns distance and outward normal where a ray enters the cylinder, or leaves it if it starts inside.
    ///
    /// The solid is the part of the infinite cylinder x² + y² ≤ r² between the planes z = ±h. The ray is inside it where
    /// its interval inside that cylinder, between the roots of a quadratic, overlaps its interval between the planes.
    pub(crate) fn cast(&self, ray: &Ray) -> Option<(f64, Unit<Vector3<f64>>)> {
        let origin = self.frame_from_cylinder.inverse_transform_point(&ray.origin);
        let direction = self.frame_from_cylinder.inverse_transform_vector(&ray.direction);
        let (column_in, column_out) = self.column(&origin, &direction)?;
        let (caps_in, caps_out) = self.caps(&origin, &direction)?;
        let enter = if column_in.0 > caps_in.0 {
            column_in
        } else {
            caps_in
        };
        let leave = if column_out.0 < caps_out.0 {
            column_out
        } else {
            caps_out
        };
        if enter.0 > leave.0 {
            return None;
        }
        let (distance, normal) = if enter.0 > 0.0 { enter } else { leave };
        (distance > 0.0 && distance.is_finite())
            .then(|| (distance, Unit::new_normalize(self.frame_from_cylinder * normal)))
    }

    /// Returns the interval of the ray inside the infinite cylinder.
    fn column(&self, o: &Point3<f64>, d: &Vector3<f64>) -> Option<(Side, Side)> {
        let square = d.x * d.x + d.y * d.y;
        let outside = o.x * o.x + o.y * o.y - self.radius * self.radius;
        if square == 0.0 {
            let nowhere = Vector3::x();
            return (outside <= 0.0).then_some(((f64::NEG_INFINITY, nowhere), (f64::INFINITY, nowhere)));
        }
        let half = o.x * d.x + o.y * d.y;
        // half² − square·outside, in terms of the line's distance from the axis to avoid cancellation far away.
        let aside = o.x * d.y - o.y * d.x;
        let discriminant = square * self.radius * self.radius - aside * aside;
        if discriminant < 0.0 {
            return None;
        }
        // The root without cancellation, and the other by Vieta's formula.
        let sum = -(half + f64::copysign(discriminant.sqrt(), half));
        let (a, b) = (
            sum / square,
            if sum == 0.0 { sum / square } else { outside / sum },
        );
        let at = |t: f64| (t, Vector3::new(o.x + t * d.x, o.y + t * d.y, 0.0));
        Some((at(a.min(b)), at(a.max(b))))
    }

    /// Returns the interval of the ray between the planes of the caps.
    fn caps(&self, o: &Point3<f64>, d: &Vector3<f64>) -> Option<(Side, Side)> {
        if d.z == 0.0 {
            let nowhere = Vector3::z();
            return (o.z.abs() <= self.half_height)
                .then_some(((f64::NEG_INFINITY, nowhere), (f64::INFINITY, nowhere)));
        }
        let side = f64::copysign(1.0, d.z);
        let at = |z: f64| ((z * self.half_height - o.z) / d.z, Vector3::z() * z);
        Some((at(-side), at(side)))
    }

    /// Returns the corners of an enclosing box.
    pub(crate) fn corners(&self) -> Vec<Point3<f64>> {
        let sign = |i: u8, bit: u8| if i & bit == 0 { -1.0 } else { 1.0 };
        (0..8)
            .map(|i| {
                let (r, h) = (self.radius, self.half_height);
                self.frame_from_cylinder * Point3::new(sign(i, 1) * r, sign(i, 2) * r, sign(i, 4) * h)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Draws;
    use catoptric_model::frame::yaw_pitch_roll;
    use nalgebra::Translation3;

    fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
        Ray {
            origin: Point3::from(origin),
            direction: Unit::new_normalize(Vector3::from(direction)),
        }
    }

    #[test]
    fn side_caps_and_inside_are_hit_at_the_expected_distances() {
        let cylinder = Cylinder::new(Pose::identity(), 2.0, 4.0);
        let hit = |o, d| cylinder.cast(&ray(o, d)).map(|(t, n)| (t, n.into_inner()));
        let close = |found: Option<(f64, Vector3<f64>)>, t: f64, n: [f64; 3]| {
            let (distance, normal) = found.expect("a hit");
            assert!((distance - t).abs() < 1e-14 && (normal - Vector3::from(n)).norm() < 1e-14);
        };
        close(hit([-5.0, 0.0, 0.0], [1.0, 0.0, 0.0]), 4.0, [-1.0, 0.0, 0.0]);
        close(hit([0.5, 0.5, 9.0], [0.0, 0.0, -1.0]), 7.0, [0.0, 0.0, 1.0]);
        // A ray offset by half the radius hits the side at √(1 − 1/4) from the middle.
        close(
            hit([-5.0, 0.5, 1.0], [1.0, 0.0, 0.0]),
            5.0 - 0.75_f64.sqrt(),
            [-(0.75_f64.sqrt()), 0.5, 0.0],
        );
        // From inside, the hit is where the ray leaves.
        close(hit([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]), 2.0, [0.0, 0.0, 1.0]);
        assert!(hit([-5.0, 1.0 + 1e-12, 0.0], [1.0, 0.0, 0.0]).is_none());
        assert!(hit([1.0 + 1e-12, 0.0, 9.0], [0.0, 0.0, -1.0]).is_none());
        assert!(hit([-5.0, 0.0, 2.0 + 1e-12], [1.0, 0.0, 0.0]).is_none());
        assert!(hit([-5.0, 0.0, 0.0], [-1.0, 0.0, 0.0]).is_none());
    }

    #[test]
    fn every_hit_is_on_the_surface_and_every_miss_stays_outside() {
        let pose = Pose::from_parts(Translation3::new(0.3, -0.2, 0.5), yaw_pitch_roll(0.4, 0.8, -0.3));
        let cylinder = Cylinder::new(pose, 0.8, 1.4);
        let mut draws = Draws::new(5, 0);
        let (mut hits, mut misses) = (0, 0);
        for _ in 0..20_000 {
            let origin = Point3::from(draws.normal3() * 3.0);
            let towards = pose.translation.vector + draws.normal3() * 0.6;
            let ray = Ray {
                origin,
                direction: Unit::new_normalize(towards - origin.coords),
            };
            let depth = |t: f64| {
                let p = pose.inverse_transform_point(&(origin + ray.direction.into_inner() * t));
                (0.4 - libm::hypot(p.x, p.y)).min(0.7 - p.z.abs())
            };
            if let Some((t, normal)) = cylinder.cast(&ray) {
                hits += 1;
                assert!(depth(t).abs() < 1e-13);
                if depth(0.0) < 0.0 {
                    assert!(normal.dot(&ray.direction) < 0.0);
                    // Points sampled before the hit are outside.
                    assert!((0..50).all(|i| depth(t * f64::from(i) / 50.0) < 1e-12));
                }
            } else {
                misses += 1;
                assert!((0..400).all(|i| depth(0.025 * f64::from(i)) < 1e-12));
            }
        }
        assert!(hits > 5000 && misses > 1000, "{hits} hits, {misses} misses");
    }
}
