//! The scanner's own rays over its own mirrors, compiled once.
//!
//! Scanner and structure are rigid: what a sub-ray does until it leaves the structure for good, or ends on it, is the same
//! wherever the sensor is and whatever is around it, as long as nothing of the room comes within the structure itself.

use super::{End, Meeting, Setting};
use crate::footprint::Ray;
use rayon::prelude::*;
use std::ops::Range;

/// The ways of every sub-ray of every beam over the structure.
#[derive(Debug, Clone)]
pub struct Rig {
    beams: Vec<Ways>,
    /// No way leaves the ball of this radius around the sensor before it departs, in metres; 0 if all depart at once.
    reach: f64,
    /// Whether a mirror on any way has a glass that makes ghosts.
    ghosts: bool,
}

/// The ways of a beam's sub-rays over the structure, in the order in which they are cast.
#[derive(Debug, Clone, Default)]
pub(crate) struct Ways {
    departures: Vec<Departure>,
    /// The last legs of those that leave.
    leaving: Vec<Ray>,
    /// Mirrors met and what was brought to them, of all ways one after the other.
    facets: Vec<usize>,
    meetings: Vec<Meeting>,
    /// As for all beams together.
    reach: f64,
    ghosts: bool,
}

/// How a sub-ray is done with the structure.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Departure {
    /// Reflections by silver.
    pub(crate) silvered: usize,
    /// Share of the light that glass has let pass.
    pub(crate) gain: f64,
    /// Length of the way, in metres: to its end on the structure, or to where the last leg begins.
    pub(crate) length: f64,
    /// What comes then.
    pub(crate) then: Then,
    first: usize,
    count: usize,
}

/// What a sub-ray does when it is done with the mirrors of the structure.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Then {
    /// It leaves, by the next of [`Ways::leaving`].
    Leaves,
    /// It ends on a surface of the structure, under an incidence of this cosine.
    EndsOn(usize, f64),
    /// It is trapped.
    Trapped,
}

impl Rig {
    /// Follows the rays of every beam over the structure of a setting that holds nothing else.
    pub(crate) fn compile<R: Iterator<Item = Ray>>(
        bare: &Setting<'_>,
        beams: usize,
        rays: impl Fn(usize) -> R + Sync,
    ) -> Self {
        let beams: Vec<Ways> = (0..beams)
            .into_par_iter()
            .map(|beam| Ways::compile(bare, rays(beam)))
            .collect();
        Self {
            reach: beams.iter().map(|ways| ways.reach).fold(0.0, f64::max),
            ghosts: beams.iter().any(|ways| ways.ghosts),
            beams,
        }
    }

    /// The ways of a beam.
    pub(crate) fn ways(&self, beam: usize) -> &Ways {
        &self.beams[beam]
    }

    /// Whether these ways are those of a setting: nothing of its room comes near enough, and there are no ghosts, whose
    /// ways are others.
    pub fn holds_in(&self, setting: &Setting<'_>) -> bool {
        !self.ghosts && (self.reach == 0.0 || setting.is_clear(self.reach))
    }
}

impl Ways {
    fn compile(bare: &Setting<'_>, rays: impl Iterator<Item = Ray>) -> Self {
        let rays: Vec<Ray> = rays.collect();
        let mut ways = Self::default();
        let mut bounces: Vec<(usize, usize, Meeting)> = Vec::new();
        let mut reach: f64 = 0.0;
        let courses = bare.follow_beam(&rays, bare.contents.max_bounces, |ray, bounce| {
            bounces.push((ray, bounce.facet, bounce.meeting));
            let places = [bounce.point, bounce.after.origin];
            reach = places.iter().map(|p| p.coords.norm()).fold(reach, f64::max);
        });
        // Those of one ray after the other, each in order.
        bounces.sort_by_key(|(ray, ..)| *ray);
        let facets = &bare.contents.facets;
        ways.ghosts = bounces
            .iter()
            .any(|(_, f, _)| facets[*f].glass.is_some_and(|g| g.ghost));
        ways.facets = bounces.iter().map(|(_, facet, _)| *facet).collect();
        ways.meetings = bounces.iter().map(|(.., meeting)| *meeting).collect();
        ways.departures.reserve_exact(courses.len());
        let mut first = 0;
        for (ray, course) in rays.iter().zip(&courses) {
            // What leaves at once is cast into the room from where it starts, whatever is near.
            if course.count > 0 || !matches!(course.end, End::Escaped) {
                reach = reach.max(ray.origin.coords.norm());
            }
            let then = match course.end {
                End::Escaped => {
                    ways.leaving.push(course.last);
                    Then::Leaves
                }
                End::Hit(hit) => {
                    reach = reach.max(hit.point.coords.norm());
                    Then::EndsOn(hit.surface, hit.normal.dot(&course.last.direction).abs())
                }
                // It has met one more mirror, somewhere on the structure: all of that counts.
                End::Trapped => {
                    reach = reach.max(bare.contents.span);
                    Then::Trapped
                }
            };
            ways.departures.push(Departure {
                silvered: course.silvered,
                gain: course.gain,
                length: course.length,
                then,
                first,
                count: course.count,
            });
            first += course.count;
        }
        ways.reach = reach;
        ways
    }

    /// How the sub-rays are done with the structure.
    pub(crate) fn departures(&self) -> &[Departure] {
        &self.departures
    }

    /// The last legs of those that leave.
    pub(crate) fn leaving(&self) -> &[Ray] {
        &self.leaving
    }

    /// The mirrors that a sub-ray met.
    pub(crate) fn facets(&self, departure: &Departure) -> &[usize] {
        &self.facets[departure.range()]
    }

    /// What it brought to them.
    pub(crate) fn meetings(&self, departure: &Departure) -> &[Meeting] {
        &self.meetings[departure.range()]
    }
}

impl Departure {
    fn range(&self) -> Range<usize> {
        self.first..self.first + self.count
    }
}
