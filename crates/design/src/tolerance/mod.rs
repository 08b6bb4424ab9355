//! What manufacturing errors do to a layout: many structures, each as it may be built from one drawing.
//!
//! A draw is the structure that [`simulate`](catoptric_sim::Laboratory) builds under a seed: facets a little turned,
//! shifted, thicker and uneven by `superstructure.as_built`, the scanner a little askew in its housing by `scanner.mount`.
//! An element that the same facet deflects alone in the drawing and as built is off by the angle between its two exit
//! directions in the sensor frame: what the drawing, taken for a calibration, would get wrong. A facet that is turned by
//! ω ~ N(0, σ²I) turns its normal by δm = ω×m, and a beam u by
//!
//! ```text
//! δv = −2·[(δm·u)·m + (m·u)·δm]        E|δv|² = 4σ²·(1 + cos² i)        cos i = |m·u|
//! ```
//!
//! Beside it stand the elements that are split or lose their direction, what each kind of error does alone, and what a
//! calibration from the scene's own boards leaves: its bound, or what is found by simulating experiments.
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
pub use summary::{Counts, Distribution, Errors, FacetTolerance, Histogram, Source, Tolerance};

/// Version of what a tolerance analysis is written as.
pub const SCHEMA_VERSION: u32 = 1;

use crate::layout::{Requirement, RequirementError, Unmet, numbers};

/// Judges a requirement on a tolerance analysis; a figure that has no value meets no limit.
///
/// # Errors
/// [`RequirementError::Unknown`] if no figure has its name.
pub fn judge(requirement: &Requirement, tolerance: &Tolerance) -> Result<Vec<Unmet>, RequirementError> {
    let value = serde_json::to_value(tolerance).unwrap_or_default();
    let figures = numbers(&value, &["schema_version", "seed", "worst_seed", "histogram"]);
    requirement.judge_figures(
        &tolerance.name,
        &figures,
        "direction_deg.rms, lost_worst, facets.*.direction_deg.p95",
    )
}
