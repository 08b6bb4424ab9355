//! The way of a ray, and what it is made of: bounces, and how it ends.

use crate::light::glass::Passage;
use catoptric_cast::Ray;
use catoptric_cast::{Hit, placed};
use catoptric_model::Pose;
use nalgebra::{Point3, Vector3};

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
    pub(super) meeting: Meeting,
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

    pub(super) fn begin(ray: &Ray) -> Self {
        Self {
            count: 0,
            facets: [0; MAX_BOUNCES],
            points: [Point3::origin(); MAX_BOUNCES],
            meetings: [None; MAX_BOUNCES],
            silvered: 0,
            gain: 1.0,
            length: 0.0,
            last: *ray,
            end: End::Escaped,
        }
    }

    pub(super) fn add(&mut self, bounce: &Bounce) {
        self.facets[self.count] = bounce.facet;
        self.points[self.count] = bounce.point;
        self.meetings[self.count] = Some(bounce.meeting);
        self.count += 1;
    }

    pub(super) fn end(&mut self, course: &Course) {
        self.silvered = course.silvered;
        self.gain = course.gain;
        self.length = course.length;
        self.last = course.last;
        self.end = course.end;
    }
}

impl Course {
    pub(super) fn begin(ray: &Ray) -> Self {
        Self {
            count: 0,
            length: 0.0,
            silvered: 0,
            gain: 1.0,
            last: *ray,
            end: End::Escaped,
        }
    }
}

impl Bounce {
    /// The same in the frame of a sensor in another place.
    pub(super) fn seen_from(self, kept_from_sensor: &Pose) -> Self {
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
