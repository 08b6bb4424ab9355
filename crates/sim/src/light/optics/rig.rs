//! The scanner's own rays via its own mirrors, compiled once.
//!
//! Scanner and structure are rigid: what a sub-ray does until it leaves the structure for good, or ends on it, is the
//! same wherever the sensor is and whatever surrounds it, as long as no part of the room comes within the structure
//! itself.

use super::path::{Course, End, Meeting};
use super::setting::Setting;
use super::spread::Spread;
#[cfg(doc)]
use crate::build::coating::Finishes;
use catoptric_cast::Ray;
use catoptric_cast::Rays;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use std::ops::Range;

/// The paths of all sub-rays of all beams via the structure, beam by beam.
#[derive(Debug, Clone)]
pub struct Rig {
    all: Compiled,
    /// The last legs of all sub-rays that leave, moved here from `all`.
    leaving: Rays,
    /// Where the paths of each beam start; the last entry is the end of all.
    starts: Vec<Start>,
    /// Until it leaves, every path stays within this radius around the sensor, in meters; 0 if all leave at once.
    reach: f64,
    /// Whether a mirror on any path has glass that makes ghosts.
    ghosts: bool,
}

/// The paths of a beam's sub-rays via the structure, in the order in which they are cast.
#[derive(Debug, Clone)]
pub(crate) struct BeamPaths<'a> {
    /// How the sub-rays leave the structure or end on it, in order.
    pub(crate) runs: &'a [Run],
    /// Path lengths of all sub-rays, in meters: to the end on the structure, or to where the last leg begins.
    pub(crate) lengths: &'a [f64],
    /// Share of the light of all sub-rays that mirrors reflect, as [`Finishes::passed`]; empty if that is the same number
    /// for all mirrors.
    pub(crate) passed: &'a [f64],
    /// The last legs of those that leave, as indices into [`Rig::leaving`].
    pub(crate) leaving: Range<usize>,
    /// How curved mirrors spread the light of all sub-rays; empty if all mirrors are flat.
    pub(crate) spreads: &'a [Option<Spread>],
    facets: &'a [usize],
    meetings: &'a [Meeting],
}

/// The paths of one beam, or of several beams in sequence.
#[derive(Debug, Clone, Default)]
struct Compiled {
    runs: Vec<Run>,
    lengths: Vec<f64>,
    passed: Vec<f64>,
    spreads: Vec<Option<Spread>>,
    leaving: Vec<Ray>,
    /// Mirrors hit by each run, run by run.
    facets: Vec<usize>,
    /// Meetings with these mirrors, path by path.
    meetings: Vec<Meeting>,
}

/// Number of entries of every kind that precede a beam.
#[derive(Debug, Clone, Copy)]
struct Start {
    runs: usize,
    lengths: usize,
    leaving: usize,
    facets: usize,
    meetings: usize,
}

/// Consecutive sub-rays that leave the structure identically. A sub-ray that does not leave is a run of its own.
#[derive(Debug, Clone)]
pub(crate) struct Run {
    /// Indices of the sub-rays within the beam.
    pub(crate) sub_rays: Range<usize>,
    /// What happens after the last mirror.
    pub(crate) then: Then,
    /// Number of reflections by silver.
    pub(crate) silvered: usize,
    /// Share of the light that glass has transmitted.
    pub(crate) gain: f64,
    facets: Range<usize>,
    /// Index of the first meeting among the beam's.
    meetings: usize,
}

/// What a sub-ray does after the last mirror of the structure.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Then {
    /// It leaves, by the next of [`BeamPaths::leaving`].
    Leaves,
    /// It ends on a surface of the structure, with this cosine of the incidence.
    EndsOn(usize, f64),
    /// It is trapped.
    Trapped,
}

impl Rig {
    /// Follows the rays of every beam via the structure of a setting that contains nothing else.
    pub(crate) fn compile<R: Iterator<Item = Ray>>(
        bare: &Setting<'_>,
        beams: usize,
        rays: impl Fn(usize) -> R + Sync,
        long_axis: impl Fn(usize) -> Vector3<f64> + Sync,
    ) -> Self {
        let beams: Vec<(Compiled, f64, bool)> = (0..beams)
            .into_par_iter()
            .map(|beam| Compiled::of(bare, rays(beam), &long_axis(beam)))
            .collect();
        let mut all = Compiled::default();
        let mut starts = vec![all.start()];
        for (beam, ..) in &beams {
            all.append(beam);
            starts.push(all.start());
        }
        Self {
            leaving: std::mem::take(&mut all.leaving).into_iter().collect(),
            all,
            starts,
            reach: beams.iter().map(|(_, reach, _)| *reach).fold(0.0, f64::max),
            ghosts: beams.iter().any(|(.., ghosts)| *ghosts),
        }
    }

    /// The last legs of all sub-rays that leave.
    pub(crate) fn leaving(&self) -> &Rays {
        &self.leaving
    }

    /// The paths of a beam.
    pub(crate) fn paths(&self, beam: usize) -> BeamPaths<'_> {
        let (from, to, all) = (&self.starts[beam], &self.starts[beam + 1], &self.all);
        BeamPaths {
            runs: &all.runs[from.runs..to.runs],
            lengths: &all.lengths[from.lengths..to.lengths],
            passed: all.passed.get(from.lengths..to.lengths).unwrap_or_default(),
            spreads: all.spreads.get(from.lengths..to.lengths).unwrap_or_default(),
            leaving: from.leaving..to.leaving,
            facets: &all.facets[from.facets..to.facets],
            meetings: &all.meetings[from.meetings..to.meetings],
        }
    }

    /// Whether these paths are valid in settings that are one setting seen from nearby poses: no part of its room comes
    /// close enough, and there are no ghosts, which take other paths.
    pub fn holds_in(&self, settings: &[Setting<'_>]) -> bool {
        let Some(first) = settings.first() else {
            return true;
        };
        let others = settings.iter().map(|other| other.distance_from(first));
        let spread = others.fold(0.0, f64::max);
        let is_clear = || {
            // A ball that contains those around all poses is usually clear as well.
            first.is_clear(self.reach + spread) || settings.iter().all(|s| s.is_clear(self.reach))
        };
        !self.ghosts && (self.reach == 0.0 || is_clear())
    }
}

impl Compiled {
    /// The paths of a beam, how far from the sensor they go before they leave, and whether glass on them makes ghosts.
    fn of(
        bare: &Setting<'_>,
        rays: impl Iterator<Item = Ray>,
        long_axis: &Vector3<f64>,
    ) -> (Self, f64, bool) {
        let rays: Vec<Ray> = rays.collect();
        let mut compiled = Self::default();
        let mut bounces: Vec<(usize, usize, Point3<f64>, Meeting)> = Vec::new();
        let mut reach: f64 = 0.0;
        let courses = bare.follow_beam(&rays, bare.contents.max_bounces, |ray, bounce| {
            bounces.push((ray, bounce.facet, bounce.point, bounce.meeting));
            let places = [bounce.point, bounce.after.origin];
            reach = places.iter().map(|p| p.coords.norm()).fold(reach, f64::max);
        });
        // Grouped by ray, each in order.
        bounces.sort_by_key(|(ray, ..)| *ray);
        let facets = &bare.contents.facets;
        let ghosts = bounces
            .iter()
            .any(|(_, f, ..)| facets[*f].glass.is_some_and(|g| g.ghost));
        let mut met = 0;
        for (ray, course) in rays.iter().zip(&courses) {
            // A ray that leaves at once is cast into the room from where it starts, whatever is near.
            if course.count > 0 || !matches!(course.end, End::Escaped) {
                reach = reach.max(ray.origin.coords.norm());
            }
            let then = match course.end {
                End::Escaped => {
                    compiled.leaving.push(course.last);
                    Then::Leaves
                }
                End::Hit(hit) => {
                    reach = reach.max(hit.point.coords.norm());
                    Then::EndsOn(hit.surface, hit.cos_incidence())
                }
                // It has hit one more mirror, somewhere on the structure: its whole extent counts.
                End::Trapped => {
                    reach = reach.max(bare.contents.span);
                    Then::Trapped
                }
            };
            let own = met..met + course.count;
            met = own.end;
            compiled.lengths.push(course.length);
            if let Some(finishes) = bare.finishes() {
                let met = bounces[own.clone()].iter().map(|(.., meeting)| meeting.hop());
                compiled
                    .passed
                    .push(finishes.passed(&ray.direction, long_axis, met));
            }
            if bare.contents.bends {
                let met = bounces[own.clone()].iter();
                let met = met.map(|(_, facet, point, meeting)| (*facet, *point, meeting.after));
                compiled.spreads.push(bare.spread(ray, met));
            }
            compiled.depart(course, then, own.clone().map(|i| bounces[i].1));
            compiled
                .meetings
                .extend(bounces[own].iter().map(|(.., meeting)| *meeting));
        }
        (compiled, reach, ghosts)
    }

    fn start(&self) -> Start {
        Start {
            runs: self.runs.len(),
            lengths: self.lengths.len(),
            leaving: self.leaving.len(),
            facets: self.facets.len(),
            meetings: self.meetings.len(),
        }
    }

    /// Appends the paths of a beam.
    fn append(&mut self, beam: &Self) {
        self.runs.extend_from_slice(&beam.runs);
        self.lengths.extend_from_slice(&beam.lengths);
        self.passed.extend_from_slice(&beam.passed);
        self.spreads.extend_from_slice(&beam.spreads);
        self.leaving.extend_from_slice(&beam.leaving);
        self.facets.extend_from_slice(&beam.facets);
        self.meetings.extend_from_slice(&beam.meetings);
    }

    /// Adds the next sub-ray to the previous run, or starts a new one.
    fn depart(&mut self, course: &Course, then: Then, facets: impl Iterator<Item = usize>) {
        let number = self.lengths.len() - 1;
        let first = self.facets.len();
        self.facets.extend(facets);
        if let Some(run) = self.runs.last_mut()
            && matches!((run.then, then), (Then::Leaves, Then::Leaves))
            && (run.silvered, run.gain) == (course.silvered, course.gain)
            && self.facets[run.facets.clone()] == self.facets[first..]
        {
            self.facets.truncate(first);
            run.sub_rays.end += 1;
            return;
        }
        self.runs.push(Run {
            sub_rays: number..number + 1,
            then,
            silvered: course.silvered,
            gain: course.gain,
            facets: first..self.facets.len(),
            meetings: self.meetings.len(),
        });
    }
}

impl<'a> BeamPaths<'a> {
    /// The mirrors that a run's sub-rays hit.
    pub(crate) fn facets(&self, run: &Run) -> &'a [usize] {
        &self.facets[run.facets.clone()]
    }

    /// The meetings of one of its sub-rays with them.
    pub(crate) fn meetings(&self, run: &Run, sub_ray: usize) -> &'a [Meeting] {
        let count = run.facets.len();
        let first = run.meetings + (sub_ray - run.sub_rays.start) * count;
        &self.meetings[first..first + count]
    }
}
