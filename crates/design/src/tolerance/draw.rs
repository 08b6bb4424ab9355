//! One structure as built, compared beam by beam with the drawing.

use super::Cause;
use crate::layout::{Class, Traced, exit, trace};
use catoptric_model::beam;
use catoptric_sim::build::Structure;
use catoptric_sim::light::{Mirrors, Setting};
use catoptric_sim::receive::Sensor;
use catoptric_sim::{Scene, SimError};
use nalgebra::{Point3, Unit, Vector3};

/// Length of the ray path at which the error of a point is stated, in meters.
pub const POINT_RANGE_M: f64 = 4.0;

/// A drawing from which structures are built.
pub struct Workshop {
    whole: Bench,
    alone: Vec<(Cause, Bench)>,
}

/// A structure as built under a seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// The structure with all errors.
    pub whole: Draw,
    /// Errors of the elements with one kind of error alone, in the order of [`Workshop::causes`]: number of elements,
    /// sum of squares of the direction's error in rad², and of the point's in m².
    pub alone: Vec<(usize, f64, f64)>,
}

/// A structure as built, compared with its drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// The seed.
    pub seed: u64,
    /// Number of elements that an edge splits.
    pub split: usize,
    /// Number of elements without a direction of their own, split ones included.
    pub lost: usize,
    /// Number of elements that a facet deflects in the drawing, and that this facet does not deflect, or not alone, as
    /// built.
    pub changed: usize,
    /// The elements that it does deflect alone.
    pub departures: Vec<Departure>,
}

/// Difference between an element as built and as drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// The element.
    pub beam: usize,
    /// Number of its facet.
    pub facet: usize,
    /// Angle between its exit directions, in radians.
    pub direction: f64,
    /// Distance between its points at [`POINT_RANGE_M`], in meters.
    pub point: f64,
}

/// A scene whose drawing has been traced.
pub(super) struct Bench {
    pub(super) scene: Scene,
    sensor: Sensor,
    pub(super) drawn: Vec<Traced>,
}

impl Workshop {
    /// Traces the beams of the drawing.
    ///
    /// # Errors
    /// As [`layout::analyze`](crate::layout::analyze).
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let mut alone = Vec::new();
        for cause in Cause::ALL {
            if let Some(mut scene) = cause.alone(scene) {
                // The direction is the chief ray's.
                scene.scanner.sub_rays = 1;
                alone.push((cause, Bench::new(scene)?));
            }
        }
        Ok(Self {
            whole: Bench::new(scene.clone())?,
            alone,
        })
    }

    /// Builds a structure and traces its beams.
    ///
    /// # Errors
    /// As [`Workshop::new`].
    pub fn build(&self, seed: u64) -> Result<Built, SimError> {
        let sums = |(_, bench): &(Cause, Bench)| {
            let departures = bench.build(seed)?.departures;
            let square = |of: fn(&Departure) -> f64| departures.iter().map(|d| of(d).powi(2)).sum();
            Ok((departures.len(), square(|d| d.direction), square(|d| d.point)))
        };
        Ok(Built {
            whole: self.whole.build(seed)?,
            alone: self.alone.iter().map(sums).collect::<Result<_, SimError>>()?,
        })
    }

    /// Returns the kinds of errors that the scene has.
    pub fn causes(&self) -> impl Iterator<Item = Cause> + '_ {
        self.alone.iter().map(|(cause, _)| *cause)
    }

    pub(super) fn bench(&self) -> &Bench {
        &self.whole
    }
}

/// Exit direction and point of an element that one facet deflects alone.
struct SoleExit {
    facet: usize,
    exit: Unit<Vector3<f64>>,
    point: Point3<f64>,
}

fn sole_exit(traced: &Traced) -> Option<SoleExit> {
    let [facet] = traced.chief.facets() else {
        return None;
    };
    let exit = exit(&traced.chief).filter(|_| traced.class() == Class::Deflected)?;
    let path = &traced.chief;
    Some(SoleExit {
        facet: *facet,
        exit,
        point: path.last.origin + exit.into_inner() * (POINT_RANGE_M - path.length),
    })
}

impl Bench {
    fn new(scene: Scene) -> Result<Self, SimError> {
        let sensor = Sensor::new(&scene)?;
        let structure = Structure::nominal(&scene)?;
        let setting = Setting::new(&scene, &structure, Mirrors::Attached, Vec::new())?;
        let drawn = trace(&sensor, &setting, &scene);
        drop(setting);
        Ok(Self { sensor, drawn, scene })
    }

    fn build(&self, seed: u64) -> Result<Draw, SimError> {
        let structure = Structure::as_built(&self.scene, seed)?;
        let setting = Setting::new(&self.scene, &structure, Mirrors::Attached, Vec::new())?;
        let built = trace(&self.sensor, &setting, &self.scene);
        let mut draw = Draw {
            seed,
            split: built.iter().filter(|t| t.class() == Class::Split).count(),
            lost: built.iter().filter(|t| !t.class().sees()).count(),
            changed: 0,
            departures: Vec::new(),
        };
        for (drawn, built) in self.drawn.iter().zip(&built) {
            let Some(from) = sole_exit(drawn) else {
                continue;
            };
            match sole_exit(built).filter(|to| to.facet == from.facet) {
                Some(to) => draw.departures.push(Departure {
                    beam: drawn.beam,
                    facet: from.facet,
                    direction: beam::angle_between(&from.exit, &to.exit),
                    point: (to.point - from.point).norm(),
                }),
                None => draw.changed += 1,
            }
        }
        Ok(draw)
    }

    /// Returns the number of elements that a facet deflects alone in the drawing.
    pub(super) fn drawn_of(&self, facet: usize) -> usize {
        let exits = self.drawn.iter().filter_map(sole_exit);
        exits.filter(|e| e.facet == facet).count()
    }
}
