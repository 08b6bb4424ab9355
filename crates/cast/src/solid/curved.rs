//! Exact intersection of a ray with a curved mirror: the part of a quadric over a convex plane outline.

use crate::ray::{FARTHEST, Ray};
use crate::solid::{Polygon, area_vector};
use catoptric_model::CurvedSurface;
use nalgebra::{Point3, Unit, Vector3};

/// A curved surface over a plane outline, along its normal; its front is that of the outline.
#[derive(Debug, Clone)]
pub struct Curved {
    /// The outline, in the plane that the surface touches.
    pub outline: Polygon,
    /// The surface.
    pub surface: CurvedSurface,
    /// Its points over the corners of the outline.
    rim: Vec<Point3<f64>>,
}

/// How far triangles deviate from the surface that they stand for: by this part of its longest diagonal.
const CHORD_ERROR: f64 = 1e-4;

impl Curved {
    /// Returns the part of a surface over an outline, or `None` if it does not reach over all of it.
    pub fn new(outline: Polygon, surface: CurvedSurface) -> Option<Self> {
        let rim = outline
            .corners
            .iter()
            .map(|c| surface.over(c))
            .collect::<Option<_>>()?;
        Some(Self {
            outline,
            surface,
            rim,
        })
    }

    /// Returns the distance at which a ray first hits the surface, from either side.
    pub fn cast(&self, ray: &Ray) -> Option<f64> {
        let roots = self.surface.roots(&ray.origin, &ray.direction);
        roots.into_iter().flatten().find(|t| self.takes(ray, *t))
    }

    /// Returns the distance at which a ray that leaves the surface hits it again, from either side.
    pub(crate) fn cast_again(&self, ray: &Ray) -> Option<f64> {
        let other = self.surface.other_root(&ray.origin, &ray.direction);
        other.filter(|t| self.takes(ray, *t))
    }

    fn takes(&self, ray: &Ray, distance: f64) -> bool {
        let point = || ray.origin + ray.direction.into_inner() * distance;
        // The edges of the outline are planes along its normal.
        distance > 0.0 && distance < FARTHEST && self.outline.contains(&point())
    }

    /// Returns the normal of the front where a ray hits it.
    pub(crate) fn normal(&self, ray: &Ray, distance: f64) -> Unit<Vector3<f64>> {
        self.surface
            .normal_at(&(ray.origin + ray.direction.into_inner() * distance))
    }

    /// Returns the corners of an enclosing prism. The surface is convex or concave, so that it is farthest from the plane
    /// over a corner.
    pub(crate) fn corners(&self) -> impl Iterator<Item = Point3<f64>> {
        let normal = self.outline.normal.into_inner();
        let height = |p: &Point3<f64>| normal.dot(&(p - self.outline.origin));
        let (low, high) = (self.rim.iter().map(height))
            .fold((0.0_f64, 0.0_f64), |(low, high), h| (low.min(h), high.max(h)));
        let corners = self.outline.corners.iter();
        corners.flat_map(move |c| [c + normal * low, c + normal * high])
    }

    /// Returns the surface as triangles whose corners are on it; they deviate from it by at most [`Curved::chord_error`].
    pub fn triangles(&self) -> Vec<[Point3<f64>; 3]> {
        let steps = self.steps();
        let of_fan = |[a, b, c]: [Point3<f64>; 3]| {
            let at = move |i: usize, j: usize| {
                // The same points along the side that two triangles of the fan share.
                let share = |n: usize| n as f64 / steps as f64;
                self.lifted(&Point3::from(
                    a.coords * share(steps - i) + b.coords * share(i - j) + c.coords * share(j),
                ))
            };
            (0..steps).flat_map(move |i| {
                let upright = (0..=i).map(move |j| [at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                let inverted = (0..i).map(move |j| [at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                upright.chain(inverted)
            })
        };
        self.outline.triangles().into_iter().flat_map(of_fan).collect()
    }

    /// Returns the rim of the surface, counter-clockwise seen from the front, at the corners of its triangles.
    pub fn rim(&self) -> Vec<Point3<f64>> {
        let steps = self.steps();
        let next = self.rim.len();
        (0..next)
            .flat_map(|side| {
                let (a, b) = (
                    self.outline.corners[side],
                    self.outline.corners[(side + 1) % next],
                );
                (0..steps).map(move |i| {
                    let share = |n: usize| n as f64 / steps as f64;
                    self.lifted(&Point3::from(a.coords * share(steps - i) + b.coords * share(i)))
                })
            })
            .collect()
    }

    /// Returns the largest distance of its triangles from the surface, in meters.
    pub fn chord_error(&self) -> f64 {
        CHORD_ERROR * self.diagonal()
    }

    /// Returns the area of the outline, in square meters.
    pub fn area(&self) -> f64 {
        0.5 * area_vector(&self.outline.corners).norm()
    }

    /// The point of the surface over one of the outline.
    fn lifted(&self, in_plane: &Point3<f64>) -> Point3<f64> {
        self.surface.over(in_plane).unwrap_or(*in_plane)
    }

    fn diagonal(&self) -> f64 {
        let corners = &self.outline.corners;
        let all = corners
            .iter()
            .flat_map(|a| corners.iter().map(move |b| (a - b).norm()));
        all.fold(0.0, f64::max)
    }

    /// Parts into which every side is divided. A height whose second derivatives are at most M deviates from a triangle
    /// with sides of at most L by at most M·L²/6, half of M times the square of the circumscribed radius.
    fn steps(&self) -> usize {
        let normal = self.outline.normal.into_inner();
        let bend = |p: &Point3<f64>| {
            let slant = normal.dot(&self.surface.normal_at(p));
            self.surface.shape_at(p).norm() / (slant * slant * slant)
        };
        let most = self.rim.iter().map(bend).fold(0.0, f64::max);
        let longest = self.diagonal();
        let steps = longest * (most / (6.0 * self.chord_error())).sqrt();
        // The surface reaches over all of the outline: at most some hundreds.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let steps = steps.ceil() as usize;
        steps.max(1)
    }
}
