//! The ways of the rays of a beam, leg by leg together: rays that left one mirror are a beam again.

use super::path::{Bounce, Course, Path};
use super::setting::Setting;
use catoptric_cast::Ray;
use catoptric_cast::Rays;

impl Setting<'_> {
    /// The ways of some rays, as [`Setting::trace`] follows each of them; faster if they are a narrow beam.
    pub fn trace_beam(&self, rays: &[Ray]) -> Vec<Path> {
        self.trace_and_tell(rays, |_, _| {})
    }

    /// The same, and every bounce is told with the number of its ray.
    pub(super) fn trace_and_tell(&self, rays: &[Ray], mut tell: impl FnMut(usize, &Bounce)) -> Vec<Path> {
        let mut paths: Vec<Path> = rays.iter().map(Path::begin).collect();
        let courses = self.follow_beam(rays, self.contents.max_bounces, |ray, bounce| {
            tell(ray, bounce);
            paths[ray].add(bounce);
        });
        for (path, course) in paths.iter_mut().zip(&courses) {
            path.end(course);
        }
        paths
    }

    /// Follows rays over at most `limit` mirrors each and tells of every bounce with the number of its ray. Bounces of one
    /// ray are told in order.
    pub(super) fn follow_beam(
        &self,
        rays: &[Ray],
        limit: usize,
        mut tell: impl FnMut(usize, &Bounce),
    ) -> Vec<Course> {
        let mut courses: Vec<Course> = rays.iter().map(Course::begin).collect();
        // The mirror that a ray has left, and its number.
        let mut going: Vec<(Option<usize>, usize)> = (0..rays.len()).map(|ray| (None, ray)).collect();
        let (mut beam, mut legs) = (Rays::default(), Vec::new());
        while !going.is_empty() {
            let mut next = Vec::new();
            for group in going.chunk_by(|a, b| a.0 == b.0) {
                beam.clear();
                beam.extend(group.iter().map(|(_, ray)| courses[*ray].last));
                self.cast_beam(&beam, group[0].0, &mut legs);
                for ((_, ray), leg) in group.iter().zip(&legs) {
                    let course = &mut courses[*ray];
                    if let Some(leg) = leg
                        && let Some(left) = self.step(course, leg, limit, None, &mut |b| tell(*ray, b))
                    {
                        next.push((Some(left), *ray));
                    }
                }
            }
            // Those that left one mirror go on together.
            next.sort_unstable();
            going = next;
        }
        courses
    }
}
