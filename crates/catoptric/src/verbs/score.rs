//! Scores and comparisons under rules of your own: how much has to be solved, and limits on figures.

use crate::Error;
use catoptric_assess::score::score;
use catoptric_assess::{CompareError, Comparison, Contestant, Rules, Score, compare};
use catoptric_model::{Calibration, Dataset};
use catoptric_sim::Truth;

/// Scores a calibration as [`score`](fn@crate::score) does, under rules of your own.
///
/// ```
/// use catoptric::{Method, Rules, Scene, Template, Verdict, requirement::Requirement};
///
/// # fn main() -> Result<(), catoptric::Error> {
/// let scene = Scene::template(Template::TwoMirror).with(&["experiment.scans_per_pose=5", "scanner.sub_rays=1"])?;
/// let (dataset, truth) = catoptric::simulate(&scene)?;
/// let calibration = catoptric::calibrate(&dataset)?;
/// let rules = Rules {
///     min_solved: Some(0.95),
///     requirements: vec![Requirement::maximum("per_axis_rms_deg=0.0001")?],
/// };
/// let score = catoptric::score_with(&dataset, &calibration, &truth, &rules)?;
/// assert_eq!(score.verdict, Verdict::Fail, "nobody is that good");
/// # Ok(())
/// # }
/// ```
///
/// # Errors
/// [`Error::Unreadable`] if the recording can no longer be read, [`Error::Requirement`] if a requirement names no figure.
pub fn score_with<'t>(
    dataset: &Dataset,
    calibration: &Calibration,
    truth: impl Into<Option<&'t Truth>>,
    rules: &Rules,
) -> Result<Score, Error> {
    let found = score(dataset, calibration, truth)?;
    Ok(rules.applied(found)?)
}

/// Compares calibrations of one dataset as [`compare`](fn@crate::compare) does, under rules of your own.
///
/// # Errors
/// Same as [`score_with`].
pub fn compare_with(
    dataset: &Dataset,
    contestants: &[Contestant],
    truth: Option<&Truth>,
    rules: &Rules,
) -> Result<Comparison, Error> {
    compare::compare_by(dataset, contestants, truth, rules).map_err(|error| match error {
        CompareError::Unreadable(error) => error.into(),
        CompareError::Requirement(error) => error.into(),
    })
}
