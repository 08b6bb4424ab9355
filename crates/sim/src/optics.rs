//! The way of a ray: from the scanner over mirrors to whatever stops it.

mod clearance;
mod edit;
mod rig;
mod setting;
mod together;

pub use edit::{Edit, Trail};
pub use rig::Rig;
pub(crate) use rig::{Run, Then, Ways};
pub(crate) use setting::Beyond;
pub use setting::{Mirrors, Role, Setting, Target};

use crate::cast::{Hit, placed};
use crate::footprint::Ray;
use crate::glass::{self, Passage};
use catoptric_model::{Pose, mirror};
use nalgebra::{Point3, Vector3};
use setting::Leg;

/// Most mirrors a ray can meet; `max_bounces` may be less.
pub const MAX_BOUNCES: usize = 8;

/// How a ray's way ends.
#[derive(Debug, Clone, Copy)]
pub enum End {
    /// On a surface that scatters.
    Hit(Hit),
    /// In the open.
    Escaped,
    /// Between mirrors, after the last bounce allowed, or in the rim of a mirror's glass.
    Trapped,
}

/// What a ray brought to a mirror that it met.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Index of the surface.
    pub surface: usize,
    /// Length up to there, in metres.
    pub length: f64,
    /// Cosine of the incidence.
    pub cos_incidence: f64,
    /// Reflections by silver before.
    pub silvered: usize,
    /// Share of the light that glass before has let pass.
    pub gain: f64,
}

/// A reflection.
#[derive(Debug, Clone, Copy)]
pub struct Bounce {
    /// The mirror, by its index.
    pub facet: usize,
    /// Where it was met.
    pub point: Point3<f64>,
    /// Index of the surface.
    pub surface: usize,
    /// Length up to `point`, in metres.
    pub length: f64,
    /// What the glass did, if the light went through any.
    pub passage: Option<Passage>,
    /// The ray that leaves.
    pub after: Ray,
    /// Length up to where it leaves, in metres.
    pub length_after: f64,
    meeting: Meeting,
}

/// What becomes of a ray as a whole.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Mirrors met.
    pub count: usize,
    /// Length to the end, in metres; to the last mirror if there is no end.
    pub length: f64,
    /// Reflections by silver.
    pub silvered: usize,
    /// Share of the light that glass has let pass, or turned back for a ghost.
    pub gain: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

/// The way of a ray.
#[derive(Debug, Clone, Copy)]
pub struct Path {
    count: usize,
    facets: [usize; MAX_BOUNCES],
    points: [Point3<f64>; MAX_BOUNCES],
    meetings: [Option<Meeting>; MAX_BOUNCES],
    /// Reflections by silver; a ghost has one less than it met mirrors.
    pub silvered: usize,
    /// Share of the light that glass has let pass, or turned back for a ghost: 1 without ghosts.
    pub gain: f64,
    /// Length from the scanner to the end, in metres; to the last mirror if there is no end.
    pub length: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

impl Path {
    /// The facets met, in order.
    pub fn facets(&self) -> &[usize] {
        &self.facets[..self.count]
    }

    /// What the ray brought to each of them.
    pub fn meetings(&self) -> impl Iterator<Item = Meeting> + Clone {
        self.meetings.into_iter().flatten()
    }

    /// Where they were met, in the sensor frame.
    pub fn points(&self) -> &[Point3<f64>] {
        &self.points[..self.count]
    }
}

impl Setting<'_> {
    /// Follows a ray from mirror to mirror, always to the nearest surface.
    ///
    /// A mirror reflects with its face; its back is opaque, unless the mirror has two sides.
    pub fn trace(&self, ray: &Ray) -> Path {
        self.path(ray, None)
    }

    /// The ghosts of a ray: for every glass on its way that has one, the way of the light that its front turned back.
    ///
    /// Light that is turned back twice or goes to and fro within a glass is left out, and so is what goes out by one
    /// way and comes home by the other: the energy of all ways together is less than what was sent.
    pub fn ghosts(&self, ray: &Ray, path: &Path) -> impl Iterator<Item = Path> {
        let fronts = path.facets().iter().enumerate();
        let fronts = fronts.filter(|(_, f)| self.contents.facets[**f].glass.is_some_and(|g| g.ghost));
        fronts.map(|(bounce, _)| self.path(ray, Some(bounce)))
    }

    fn path(&self, ray: &Ray, ghost: Option<usize>) -> Path {
        let mut path = Path::begin(ray);
        let course = self.follow(ray, self.contents.max_bounces, ghost, |bounce| path.add(bounce));
        path.end(&course);
        path
    }

    /// Follows a ray over at most `limit` mirrors and tells of every bounce; at bounce number `ghost` the light is
    /// turned back by the front of the glass.
    pub(crate) fn follow(
        &self,
        ray: &Ray,
        limit: usize,
        ghost: Option<usize>,
        mut tell: impl FnMut(&Bounce),
    ) -> Course {
        let mut course = Course::begin(ray);
        let mut left = None;
        while let Some(leg) = self.cast(&course.last, left) {
            left = self.step(&mut course, &leg, limit, ghost, &mut tell);
            if left.is_none() {
                break;
            }
        }
        course
    }

    /// Takes a course to the end of a leg, and over the mirror there; the surface that it leaves if it goes on.
    fn step(
        &self,
        course: &mut Course,
        leg: &Leg<'_>,
        limit: usize,
        ghost: Option<usize>,
        tell: &mut impl FnMut(&Bounce),
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
        tell(&bounce);
        let glass = self.contents.facets[facet].glass.filter(|g| g.ghost);
        if ghost == Some(course.count) {
            // No glass in the way turns nothing back.
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

    /// A reflection; `None` if the light comes to the rim of the glass.
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
        let mut bounce = Bounce {
            facet,
            point: hit.point,
            surface: hit.surface,
            length,
            passage: None,
            after: Ray {
                origin: hit.point,
                direction: mirror::reflect(&incoming, &normal),
            },
            length_after: length,
            meeting: Meeting {
                surface: hit.surface,
                length,
                cos_incidence,
                silvered: course.silvered,
                gain: course.gain,
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

impl Bounce {
    /// The same in the frame of a sensor in another place.
    fn seen_from(self, kept_from_sensor: &Pose) -> Self {
        let turned = |v: &Vector3<f64>| kept_from_sensor.inverse_transform_vector(v);
        Self {
            point: kept_from_sensor.inverse_transform_point(&self.point),
            passage: self.passage.map(|p| Passage {
                to_silver: turned(&p.to_silver),
                walk: turned(&p.walk),
                ..p
            }),
            after: placed(&self.after, &kept_from_sensor.inverse()),
            ..self
        }
    }
}
