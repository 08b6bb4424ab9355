//! Requirements on a layout, such as `field_of_regard>=0.004`, for pipelines that check layouts automatically.
//!
//! Every number of the JSON except those of single elements has a name: its keys joined by dots, facets by their names,
//! other lists by index. `*` instead of a facet's name means every facet.

use super::analysis::Analysis;
pub(crate) use catoptric_assess::requirement::numbers;
pub use catoptric_assess::requirement::{Requirement, RequirementError, Unmet};

/// Checks a requirement on a layout; a figure without a value meets no limit.
///
/// # Errors
/// [`RequirementError::Unknown`] if no figure has that name.
pub fn judge(requirement: &Requirement, analysis: &Analysis) -> Result<Vec<Unmet>, RequirementError> {
    requirement.judge_figures(
        &analysis.name,
        &figures(analysis),
        "field_of_regard, lost, counts.split, facets.*.margin_mm",
    )
}

/// Returns every number of an analysis with its name, except those of single elements and runs; `None` for one without
/// a value.
pub fn figures(analysis: &Analysis) -> Vec<(String, Option<f64>)> {
    // An analysis has string keys and finite numbers, so its conversion cannot fail.
    let value = serde_json::to_value(Analysis {
        elements: Vec::new(),
        runs: Vec::new(),
        ..analysis.clone()
    });
    numbers(
        &value.unwrap_or_default(),
        &["elements", "runs", "schema_version", "seed"],
    )
}
