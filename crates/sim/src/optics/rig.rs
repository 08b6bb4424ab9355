//! The scanner's own rays over its own mirrors, compiled once.
//!
//! Scanner and structure are rigid: what a sub-ray does until it leaves the structure for good, or ends on it, is the same
//! wherever the sensor is and whatever is around it, as long as nothing of the room comes within the structure itself.

use super::{Course, End, Meeting, Setting};
use crate::cast::Hit;
use crate::footprint::Ray;
use std::ops::Range;

/// The ways of every sub-ray of every beam over the structure.
#[derive(Debug, Clone)]
pub struct Rig {
    departures: Vec<Departure>,
    sub_rays: usize,
    /// Mirrors met and what was brought to them, of all ways one after the other.
    facets: Vec<usize>,
    meetings: Vec<Meeting>,
    /// No way leaves the ball of this radius around the sensor before it departs, in metres.
    reach: f64,
    /// Whether a mirror on any way has a glass that makes ghosts.
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
    /// The last leg.
    pub(crate) last: Ray,
    /// Whether and where it ends on the structure.
    pub(crate) end: End,
    first: usize,
    count: usize,
}

impl Rig {
    /// Follows rays over the structure of a setting that holds nothing else; beam after beam with as many sub-rays each.
    pub(crate) fn compile(bare: &Setting<'_>, sub_rays: usize, rays: impl Iterator<Item = Ray>) -> Self {
        let mut rig = Self {
            departures: Vec::new(),
            sub_rays,
            facets: Vec::new(),
            meetings: Vec::new(),
            reach: 0.0,
            ghosts: false,
        };
        for ray in rays {
            rig.add(bare, &ray);
        }
        rig
    }

    fn add(&mut self, bare: &Setting<'_>, ray: &Ray) {
        let first = self.facets.len();
        let mut reach = ray.origin.coords.norm();
        let course: Course = bare.follow(ray, bare.contents.max_bounces, None, |bounce| {
            self.facets.push(bounce.facet);
            self.meetings.push(bounce.meeting);
            let places = [bounce.point, bounce.after.origin];
            reach = places.iter().map(|p| p.coords.norm()).fold(reach, f64::max);
        });
        if let End::Hit(Hit { point, .. }) = course.end {
            reach = reach.max(point.coords.norm());
        }
        // Light that is trapped has met one more mirror, somewhere on the structure: all of that counts.
        if matches!(course.end, End::Trapped) {
            reach = reach.max(bare.contents.span);
        }
        self.reach = self.reach.max(reach);
        let facets = &bare.contents.facets;
        let makes_ghost = |f: &usize| facets[*f].glass.is_some_and(|g| g.ghost);
        self.ghosts |= self.facets[first..].iter().any(makes_ghost);
        self.departures.push(Departure {
            silvered: course.silvered,
            gain: course.gain,
            length: course.length,
            last: course.last,
            end: course.end,
            first,
            count: course.count,
        });
    }

    /// How the sub-rays of a beam are done with the structure, in the order in which they are cast.
    pub(crate) fn departures(&self, beam: usize) -> &[Departure] {
        &self.departures[beam * self.sub_rays..(beam + 1) * self.sub_rays]
    }

    /// The mirrors that a sub-ray met.
    pub(crate) fn facets(&self, departure: &Departure) -> &[usize] {
        &self.facets[departure.range()]
    }

    /// What it brought to them.
    pub(crate) fn meetings(&self, departure: &Departure) -> &[Meeting] {
        &self.meetings[departure.range()]
    }

    /// Whether these ways are those of a setting: nothing of its room comes near enough, and there are no ghosts, whose
    /// ways are others.
    pub fn holds_in(&self, setting: &Setting<'_>) -> bool {
        !self.ghosts && setting.is_clear(self.reach)
    }
}

impl Departure {
    fn range(&self) -> Range<usize> {
        self.first..self.first + self.count
    }
}
