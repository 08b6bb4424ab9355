//! Follows the rays of a beam together, leg by leg: rays that have left the same mirror are a beam again.

use super::path::{Bounce, Course, RayPath, Route};
use super::setting::Setting;
use catoptric_cast::Ray;
use catoptric_cast::Rays;

impl Setting<'_> {
    /// The paths of some rays, as [`Setting::trace`] follows each of them; faster if they are a narrow beam.
    pub fn trace_beam(&self, rays: &[Ray]) -> Vec<RayPath> {
        self.trace_and_visit(rays, |_, _| {})
    }

    /// The same, visiting every bounce with the number of its ray.
    pub(super) fn trace_and_visit(
        &self,
        rays: &[Ray],
        mut visit: impl FnMut(usize, &Bounce),
    ) -> Vec<RayPath> {
        let mut paths: Vec<RayPath> = rays.iter().map(RayPath::begin).collect();
        let courses = self.follow_beam(rays, self.contents.max_bounces, |ray, bounce| {
            visit(ray, bounce);
            paths[ray].add(bounce);
        });
        for (path, course) in paths.iter_mut().zip(&courses) {
            path.end(course);
        }
        paths
    }

    /// The routes of some rays, without the points on them.
    pub(crate) fn routes(&self, rays: &[Ray]) -> Vec<Route> {
        let mut routes = vec![Route::begin(); rays.len()];
        let courses = self.follow_beam(rays, self.contents.max_bounces, |ray, bounce| {
            routes[ray].add(bounce)
        });
        for (route, course) in routes.iter_mut().zip(&courses) {
            route.end(course);
        }
        routes
    }

    /// Follows rays via at most `limit` mirrors each and visits every bounce with the number of its ray, those of one
    /// ray in order.
    pub(super) fn follow_beam(
        &self,
        rays: &[Ray],
        limit: usize,
        mut visit: impl FnMut(usize, &Bounce),
    ) -> Vec<Course> {
        let mut courses: Vec<Course> = rays.iter().map(Course::begin).collect();
        // The mirror that a ray has left, and the number of the ray.
        let mut going: Vec<(Option<usize>, usize)> = (0..rays.len()).map(|ray| (None, ray)).collect();
        let (mut beam, mut legs) = (Rays::default(), Vec::new());
        while !going.is_empty() {
            let mut next = Vec::new();
            for group in going.chunk_by(|a, b| a.0 == b.0) {
                beam.clear();
                beam.extend(group.iter().map(|(_, ray)| courses[*ray].last));
                self.cast_packets(&beam, group[0].0, &mut legs);
                for ((_, ray), leg) in group.iter().zip(&legs) {
                    let course = &mut courses[*ray];
                    if let Some(leg) = leg
                        && let Some(left) = self.step(course, leg, limit, None, &mut |b| visit(*ray, b))
                    {
                        next.push((Some(left), *ray));
                    }
                }
            }
            // Rays that have left the same mirror continue together.
            next.sort_unstable();
            going = next;
        }
        courses
    }
}
