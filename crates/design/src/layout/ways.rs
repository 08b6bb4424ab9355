//! A layout with the ways of its beams, which are kept while it is changed.
//!
//! A change of some mirrors or posts is looked at again only where it may matter: by the beams that met them and those that
//! pass where they are now. All else is what it was, and what is said of the layout is the same, to the bit, as if it had
//! been looked at for the first time.

use super::element::{self, Traced};
use super::footprint::{Footprint, Outlines};
use super::{Analysis, Detail};
use catoptric_sim::build::Structure;
use catoptric_sim::light::{Edit, Mirrors, Setting};
use catoptric_sim::receive::Sensor;
use catoptric_sim::{Scene, SimError};
use rayon::prelude::*;
use std::sync::Arc;

/// A layout that was looked at, ready to be changed.
///
/// ```
/// use catoptric_design::layout::{Detail, Layout, analyze};
/// use catoptric_sim;
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
    beams: Vec<Arc<Beam>>,
}

/// What is known of a beam.
struct Beam {
    traced: Traced,
    footprints: Vec<Footprint>,
}

impl Layout {
    /// Looks at a layout: as drawn, or as built under a seed.
    ///
    /// # Errors
    /// As [`analyze`](super::analyze).
    pub fn new(scene: &Scene, seed: Option<u64>, detail: Detail) -> Result<Self, SimError> {
        let mut layout = Self::drawn(scene, seed, detail)?;
        layout.beams = layout.look(&layout.setting()?, |_| None);
        Ok(layout)
    }

    /// The layout of another scene, looked at where it may not be as it was.
    ///
    /// # Errors
    /// As [`Layout::new`].
    pub fn edited(&self, scene: &Scene) -> Result<Self, SimError> {
        let mut layout = Self::drawn(scene, self.seed, self.detail)?;
        let setting = layout.setting()?;
        let edit = match is_alike(&self.scene, scene) {
            true => Edit::between(&self.setting()?, &setting),
            false => None,
        };
        let known = |beam: usize| {
            let (known, edit) = (&self.beams[beam], edit.as_ref()?);
            (!edit.may_change(&known.traced.trail)).then(|| Arc::clone(known))
        };
        let beams = layout.look(&setting, known);
        drop(setting);
        layout.beams = beams;
        Ok(layout)
    }

    /// What it sees, loses and allows.
    ///
    /// # Errors
    /// As [`Layout::new`], though one that was made has none.
    pub fn analysis(&self) -> Result<Analysis, SimError> {
        let traced: Vec<&Traced> = self.beams.iter().map(|beam| &beam.traced).collect();
        let footprints: Vec<&Footprint> = self.beams.iter().flat_map(|beam| &beam.footprints).collect();
        Ok(super::analysis(
            self,
            &self.setting()?.names(),
            &traced,
            &footprints,
        ))
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

    fn setting(&self) -> Result<Setting<'_>, SimError> {
        Setting::new(&self.scene, &self.structure, Mirrors::Attached, Vec::new())
    }

    /// Every beam, those that are known aside.
    fn look(
        &self,
        setting: &Setting<'_>,
        known: impl Fn(usize) -> Option<Arc<Beam>> + Sync,
    ) -> Vec<Arc<Beam>> {
        let outlines = Outlines::new(&self.sensor, &self.structure);
        let look = |beam| {
            let traced = element::trace_one(&self.sensor, setting, &self.scene, beam);
            let footprints = outlines.of(&traced);
            Arc::new(Beam { traced, footprints })
        };
        let beams = (0..self.sensor.scan().beams()).into_par_iter();
        beams
            .map(|beam| known(beam).unwrap_or_else(|| look(beam)))
            .collect()
    }
}

/// Whether scenes differ in nothing but their mirrors and posts, and how they are called.
fn is_alike(one: &Scene, other: &Scene) -> bool {
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
