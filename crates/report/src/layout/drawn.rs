//! A layout as pages and pictures draw it: its analysis, and its geometry.

use catoptric_design::layout::{Analysis, Depth, Drawing};
use catoptric_sim::build::BuiltFacet;
use catoptric_sim::{Scene, SimError};
use nalgebra::Point3;

/// A layout: its analysis, and the geometry to draw.
#[derive(Debug, Clone)]
pub struct Drawn {
    pub(super) analysis: Analysis,
    pub(super) drawing: Drawing,
    pub(super) depth: Depth,
}

impl Drawn {
    /// Traces the geometry of an analyzed layout.
    ///
    /// # Errors
    /// As [`layout::analyze`](catoptric_design::layout::analyze).
    pub fn new(scene: &Scene, analysis: &Analysis) -> Result<Self, SimError> {
        let mut scene = scene.clone();
        // As many sub-rays as in the analysis; that number came from a scene.
        scene.scanner.sub_rays = u32::try_from(analysis.sub_rays).unwrap_or(scene.scanner.sub_rays);
        let drawing = Drawing::new(&scene, analysis.seed)?;
        Ok(Self {
            depth: catoptric_design::layout::depth(&scene, &drawing)?,
            drawing,
            analysis: analysis.clone(),
        })
    }
}

impl Drawn {
    /// The same layout under another name, to distinguish it from the one beside it.
    #[must_use]
    pub fn named(mut self, name: &str) -> Self {
        name.clone_into(&mut self.analysis.name);
        self
    }
}

/// Returns the outline of a facet's face: its corners, or more points of a curved rim.
pub(super) fn rim(facet: &BuiltFacet) -> Vec<Point3<f64>> {
    let bent = facet.bent.as_ref().map(|bent| bent.face.rim());
    bent.unwrap_or_else(|| facet.face.corners.clone())
}

/// Returns the radius about the scanner of everything built, in meters.
pub(super) fn radius(drawing: &Drawing) -> f64 {
    let faces = drawing.facets.iter().flat_map(|f| &f.face.corners);
    let bodies = drawing.parts.iter().flat_map(|p| p.skin.iter().flatten());
    // The lower limit leaves something to draw axes in if nothing is built.
    faces.chain(bodies).map(|p| p.coords.norm()).fold(0.05, f64::max)
}
