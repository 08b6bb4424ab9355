//! What a mirror layout sees, loses and allows: the analysis that is possible before a mirror is cut.
//!
//! The analysis is noise-free and uses the same sub-rays as [`simulate`](catoptric_sim::Laboratory), so that the class
//! of every element is that of the truth of a recording. [`analyze`] is cheap: with [`Detail::Coarse`] (one ray per
//! beam) it takes a few milliseconds, and a search can call it thousands of times. [`predict`], the accuracy that a
//! calibration can reach, simulates every board pose of the experiment and takes longer.
//!
//! **Field of regard.** A scanner's beams are discrete, so an element is given a cell of directions: along the scan
//! half-way to its neighbors, across it up to the 1/e² contour of its own beam,
//!
//! ```text
//! cell = [θ_b − step/2, θ_b + step/2] × [−δ/2, δ/2]      Ω = step·2·sin(δ/2)      δ² = (δ_wide·sin θ_b)² + (δ_narrow·cos θ_b)²
//! ```
//!
//! (δ = δ_narrow where the spot does not turn). A plane mirror preserves solid angles, so a flat facet covers ΣΩ over
//! its elements, whatever its pose. The field of regard is the share of 4π that the cells of all unsplit elements
//! cover, each direction counted once. The share of directions within 5° of a beam is reported as well, for users who
//! move the rig or look for large objects.
//!
//! ```
//! use catoptric_design::layout;
//! use catoptric_sim as sim;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene: sim::Scene = toml::from_str(include_str!("../../../../scenes/prototype.toml"))?;
//! let drawn = layout::analyze(&scene, None, layout::Detail::Coarse)?;
//! assert_eq!(drawn.elements.len(), 1081);
//! assert!(drawn.facets.iter().all(|f| f.elements > 50));
//! assert!(drawn.field_of_regard > 0.003 && drawn.share_within_5_deg > 0.07);
//! # Ok(())
//! # }
//! ```

mod accuracy;
mod analysis;
mod depth;
mod drawing;
mod element;
mod facet;
mod field;
mod footprint;
mod incremental;
mod require;
mod sensitivity;
mod size;
mod stretch;
mod traced;

pub use accuracy::{Accuracy, FacetAccuracy, predict};
pub use analysis::{Analysis, ElementRun, SCHEMA_VERSION, SPOT_RANGES_M, Spot};
pub use depth::{Depth, depth};
pub use drawing::{Drawing, DrawnPart, DrawnRay};
pub use element::{DARK, LayoutElement};
pub use facet::FacetView;
pub use field::{Cell, NEAR_DEG};
pub use footprint::{Footprint, OUTLINE};
pub use incremental::{Detail, Layout};
pub(crate) use require::numbers;
pub use require::{Requirement, RequirementError, Unmet, figures, judge};
pub use sensitivity::center;
pub(crate) use size::plate_thickness;
pub use size::{MIRROR_DENSITY, POST_DENSITY, Size};
pub use stretch::Stretch;
pub use traced::Class;
pub(crate) use traced::{Traced, exit, trace};

use catoptric_sim::{Scene, SimError};

/// Analyzes a layout: as drawn, or as built under a seed.
///
/// # Errors
/// [`SimError`] for a facet without a shape, an unknown color or a mesh that has not been read.
pub fn analyze(scene: &Scene, seed: Option<u64>, detail: Detail) -> Result<Analysis, SimError> {
    Layout::new(scene, seed, detail)?.analysis()
}
