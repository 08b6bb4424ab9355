//! Classifies what the structure does to a beam.

use super::sensor::Sensor;
use crate::light::edges;
use crate::light::footprint::SubRay;
use crate::light::optics::{End, RayPath, Setting};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What the structure does to a beam.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeamClass {
    /// All of it passes by.
    Direct,
    /// All of it leaves by one facet.
    Deflected,
    /// An edge divides it between paths, of which the chief ray's lacks more light than lies beyond three standard
    /// deviations.
    Split,
    /// All of it leaves after more than one facet.
    MultiBounce,
    /// All of it ends on the structure.
    Blocked,
    /// All of it is still between mirrors after the last bounce that is allowed.
    Lost,
}

impl Sensor {
    /// What the structure does to a beam, and the share of its energy that takes the path of the chief ray.
    ///
    /// `bare` is a setting without targets, so that light leaving the structure escapes.
    pub fn classify(&self, bare: &Setting<'_>, beam: usize) -> (BeamClass, f64) {
        let chief = self.chief_path(bare, beam);
        let paths: Vec<_> = self.paths(bare, beam).collect();
        class(&chief, paths.iter().map(|(sub_ray, path)| (*sub_ray, path)))
    }
}

/// What the structure does to a beam, given the paths of its chief ray and its sub-rays, and the share of its energy
/// that takes the path of the chief ray.
pub fn class<'p>(
    chief: &RayPath,
    paths: impl IntoIterator<Item = (&'p SubRay, &'p RayPath)>,
) -> (BeamClass, f64) {
    let of = |path: &RayPath| match path.end {
        End::Hit(_) => BeamClass::Blocked,
        End::Trapped => BeamClass::Lost,
        End::Escaped => match path.facets().len() {
            0 => BeamClass::Direct,
            1 => BeamClass::Deflected,
            _ => BeamClass::MultiBounce,
        },
    };
    let (mut share, mut others) = (0.0, 0.0);
    for (sub_ray, path) in paths {
        // Light that ends on the structure is lost to the scanner, whichever part of it is hit.
        let same =
            of(path) == of(chief) && (of(path) == BeamClass::Blocked || path.facets() == chief.facets());
        if same {
            share += sub_ray.weight;
        } else {
            others += sub_ray.weight;
        }
    }
    let whole = others < edges::NEGLIGIBLE;
    (if whole { of(chief) } else { BeamClass::Split }, share)
}
