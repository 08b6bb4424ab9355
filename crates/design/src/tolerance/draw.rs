//! One structure as built, beam by beam beside the drawing.

use super::Cause;
use crate::layout::{Class, Traced, exit, trace};
use catoptric_model::beam;
use catoptric_sim::build::Structure;
use catoptric_sim::light::{Mirrors, Setting};
use catoptric_sim::receive::Sensor;
use catoptric_sim::{Scene, SimError};
use nalgebra::{Point3, Unit, Vector3};

/// Length of the whole way for which the error of a point is stated, in metres.
pub const POINT_RANGE_M: f64 = 4.0;

/// A drawing, from which structures are built.
pub struct Workshop {
    whole: Bench,
    alone: Vec<(Cause, Bench)>,
}

/// A structure as built under a seed.
#[derive(Debug, Clone, PartialEq)]
pub struct Built {
    /// What it is like with all errors.
    pub whole: Draw,
    /// How far elements are off with errors of one kind alone, in the order of [`Workshop::causes`]: number of elements,
    /// sum of squares of the direction's error in rad², and of the point's in m².
    pub alone: Vec<(usize, f64, f64)>,
}

/// What a structure is like beside its drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Draw {
    /// The seed.
    pub seed: u64,
    /// Elements that an edge splits.
    pub split: usize,
    /// Elements without a direction of their own, split ones among them.
    pub lost: usize,
    /// Elements that a facet deflects in the drawing, and that this facet does not deflect, or not alone, as built.
    pub changed: usize,
    /// Those that it does.
    pub departures: Vec<Departure>,
}

/// How far an element is from where it is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Departure {
    /// The element.
    pub beam: usize,
    /// Number of its facet.
    pub facet: usize,
    /// Angle between the directions in which it leaves, in radians.
    pub direction: f64,
    /// Distance between its points at [`POINT_RANGE_M`], in metres.
    pub point: f64,
}

/// A scene with its drawing, followed once.
pub(super) struct Bench {
    pub(super) scene: Scene,
    sensor: Sensor,
    pub(super) drawn: Vec<Traced>,
}

impl Workshop {
    /// Follows the beams of the drawing.
    ///
    /// # Errors
    /// As [`layout::analyze`](crate::layout::analyze).
    pub fn new(scene: &Scene) -> Result<Self, SimError> {
        let mut alone = Vec::new();
        for cause in Cause::ALL {
            if let Some(mut scene) = cause.alone(scene) {
                // A direction is the chief ray's.
                scene.scanner.sub_rays = 1;
                alone.push((cause, Bench::new(scene)?));
            }
        }
        Ok(Self {
            whole: Bench::new(scene.clone())?,
            alone,
        })
    }

    /// Builds a structure and follows its beams.
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

    /// The kinds of errors that the scene has.
    pub fn causes(&self) -> impl Iterator<Item = Cause> + '_ {
        self.alone.iter().map(|(cause, _)| *cause)
    }

    pub(super) fn bench(&self) -> &Bench {
        &self.whole
    }
}

/// Where an element that one facet deflects alone looks.
struct Way {
    facet: usize,
    exit: Unit<Vector3<f64>>,
    point: Point3<f64>,
}

fn way(traced: &Traced) -> Option<Way> {
    let [facet] = traced.chief.facets() else {
        return None;
    };
    let exit = exit(&traced.chief).filter(|_| traced.class() == Class::Deflected)?;
    let path = &traced.chief;
    Some(Way {
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
            let Some(from) = way(drawn) else {
                continue;
            };
            match way(built).filter(|to| to.facet == from.facet) {
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

    /// Elements that a facet deflects alone in the drawing.
    pub(super) fn drawn_of(&self, facet: usize) -> usize {
        let ways = self.drawn.iter().filter_map(way);
        ways.filter(|w| w.facet == facet).count()
    }
}
