//! The verbs, one file each: inputs, results and errors.

#[cfg(feature = "recording")]
mod apply;
mod calibrate;
#[cfg(feature = "design")]
mod export;
#[cfg(feature = "design")]
mod layout;
#[cfg(feature = "design")]
mod optimize;
#[cfg(feature = "design")]
mod plan;
mod score;
mod simulate;
mod study;
#[cfg(feature = "design")]
mod tolerance;
#[cfg(feature = "recording")]
mod trace;

#[cfg(feature = "recording")]
pub use apply::apply_into;
#[cfg(feature = "recording")]
pub use calibrate::read_dataset_with;
pub use calibrate::{calibrate, calibrate_with, characterize};
#[cfg(feature = "design")]
pub use export::{ExportOptions, Exported, Format as ExportFormat, export, export_boards};
#[cfg(all(feature = "design", feature = "report"))]
pub use layout::{LAYOUT_FOLDER, write_layouts};
#[cfg(feature = "design")]
pub use layout::{LAYOUT_PAGE, LayoutOptions, distinct_names, layout, layout_json};
#[cfg(feature = "design")]
pub use optimize::{BEST_SCENE, OPTIMUM_PAGE, optimize, shown_of_front};
#[cfg(all(feature = "design", feature = "report"))]
pub use optimize::{OPTIMUM_FOLDER, write_optimum};
#[cfg(feature = "design")]
pub use plan::{PlanStart, completed_scene, plan, planned_scene, planned_text, write_planned};
pub use score::{compare_with, score_with};
#[cfg(feature = "recording")]
pub use simulate::{Figures, Recording, simulate_into};
pub use simulate::{simulate, simulate_with};
pub use study::study;
#[cfg(feature = "recording")]
pub use study::{STUDY_PAGE, merge_studies, study_into};
#[cfg(all(feature = "design", feature = "report"))]
pub use tolerance::{TOLERANCE_FOLDER, write_tolerance};
#[cfg(feature = "design")]
pub use tolerance::{TOLERANCE_PAGE, ToleranceOptions, tolerance};
#[cfg(feature = "recording")]
pub use trace::{MAX_BOUNCES, TraceFigures, trace};
