//! A layout that keeps the traced paths of its beams, so that an edit retraces only the beams that it may affect.
//!
//! After a change of mirrors or posts, only beams that hit the changed ones, or that pass where they are now, are
//! traced again. The results for the layout are bit-identical to those of a layout traced from scratch.

use super::footprint::{Footprint, Outlines};
use super::traced::{Traced, trace_one};
use catoptric_sim::build::Structure;
use catoptric_sim::light::{Edit, Mirrors, Setting};
use catoptric_sim::receive::Sensor;
use catoptric_sim::{Scene, SimError};
use rayon::prelude::*;
use serde::Serialize;
use std::sync::Arc;

/// Level of detail of an analysis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Detail {
    /// The scene's own sub-rays.
    #[default]
    Full,
    /// One ray per beam: elements that an edge cuts are not distinguished.
    Coarse,
}

/// An analyzed layout that can be edited.
///
/// ```
/// use catoptric_design::layout::{Detail, Layout, analyze};
/// use catoptric_sim as sim;
///
/// # fn main() -> Result<(), Box<dyn std::error::Error>> {
/// let mut scene: sim::Scene = toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?;
/// let drawn = Layout::new(&scene, None, Detail::Full)?;
/// scene.superstructure.facet[1] = toml::from_str(
///     r#"name = "right"
///     shape.rectangle = { center_mm = [-20, -68, 0], normal = [0.4, 0.3, -0.33], width_mm = 71, height_mm = 30 }"#,
/// )?;
/// let edited = drawn.edited(&scene)?;
/// assert_eq!(edited.analysis()?, analyze(&scene, None, Detail::Full)?);
/// # Ok(())
/// # }
/// ```
pub struct Layout {
    pub(super) scene: Scene,
    pub(super) seed: Option<u64>,
    detail: Detail,
    pub(super) sensor: Sensor,
    pub(super) structure: Structure,
    pub(super) beams: Vec<Arc<Beam>>,
}

/// The traced paths and footprints of a beam.
pub(super) struct Beam {
    pub(super) traced: Traced,
    pub(super) footprints: Vec<Footprint>,
}

impl Layout {
    /// Traces a layout as drawn, or as built under a seed.
    ///
    /// # Errors
    /// As [`analyze`](super::analyze).
    pub fn new(scene: &Scene, seed: Option<u64>, detail: Detail) -> Result<Self, SimError> {
        let mut layout = Self::drawn(scene, seed, detail)?;
        layout.beams = layout.trace(&layout.setting()?, |_| None);
        Ok(layout)
    }

    /// Returns the layout of another scene; beams that the difference cannot affect are not traced again.
    ///
    /// # Errors
    /// As [`Layout::new`].
    pub fn edited(&self, scene: &Scene) -> Result<Self, SimError> {
        let mut layout = Self::drawn(scene, self.seed, self.detail)?;
        let setting = layout.setting()?;
        let edit = match differ_only_in_structure(&self.scene, scene) {
            true => Edit::between(&self.setting()?, &setting),
            false => None,
        };
        let known = |beam: usize| {
            let (known, edit) = (&self.beams[beam], edit.as_ref()?);
            (!edit.may_change(&known.traced.trail)).then(|| Arc::clone(known))
        };
        let beams = layout.trace(&setting, known);
        drop(setting);
        layout.beams = beams;
        Ok(layout)
    }

    fn drawn(scene: &Scene, seed: Option<u64>, detail: Detail) -> Result<Self, SimError> {
        let sensor = match detail {
            Detail::Full => Sensor::new(scene)?,
            Detail::Coarse => {
                let mut coarse = scene.clone();
                coarse.scanner.sub_rays = 1;
                Sensor::new(&coarse)?
            }
        };
        Ok(Self {
            structure: match seed {
                None => Structure::nominal(scene)?,
                Some(seed) => Structure::as_built(scene, seed)?,
            },
            scene: scene.clone(),
            seed,
            detail,
            sensor,
            beams: Vec::new(),
        })
    }

    pub(super) fn setting(&self) -> Result<Setting<'_>, SimError> {
        Setting::new(&self.scene, &self.structure, Mirrors::Attached, Vec::new())
    }

    /// Traces every beam that is not known.
    fn trace(
        &self,
        setting: &Setting<'_>,
        known: impl Fn(usize) -> Option<Arc<Beam>> + Sync,
    ) -> Vec<Arc<Beam>> {
        let outlines = Outlines::new(&self.sensor, &self.structure);
        let trace = |beam| {
            let traced = trace_one(&self.sensor, setting, &self.scene, beam);
            let footprints = outlines.of(&traced);
            Arc::new(Beam { traced, footprints })
        };
        let beams = (0..self.sensor.scan().beams()).into_par_iter();
        beams
            .map(|beam| known(beam).unwrap_or_else(|| trace(beam)))
            .collect()
    }
}

/// Whether scenes differ only in their mirrors, posts and names.
fn differ_only_in_structure(one: &Scene, other: &Scene) -> bool {
    let rest = |scene: &Scene| {
        let mut scene = scene.clone();
        scene.name.clear();
        let structure = &mut scene.superstructure;
        structure.facet.clear();
        structure.post.clear();
        structure.pattern.clear();
        scene
    };
    rest(one) == rest(other)
}
