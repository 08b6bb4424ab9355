//! The grid of a study: all combinations of the values of some keys of a scene.

use super::{Cell, StudyError};
use catoptric_sim::Scene;
use std::str::FromStr;

/// Maximum number of values in a range of an axis.
const MAX_STEPS: u32 = 1000;

/// A key of the scene and its values.
///
/// ```
/// use catoptric_assess::study::Axis;
///
/// # fn main() -> Result<(), catoptric_assess::study::StudyError> {
/// let drift: Axis = "errors.drift_sd_mm=0:2:5".parse()?;
/// assert_eq!(drift.values(), ["0", "0.5", "1", "1.5", "2"]);
/// assert!("errors.drift_sd_mm=1,1".parse::<Axis>().is_err());
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Axis {
    text: String,
    key: String,
    values: Vec<String>,
}

impl Axis {
    /// The key of the scene.
    pub fn key(&self) -> &str {
        &self.key
    }

    /// Its values, without repetition.
    pub fn values(&self) -> &[String] {
        &self.values
    }
}

impl FromStr for Axis {
    type Err = StudyError;

    /// `key=a,b,c` or `key=from:to:steps`.
    fn from_str(text: &str) -> Result<Self, StudyError> {
        let wrong = || {
            StudyError::invalid(
                format!("axis {text}: expected KEY=a,b,c or KEY=from:to:steps"),
                "experiment.poses_per_group=3,4,6 or errors.drift_sd_mm=0:2:5",
            )
        };
        let (key, values) = text.split_once('=').ok_or_else(wrong)?;
        let parts: Vec<&str> = values.split(':').collect();
        let values: Vec<String> = match parts.as_slice() {
            [from, to, steps] => {
                let (from, to): (f64, f64) = from.parse().ok().zip(to.parse().ok()).ok_or_else(wrong)?;
                let steps: u32 = steps
                    .parse()
                    .ok()
                    .filter(|n| (2..=MAX_STEPS).contains(n))
                    .ok_or_else(wrong)?;
                (0..steps)
                    .map(|i| (from + (to - from) * f64::from(i) / f64::from(steps - 1)).to_string())
                    .collect()
            }
            [list] => list.split(',').map(str::to_owned).collect(),
            _ => return Err(wrong()),
        };
        if key.is_empty() || values.iter().any(String::is_empty) {
            return Err(wrong());
        }
        if let Some(twice) = (1..values.len()).find(|i| values[..*i].contains(&values[*i])) {
            return Err(StudyError::invalid(
                format!("axis {text}: {} is given twice", values[twice]),
                "give every value of an axis once",
            ));
        }
        Ok(Self {
            text: text.to_owned(),
            key: key.to_owned(),
            values,
        })
    }
}

/// Returns all combinations of the values of the axes, each with the scene that `load` returns for the settings
/// `KEY=VALUE`.
///
/// # Errors
/// [`StudyError::Invalid`] if a key has two axes, or an axis and a setting; any error of `load`.
pub fn grid<E: From<StudyError>>(
    axes: &[Axis],
    settings: &[String],
    load: impl Fn(&[String]) -> Result<Scene, E>,
) -> Result<Vec<Cell>, E> {
    let mut grid: Vec<Vec<(String, String)>> = vec![Vec::new()];
    for (number, axis) in axes.iter().enumerate() {
        if axes[..number].iter().any(|other| other.key == axis.key) {
            return Err(StudyError::invalid(
                format!("axis {}: {} already has an axis", axis.text, axis.key),
                "give all values of a key in one axis",
            )
            .into());
        }
        if let Some(set) = settings
            .iter()
            .find(|set| set.split('=').next() == Some(&axis.key))
        {
            return Err(StudyError::invalid(
                format!("axis {}: the setting {set} gives it one value", axis.text),
                "omit the setting",
            )
            .into());
        }
        grid = grid
            .iter()
            .flat_map(|cell| {
                axis.values.iter().map(|value| {
                    let mut cell = cell.clone();
                    cell.push((axis.key.clone(), value.clone()));
                    cell
                })
            })
            .collect();
    }
    grid.into_iter()
        .map(|values| {
            let mut all = settings.to_vec();
            all.extend(values.iter().map(|(key, value)| format!("{key}={value}")));
            Ok(Cell {
                scene: load(&all)?,
                values,
            })
        })
        .collect()
}
