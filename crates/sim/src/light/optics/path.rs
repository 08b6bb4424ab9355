//! The path of a ray and its parts: bounces, and how it ends.

use crate::light::glass::Passage;
use catoptric_cast::Ray;
use catoptric_cast::{SurfacePoint, placed};
use catoptric_model::Pose;
use nalgebra::{Point3, Unit, Vector3};

/// Maximum number of mirrors that a ray can hit; `max_bounces` may be less.
pub const MAX_BOUNCES: usize = 8;

/// How a ray path ends.
#[derive(Debug, Clone, Copy)]
pub enum End {
    /// On a surface that scatters.
    Hit(SurfacePoint),
    /// In the open.
    Escaped,
    /// Between mirrors after the last bounce that is allowed, or in the rim of a mirror's glass.
    Trapped,
}

/// The state of a ray where it hits a mirror.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Index of the surface.
    pub surface: usize,
    /// Length up to the mirror, in meters.
    pub length: f64,
    /// Cosine of the incidence.
    pub cos_incidence: f64,
    /// Number of earlier reflections by silver.
    pub silvered: usize,
    /// Share of the light that earlier glass has transmitted.
    pub gain: f64,
    /// Index of the mirror; `None` if the front of its glass reflects, whatever its coating.
    pub silver: Option<usize>,
    /// Direction in which the light goes on.
    pub after: Unit<Vector3<f64>>,
}

impl Meeting {
    /// The mirror whose coating counts, and where the light goes on.
    pub(crate) fn hop(&self) -> (Option<usize>, Unit<Vector3<f64>>) {
        (self.silver, self.after)
    }
}

/// A reflection.
#[derive(Debug, Clone, Copy)]
pub struct Bounce {
    /// Index of the mirror.
    pub facet: usize,
    /// Where the mirror is hit.
    pub point: Point3<f64>,
    /// Index of the surface.
    pub surface: usize,
    /// Length up to `point`, in meters.
    pub length: f64,
    /// The passage through glass, if there is any.
    pub passage: Option<Passage>,
    /// The ray that leaves.
    pub after: Ray,
    /// Length up to where it leaves, in meters.
    pub length_after: f64,
    pub(super) meeting: Meeting,
}

/// The overall result of following a ray.
#[derive(Debug, Clone, Copy)]
pub struct Course {
    /// Number of mirrors hit.
    pub count: usize,
    /// Length to the end, in meters; to the last mirror if there is no end.
    pub length: f64,
    /// Number of reflections by silver.
    pub silvered: usize,
    /// Share of the light that glass transmits, or reflects for a ghost.
    pub gain: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

/// The path of a ray.
#[derive(Debug, Clone, Copy)]
pub struct RayPath {
    count: usize,
    facets: [usize; MAX_BOUNCES],
    points: [Point3<f64>; MAX_BOUNCES],
    meetings: [Option<Meeting>; MAX_BOUNCES],
    /// Number of reflections by silver; for a ghost, one less than the number of mirrors hit.
    pub silvered: usize,
    /// Share of the light that glass transmits, or reflects for a ghost: 1 without ghosts.
    pub gain: f64,
    /// Length from the scanner to the end, in meters; to the last mirror if there is no end.
    pub length: f64,
    /// The last leg.
    pub last: Ray,
    /// How it ends.
    pub end: End,
}

/// By which mirrors a ray goes, and on what it ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Route {
    facets: [usize; MAX_BOUNCES],
    count: usize,
    /// The surface that it ends on; `None` in the open and between mirrors.
    end: Option<usize>,
    trapped: bool,
}

impl Route {
    pub(super) fn begin() -> Self {
        Self {
            facets: [0; MAX_BOUNCES],
            count: 0,
            end: None,
            trapped: false,
        }
    }

    pub(super) fn add(&mut self, bounce: &Bounce) {
        self.facets[self.count] = bounce.facet;
        self.count += 1;
    }

    pub(super) fn end(&mut self, course: &Course) {
        match course.end {
            End::Hit(hit) => self.end = Some(hit.surface),
            End::Escaped => {}
            End::Trapped => self.trapped = true,
        }
    }
}

impl RayPath {
    /// The facets hit, in order.
    pub fn facets(&self) -> &[usize] {
        &self.facets[..self.count]
    }

    /// The state of the ray at each of them.
    pub fn meetings(&self) -> impl Iterator<Item = Meeting> + Clone {
        self.meetings.into_iter().flatten()
    }

    /// Whether a path goes by the same mirrors and ends on the same surface.
    pub fn goes_like(&self, other: &Self) -> bool {
        let surface = |path: &Self| match path.end {
            End::Hit(hit) => Some(hit.surface),
            End::Escaped | End::Trapped => None,
        };
        let trapped = |path: &Self| matches!(path.end, End::Trapped);
        self.facets() == other.facets() && surface(self) == surface(other) && trapped(self) == trapped(other)
    }

    /// Where they are hit, in the sensor frame.
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
    /// The same in the frame of a sensor with another pose.
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
            meeting: Meeting {
                after: kept_from_sensor.inverse_transform_unit_vector(&self.meeting.after),
                ..self.meeting
            },
            ..self
        }
    }
}
