//! The effect of manufacturing errors on a layout: many structures, each as it may be built from one drawing.
//!
//! A draw is the structure that [`simulate`](catoptric_sim::Laboratory) builds under a seed: facets turned, shifted,
//! with other thicknesses and slope errors by `superstructure.as_built`, and the scanner misaligned in its housing by
//! `scanner.mount`. For an element that the same facet deflects alone in the drawing and as built, the error is the
//! angle between its two exit directions in the sensor frame: the error of the drawing if it is used as a calibration.
//! A rotation of a facet by ω ~ N(0, σ²I) turns its normal by δm = ω×m, and the reflection of a beam u by
//! ```text
//! δv = −2·[(δm·u)·m + (m·u)·δm]        E|δv|² = 4σ²·(1 + cos² i)        cos i = |m·u|
//! ```
//!
//! The analysis also counts the elements that are split or lose their direction, separates the effect of each kind of
//! error, and states the error that a calibration from the scene's own boards leaves: its bound, or the result of
//! simulated experiments.
//!
//! ```
//! use catoptric_design::tolerance::Workshop;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let scene: catoptric_sim::Scene = toml::from_str(include_str!("../../../../scenes/two-mirror.toml"))?;
//! let workshop = Workshop::new(&scene)?;
//! let built: Vec<_> = (1..=10).map(|seed| workshop.build(seed)).collect::<Result<_, _>>()?;
//! let tolerance = workshop.summarize(&built);
//! assert!(tolerance.direction_deg.rms.is_some_and(|rms| rms > 1.0 && rms < 5.0));
//! # Ok(())
//! # }
//! ```

mod after;
mod cause;
mod draw;
mod summary;

pub use after::{Bounds, Calibrated, calibrate};
pub use cause::Cause;
pub use draw::{Built, Departure, Draw, POINT_RANGE_M, Workshop};
pub use summary::{
    Counts, Distribution, Errors, FacetTolerance, Histogram, SCHEMA_VERSION, Source, Tolerance,
};

use crate::layout::{Requirement, RequirementError, Unmet, numbers};

/// Checks a requirement on a tolerance analysis; a figure without a value meets no limit.
///
/// # Errors
/// [`RequirementError::Unknown`] if no figure has that name.
pub fn judge(requirement: &Requirement, tolerance: &Tolerance) -> Result<Vec<Unmet>, RequirementError> {
    let value = serde_json::to_value(tolerance).unwrap_or_default();
    let figures = numbers(&value, &["schema_version", "seed", "worst_seed", "histogram"]);
    requirement.judge_figures(
        &tolerance.name,
        &figures,
        "direction_deg.rms, lost_worst, facets.*.direction_deg.p95",
    )
}
