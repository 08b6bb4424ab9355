//! Follows a ray from mirror to mirror, and the ghosts that glass makes of it.

use super::path::{Bounce, Course, End, Meeting, RayPath};
use super::setting::{Leg, Setting};
use crate::light::glass;
use catoptric_cast::Ray;
use catoptric_model::mirror;
use nalgebra::Point3;

impl Setting<'_> {
    /// Follows a ray from mirror to mirror, always to the nearest surface.
    ///
    /// A mirror reflects with its face; its back is opaque, unless the mirror has two sides.
    pub fn trace(&self, ray: &Ray) -> RayPath {
        self.path(ray, None)
    }

    /// The ghosts of a ray: for every glass on its path that makes ghosts, the path of the light that the front
    /// reflects.
    ///
    /// Light that is reflected by two fronts or repeatedly within a glass is omitted, and so is light that goes out
    /// along one path and returns along another: the energy of all paths together is less than what was emitted.
    pub fn ghosts(&self, ray: &Ray, path: &RayPath) -> impl Iterator<Item = RayPath> {
        let fronts = path.facets().iter().enumerate();
        let fronts = fronts.filter(|(_, f)| self.contents.facets[**f].glass.is_some_and(|g| g.ghost));
        fronts.map(|(bounce, _)| self.path(ray, Some(bounce)))
    }

    fn path(&self, ray: &Ray, ghost: Option<usize>) -> RayPath {
        let mut path = RayPath::begin(ray);
        let course = self.follow(ray, self.contents.max_bounces, ghost, |bounce| path.add(bounce));
        path.end(&course);
        path
    }

    /// Follows a ray via at most `limit` mirrors and visits every bounce; at bounce number `ghost` the light is
    /// reflected by the front of the glass.
    pub(crate) fn follow(
        &self,
        ray: &Ray,
        limit: usize,
        ghost: Option<usize>,
        mut visit: impl FnMut(&Bounce),
    ) -> Course {
        let mut course = Course::begin(ray);
        let mut left = None;
        while let Some(leg) = self.cast(&course.last, left) {
            left = self.step(&mut course, &leg, limit, ghost, &mut visit);
            if left.is_none() {
                break;
            }
        }
        course
    }

    /// Takes a course to the end of a leg and, if a mirror is there, past it; returns the surface that it leaves if it
    /// continues.
    pub(super) fn step(
        &self,
        course: &mut Course,
        leg: &Leg<'_>,
        limit: usize,
        ghost: Option<usize>,
        visit: &mut impl FnMut(&Bounce),
    ) -> Option<usize> {
        let Some((facet, back)) = self.reflecting(leg.hit.surface, leg.hit.front()) else {
            course.length += leg.hit.distance;
            course.end = End::Hit(leg.in_sensor_frame());
            return None;
        };
        if course.count == limit {
            course.end = End::Trapped;
            return None;
        }
        let Some(bounce) = self.bounce(course, leg, facet, back, ghost == Some(course.count)) else {
            course.end = End::Trapped;
            return None;
        };
        visit(&bounce);
        let glass = self.contents.facets[facet].glass.filter(|g| g.ghost);
        if ghost == Some(course.count) {
            // Without glass there is no front to reflect anything.
            course.gain *= bounce.passage.map_or(0.0, |p| p.fresnel);
        } else {
            course.silvered += 1;
            if let (Some(_), Some(passage)) = (glass, &bounce.passage) {
                // In and out through the front.
                let through = 1.0 - passage.fresnel;
                course.gain *= through * through;
            }
        }
        course.count += 1;
        course.length = bounce.length_after;
        course.last = bounce.after;
        Some(bounce.meeting.surface)
    }

    /// A reflection; `None` if the light hits the rim of the glass.
    fn bounce(
        &self,
        course: &Course,
        leg: &Leg<'_>,
        facet: usize,
        back: bool,
        ghost: bool,
    ) -> Option<Bounce> {
        let mirror = &self.contents.facets[facet];
        let (hit, incoming) = (&leg.hit, leg.incoming);
        let normal = match (back, hit.front()) {
            (false, _) => mirror.normal_at(&hit.point),
            (true, true) => hit.normal,
            (true, false) => -hit.normal,
        };
        let length = course.length + hit.distance;
        let cos_incidence = -normal.dot(&incoming);
        let after = mirror::reflect(&incoming, &normal);
        let mut bounce = Bounce {
            facet,
            point: hit.point,
            surface: hit.surface,
            length,
            passage: None,
            after: Ray {
                origin: hit.point,
                direction: after,
            },
            length_after: length,
            meeting: Meeting {
                surface: hit.surface,
                length,
                cos_incidence,
                silvered: course.silvered,
                gain: course.gain,
                silver: (!ghost).then_some(facet),
                after,
            },
        };
        let glass = mirror.glass.filter(|_| !back && cos_incidence > 0.0);
        if let Some(glass) = glass {
            let passage = glass::pass(&glass, &incoming, &normal);
            bounce.passage = Some(passage);
            if !ghost {
                bounce.after.origin = hit.point + passage.walk;
                bounce.length_after = length + passage.path;
                let inside = |p: &Point3<f64>| mirror.face.contains(p);
                if !inside(&(hit.point + passage.to_silver)) || !inside(&bounce.after.origin) {
                    return None;
                }
            }
        }
        Some(leg.kept_from_sensor.map_or(bounce, |pose| bounce.seen_from(pose)))
    }
}
